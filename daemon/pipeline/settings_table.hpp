// Every key of the pipeline as a row: what a config file may say, in which unit and range, and which member it sets.
//
// The one place where a range is written down for machines: the config reader, the documentation of the defaults and
// Pipeline::create() read it. A key is a dotted TOML path, e.g. "filter.one_euro.min_cutoff_hz" is `min_cutoff_hz` in
// the table [filter.one_euro].
//
// Threads: constant data.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <variant>

#include "daemon/pipeline/settings.hpp"
#include "protocol/error.hpp"

namespace fovea::pipeline {

using SettingValue = std::variant<bool, double, std::string>;

enum class SettingKind : std::uint8_t { boolean, number, choice };  // choice: text, one of `choices`

struct SettingRow {
    const char* key;
    SettingKind kind;
    const char* unit;        // "ms", "Hz", ...; "" for a ratio, a flag or a name
    double min, max;         // number: the legal range; max is always legal
    bool min_legal;          // number: false when the range is open at min, as in (0, 1000]
    std::span<const char* const> choices;
    const char* text;        // one sentence for people
    SettingValue (*get)(const PipelineSettings&);
    void (*set)(PipelineSettings&, const SettingValue&);  // the value has the row's kind and lies in its range
};

[[nodiscard]] std::span<const SettingRow> settings_table();
// Nothing when there is no such key.
[[nodiscard]] const SettingRow* find_setting(std::string_view key);

// The legal values as people write them: "(0, 1000] Hz", "true or false", "hold, damped_velocity".
[[nodiscard]] std::string legal_values(const SettingRow& row);
// A default as TOML writes it: 5.0, true, "one_euro".
[[nodiscard]] std::string toml_value(const SettingValue& value);

// Checks kind and range, then sets the member. The error's what and way_out are filled, its `where` is the caller's.
[[nodiscard]] Result<void> apply_setting(PipelineSettings& settings, const SettingRow& row, const SettingValue& value);
// Every member against the table, as Pipeline::create() does.
[[nodiscard]] Result<void> check_settings(const PipelineSettings& settings);

[[nodiscard]] std::span<const char* const> filter_names();
[[nodiscard]] std::span<const char* const> predictor_names();

}  // namespace fovea::pipeline
