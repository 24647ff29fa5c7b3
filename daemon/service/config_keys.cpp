#include "daemon/service/config_keys.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "daemon/pipeline/settings_table.hpp"

namespace fovea::service {
namespace {

using V = KeyValue;
using Ints = std::vector<std::int64_t>;

ConfigKey boolean(const char* section, const char* name, const char* doc, bool& (*member)(Config&)) {
    return {section, name, "true or false", doc,
            [member](const Config& c) { return V{member(const_cast<Config&>(c))}; },  // read only
            [](const V&) { return true; },
            [member](Config& c, const V& v) { member(c) = std::get<bool>(v); }};
}

ConfigKey integer(const char* section, const char* name, std::int64_t least, std::int64_t most, const char* doc,
                  std::int64_t& (*member)(Config&)) {
    return {section, name, fmt::format("[{}, {}]", least, most), doc,
            [member](const Config& c) { return V{member(const_cast<Config&>(c))}; },
            [=](const V& v) { return std::get<std::int64_t>(v) >= least && std::get<std::int64_t>(v) <= most; },
            [member](Config& c, const V& v) { member(c) = std::get<std::int64_t>(v); }};
}

ConfigKey milliseconds(const char* section, const char* name, double least, double most, const char* doc,
                       Duration& (*member)(Config&)) {
    return {section, name, fmt::format("[{}, {}] ms", least, most), doc,
            [member](const Config& c) { return V{to_seconds(member(const_cast<Config&>(c))) * 1e3}; },
            [=](const V& v) { return std::get<double>(v) >= least && std::get<double>(v) <= most; },
            [member](Config& c, const V& v) { member(c) = seconds(std::get<double>(v) * 1e-3); }};
}

ConfigKey text(const char* section, const char* name, const char* legal, const char* doc,
               std::string& (*member)(Config&), std::vector<std::string> words = {}) {
    return {section, name, words.empty() ? std::string(legal) : fmt::format("{}", fmt::join(words, ", ")), doc,
            [member](const Config& c) { return V{member(const_cast<Config&>(c))}; },
            [words](const V& v) {
                return words.empty() || std::ranges::find(words, std::get<std::string>(v)) != words.end();
            },
            [member](Config& c, const V& v) { member(c) = std::get<std::string>(v); }};
}

ConfigKey ids(const char* section, const char* name, const char* doc, Ints& (*member)(Config&)) {
    constexpr std::int64_t kLastId = 4294967294;  // (uid_t)-1 means "nobody at all" to the kernel
    return {section, name, fmt::format("numbers in [0, {}]", kLastId), doc,
            [member](const Config& c) { return V{member(const_cast<Config&>(c))}; },
            [](const V& v) {
                return std::ranges::all_of(std::get<Ints>(v), [](std::int64_t id) { return id >= 0 && id <= kLastId; });
            },
            [member](Config& c, const V& v) { member(c) = std::get<Ints>(v); }};
}

V widen(const pipeline::SettingValue& value) {
    return std::visit([](const auto& x) { return V{x}; }, value);
}

pipeline::SettingValue narrow(const V& value) {
    if (const bool* b = std::get_if<bool>(&value)) return *b;
    if (const double* d = std::get_if<double>(&value)) return *d;
    return std::get<std::string>(value);
}

ConfigKey pipeline_key(const pipeline::SettingRow& row) {
    const std::string key = row.key;
    const std::size_t dot = key.rfind('.');
    return {key.substr(0, dot), key.substr(dot + 1), pipeline::legal_values(row), row.text,
            [&row](const Config& c) { return widen(row.get(c.pipeline)); },
            [&row](const V& v) {
                pipeline::PipelineSettings scratch;
                return pipeline::apply_setting(scratch, row, narrow(v)).has_value();
            },
            [&row](Config& c, const V& v) { row.set(c.pipeline, narrow(v)); }};
}

std::vector<ConfigKey> make_keys() {
    std::vector<ConfigKey> keys = {
        text("source", "driver", "a driver's name", "Which driver delivers the gaze",
             [](Config& c) -> std::string& { return c.source.driver; }),
        boolean("source", "wait_for_client", "Open the source only when the first client has connected",
                [](Config& c) -> bool& { return c.source.wait_for_client; }),
        integer("source", "realtime_priority", 0, 50,
                "Real-time priority of the thread that reads a tracker, where the system allows it (LimitRTPRIO=); 0: none",
                [](Config& c) -> std::int64_t& { return c.source.realtime_priority; }),
        boolean("source", "rehearse",
                "Wake shortly before a tracker's next sample is due and go its way once on a copy, so that it meets warm caches",
                [](Config& c) -> bool& { return c.source.rehearse; }),
    };
    for (const pipeline::SettingRow& row : pipeline::settings_table()) keys.push_back(pipeline_key(row));
    const ConfigKey server[] = {
        text("pipeline", "calibration", "a file path", "What `fovea calibrate` wrote for the person who looks; empty: trust the tracker",
             [](Config& c) -> std::string& { return c.calibration; }),
        text("server", "focus_socket", "a path, at most 107 bytes", "Where clients connect; empty: focus.sock in the run directory",
             [](Config& c) -> std::string& { return c.server.focus_socket; }),
        text("server", "admin_socket", "a path, at most 107 bytes", "Where `fovea status` connects; empty: admin.sock in the run directory",
             [](Config& c) -> std::string& { return c.server.admin_socket; }),
        ids("server", "uids", "Users who may connect, besides root and the daemon's own user",
            [](Config& c) -> Ints& { return c.server.uids; }),
        ids("server", "gids", "Groups whose processes may connect", [](Config& c) -> Ints& { return c.server.gids; }),
        ids("server", "sample_uids", "Users who may read raw gaze samples, besides root and the daemon's own user",
            [](Config& c) -> Ints& { return c.server.sample_uids; }),
        integer("server", "max_clients", 1, 256, "How many clients may be connected at once",
                [](Config& c) -> std::int64_t& { return c.server.max_clients; }),
        milliseconds("server", "heartbeat_ms", 1, 50, "Between two heartbeats, and between two looks at the clients' frame reports",
                     [](Config& c) -> Duration& { return c.server.heartbeat; }),
        boolean("server", "lock_memory", "Keep the daemon's memory from being paged out; needs CAP_IPC_LOCK or a memlock limit",
                [](Config& c) -> bool& { return c.server.lock_memory; }),
        text("record", "path", "a file path", "Session file to write; a number is added if it exists; empty: record nothing",
             [](Config& c) -> std::string& { return c.record.path; }),
        text("log", "level", "", "Least important message that is written to stderr",
             [](Config& c) -> std::string& { return c.log.level; }, {"error", "warn", "info", "debug"}),
    };
    keys.insert(keys.end(), std::begin(server), std::end(server));
    return keys;
}

// Levenshtein distance.
std::size_t edits(std::string_view a, std::string_view b) {
    std::vector<std::size_t> row(b.size() + 1);
    for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
    for (std::size_t i = 1; i <= a.size(); ++i) {
        std::size_t diagonal = row[0];
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const std::size_t above = row[j];
            row[j] = std::min({above + 1, row[j - 1] + 1, diagonal + (a[i - 1] == b[j - 1] ? 0u : 1u)});
            diagonal = above;
        }
    }
    return row[b.size()];
}

}  // namespace

const std::vector<ConfigKey>& config_keys() {
    static const std::vector<ConfigKey> keys = make_keys();
    return keys;
}

std::string nearest(const std::string& typed, const std::vector<std::string>& legal) {
    std::string best;
    std::size_t least = std::max<std::size_t>(2, typed.size() / 3) + 1;  // further off is not a typing error
    for (const std::string& name : legal) {
        // A forgotten unit is the commonest slip: "hold" for "hold_ms".
        const std::size_t distance = !typed.empty() && name.starts_with(typed + "_") ? 1 : edits(typed, name);
        if (distance < least) {
            least = distance;
            best = name;
        }
    }
    return best;
}

}  // namespace fovea::service
