// The visible table of the daemon's keys. A new setting is one row here and a member in its struct.
#pragma once

#include <functional>
#include <string>
#include <variant>
#include <vector>

#include "daemon/service/config.hpp"

namespace fovea::service {

// The type of a key is the alternative that its default holds.
using KeyValue = std::variant<bool, std::int64_t, double, std::string, std::vector<std::int64_t>>;

struct ConfigKey {
    std::string section;                // "filter.one_euro"
    std::string name;                   // ends in its unit
    std::string legal;                  // for people: "(0, 1000] Hz", "true or false", "hold, damped_velocity"
    std::string doc;                    // one line, no full stop
    std::function<KeyValue(const Config&)> get;
    std::function<bool(const KeyValue&)> is_legal;            // the value has the right type already
    std::function<void(Config&, const KeyValue&)> set;        // the value is legal
};

// In the order of the file; rows of one section stand together. The rows of the pipeline come from its own table
// (daemon/pipeline/settings_table.hpp); [source] also takes the chosen driver's own keys.
[[nodiscard]] const std::vector<ConfigKey>& config_keys();

// The name among `legal` that a person most likely meant; empty when none is near.
[[nodiscard]] std::string nearest(const std::string& typed, const std::vector<std::string>& legal);

}  // namespace fovea::service
