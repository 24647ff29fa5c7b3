// The little of SQLite that the session file uses, with errors as the project's errors.
//
// Threads: a Database and its Statements belong to one thread at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "protocol/clock.hpp"
#include "protocol/error.hpp"

struct sqlite3;
struct sqlite3_stmt;

namespace fovea::replay {

class Database {
public:
    [[nodiscard]] static Result<Database> open(const std::filesystem::path& path, bool writable);
    [[nodiscard]] Result<void> execute(const char* sql);
    [[nodiscard]] std::unexpected<Error> error(const std::string& what) const;  // of the last call
    [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
    [[nodiscard]] sqlite3* get() const noexcept { return handle_.get(); }

private:
    struct Close {
        void operator()(sqlite3* handle) const noexcept;
    };
    std::unique_ptr<sqlite3, Close> handle_;
    std::filesystem::path path_;
};

// A prepared statement. To write: begin(), put() per parameter in order, run(). To read: step(), then take per column.
class Statement {
public:
    [[nodiscard]] static Result<Statement> prepare(const Database& database, const std::string& sql);

    void begin() noexcept;
    void put(std::int64_t value) noexcept;
    void put(std::uint64_t value) noexcept { put(static_cast<std::int64_t>(value)); }
    void put(std::uint32_t value) noexcept { put(static_cast<std::int64_t>(value)); }
    void put(bool value) noexcept { put(static_cast<std::int64_t>(value)); }
    void put(Instant value) noexcept { put(std::int64_t{to_ns(value)}); }
    void put(double value) noexcept;  // NaN becomes NULL
    void put_text(std::string_view value) noexcept;
    void put_blob(std::string_view value) noexcept;
    [[nodiscard]] bool run() noexcept;  // false: Database::error says why

    enum class Step : std::uint8_t { row, done, failed };
    [[nodiscard]] Step step() noexcept;  // to the next row, and its first column
    [[nodiscard]] std::int64_t take_integer() noexcept;
    [[nodiscard]] bool take_flag() noexcept { return take_integer() != 0; }
    [[nodiscard]] Instant take_instant() noexcept { return instant_from_ns(take_integer()); }
    [[nodiscard]] double take_real() noexcept;  // NULL is NaN
    [[nodiscard]] std::string take_text();
    [[nodiscard]] std::span<const std::byte> take_blob() noexcept;  // until the next step

private:
    struct Finalize {
        void operator()(sqlite3_stmt* handle) const noexcept;
    };
    std::unique_ptr<sqlite3_stmt, Finalize> handle_;
    int next_ = 0;
    bool bound_ = true;  // every put() has succeeded
};

}  // namespace fovea::replay
