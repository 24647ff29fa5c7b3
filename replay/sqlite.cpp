#include "replay/sqlite.hpp"

#include <sqlite3.h>

#include <limits>
#include <system_error>

namespace fovea::replay {
namespace {

// What a user can do about a result code.
const char* way_out(int code) {
    switch (code & 0xff) {
        case SQLITE_FULL: return "free some space, or write to another disk";
        case SQLITE_CORRUPT:
        case SQLITE_NOTADB: return "the file is torn or damaged: copy it again, or record again";
        case SQLITE_BUSY:
        case SQLITE_LOCKED: return "another process holds the file: end it, or copy the file";
        case SQLITE_CANTOPEN:
        case SQLITE_READONLY:
        case SQLITE_PERM:
            return "check the permissions of the file and of its directory; a session that was not closed needs a "
                   "writable directory to be recovered in";
        case SQLITE_IOERR: return "check the disk and the space on it";
        default: return "report this with the file";
    }
}

}  // namespace

void Database::Close::operator()(sqlite3* handle) const noexcept { sqlite3_close_v2(handle); }
void Statement::Finalize::operator()(sqlite3_stmt* handle) const noexcept { sqlite3_finalize(handle); }

Result<Database> Database::open(const std::filesystem::path& path, bool writable) {
    Database database;
    database.path_ = path;
    sqlite3* handle = nullptr;
    const int flags = (writable ? SQLITE_OPEN_READWRITE : SQLITE_OPEN_READONLY) | SQLITE_OPEN_NOMUTEX;
    // "file:" names are not asked for, so no name has a second meaning; a name like ":memory:" has, unless made a path.
    const std::string name = path.is_absolute() ? path.string() : "./" + path.string();
    const int code = sqlite3_open_v2(name.c_str(), &handle, flags, nullptr);
    database.handle_.reset(handle);
    if (code != SQLITE_OK) return database.error("cannot open the session");
    sqlite3_extended_result_codes(handle, 1);
    sqlite3_busy_timeout(handle, 2000);
    // The file may come from anywhere: nothing in its schema is run on trust.
    sqlite3_db_config(handle, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    sqlite3_db_config(handle, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
    return database;
}

Result<void> Database::execute(const char* sql) {
    if (sqlite3_exec(get(), sql, nullptr, nullptr, nullptr) != SQLITE_OK) return error("the session file fails");
    return {};
}

std::unexpected<Error> Database::error(const std::string& what) const {
    if (!get()) return fail(what + ": out of memory", path_.string(), "free some memory");
    const int code = sqlite3_extended_errcode(get());
    std::string text = what + ": " + sqlite3_errmsg(get());
    if (const int system = sqlite3_system_errno(get()); system != 0 && (code & 0xff) != SQLITE_CORRUPT)
        text += " (" + std::generic_category().message(system) + ")";
    return fail(std::move(text), path_.string(), way_out(code));
}

Result<Statement> Statement::prepare(const Database& database, const std::string& sql) {
    Statement statement;
    sqlite3_stmt* handle = nullptr;
    const int code = sqlite3_prepare_v3(database.get(), sql.c_str(), static_cast<int>(sql.size()),
                                        SQLITE_PREPARE_PERSISTENT, &handle, nullptr);
    statement.handle_.reset(handle);
    if (code != SQLITE_OK) return database.error("the session file lacks what its schema promises");
    return statement;
}

void Statement::begin() noexcept {
    sqlite3_reset(handle_.get());
    next_ = 0;
    bound_ = true;
}
void Statement::put(std::int64_t value) noexcept {
    bound_ &= sqlite3_bind_int64(handle_.get(), ++next_, value) == SQLITE_OK;
}
void Statement::put(double value) noexcept {
    bound_ &= sqlite3_bind_double(handle_.get(), ++next_, value) == SQLITE_OK;
}
void Statement::put_text(std::string_view value) noexcept {
    bound_ &= sqlite3_bind_text64(handle_.get(), ++next_, value.data(), value.size(), SQLITE_TRANSIENT, SQLITE_UTF8) ==
              SQLITE_OK;
}
void Statement::put_blob(std::string_view value) noexcept {
    bound_ &= sqlite3_bind_blob64(handle_.get(), ++next_, value.data(), value.size(), SQLITE_TRANSIENT) == SQLITE_OK;
}
bool Statement::run() noexcept {
    return bound_ && next_ == sqlite3_bind_parameter_count(handle_.get()) && sqlite3_step(handle_.get()) == SQLITE_DONE;
}

Statement::Step Statement::step() noexcept {
    next_ = 0;
    const int code = sqlite3_step(handle_.get());
    return code == SQLITE_ROW ? Step::row : code == SQLITE_DONE ? Step::done : Step::failed;
}
std::int64_t Statement::take_integer() noexcept { return sqlite3_column_int64(handle_.get(), next_++); }
double Statement::take_real() noexcept {
    const int column = next_++;
    return sqlite3_column_type(handle_.get(), column) == SQLITE_NULL ? std::numeric_limits<double>::quiet_NaN()
                                                                     : sqlite3_column_double(handle_.get(), column);
}
std::string Statement::take_text() {
    const int column = next_++;
    const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(handle_.get(), column));
    return text ? std::string(text, static_cast<std::size_t>(sqlite3_column_bytes(handle_.get(), column))) : "";
}
std::span<const std::byte> Statement::take_blob() noexcept {
    const int column = next_++;
    const auto* bytes = static_cast<const std::byte*>(sqlite3_column_blob(handle_.get(), column));
    return {bytes, bytes ? static_cast<std::size_t>(sqlite3_column_bytes(handle_.get(), column)) : 0};
}

}  // namespace fovea::replay
