#include "daemon/service/config.hpp"

#include <algorithm>
#include <fstream>
#include <sstream>

#include <fmt/format.h>

#include <toml++/toml.h>

#include "daemon/service/config_keys.hpp"

namespace fovea::service {
namespace {

using drivers::DeviceRow;

std::string joined(const std::vector<std::string>& names) { return fmt::format("{}", fmt::join(names, ", ")); }

// "did you mean 'x'? legal keys: ..." or only the second half.
std::string way_to(const std::string& typed, const std::vector<std::string>& legal, const char* kind) {
    const std::string near = nearest(typed, legal);
    return (near.empty() ? std::string{} : fmt::format("did you mean '{}'? ", near)) +
           fmt::format("legal {}: {}", kind, joined(legal));
}

const DeviceRow* find_device(const std::vector<DeviceRow>& devices, const std::string& driver) {
    const auto it = std::ranges::find_if(devices, [&](const DeviceRow& row) { return driver == row.driver; });
    return it == devices.end() ? nullptr : &*it;
}

std::vector<std::string> section_names() {
    std::vector<std::string> names;
    for (const ConfigKey& key : config_keys())
        if (std::ranges::find(names, key.section) == names.end()) names.push_back(key.section);
    return names;
}

const char* type_name(const KeyValue& v) {
    constexpr const char* kNames[] = {"true or false", "a whole number", "a number", "text in quotes",
                                      "a list of whole numbers"};
    return kNames[v.index()];
}

// The node as the type that `wanted` holds, or nothing when it is of another type.
std::optional<KeyValue> convert(const toml::node& node, const KeyValue& wanted) {
    if (std::holds_alternative<bool>(wanted)) {
        if (const auto v = node.value_exact<bool>()) return KeyValue{*v};
    } else if (std::holds_alternative<std::int64_t>(wanted)) {
        if (const auto v = node.value_exact<std::int64_t>()) return KeyValue{*v};
    } else if (std::holds_alternative<double>(wanted)) {
        if (const auto v = node.value_exact<double>()) return KeyValue{*v};
        if (const auto v = node.value_exact<std::int64_t>()) return KeyValue{static_cast<double>(*v)};
    } else if (std::holds_alternative<std::string>(wanted)) {
        if (auto v = node.value_exact<std::string>()) return KeyValue{std::move(*v)};
    } else if (const toml::array* array = node.as_array()) {
        std::vector<std::int64_t> ids;
        for (const toml::node& element : *array) {
            const auto v = element.value_exact<std::int64_t>();
            if (!v) return std::nullopt;
            ids.push_back(*v);
        }
        return KeyValue{ids};
    }
    return std::nullopt;
}

// A basic string: in double quotes, with escapes.
std::string toml_text(const std::string& text) {
    std::string out = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') out += '\\';
        if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
            out += fmt::format("\\u{:04x}", static_cast<unsigned>(c));
        else
            out += c;
    }
    return out + "\"";
}

std::string toml_text(const KeyValue& value) {
    if (const bool* b = std::get_if<bool>(&value)) return *b ? "true" : "false";
    if (const auto* i = std::get_if<std::int64_t>(&value)) return fmt::format("{}", *i);
    if (const auto* list = std::get_if<std::vector<std::int64_t>>(&value)) return fmt::format("[{}]", fmt::join(*list, ", "));
    if (const auto* s = std::get_if<std::string>(&value)) return toml_text(*s);
    const std::string number = fmt::format("{}", std::get<double>(value));
    return number.find_first_of(".en") == std::string::npos ? number + ".0" : number;
}

class Reader {
public:
    Reader(Config& config, const std::string& name, const std::filesystem::path& folder,
           const std::vector<DeviceRow>& devices)
        : config_{config}, name_{name}, folder_{folder}, devices_{devices}, sections_{section_names()} {}

    Result<void> read(const toml::table& root) {
        if (auto ok = read_section("", root); !ok) return ok;
        return read_source(root["source"].as_table());
    }

private:
    std::string place(const toml::source_region& region) const {
        if (region.begin.line == 0) return name_;
        return fmt::format("{}:{}:{}", name_, region.begin.line, region.begin.column);
    }

    bool is_section(const std::string& path) const {
        return std::ranges::any_of(sections_, [&](const std::string& s) { return s == path || s.starts_with(path + "."); });
    }

    Result<void> read_section(const std::string& section, const toml::table& table) {
        for (const auto& [key, node] : table) {
            const std::string name{key.str()};
            const std::string path = section.empty() ? name : section + "." + name;
            if (is_section(path)) {
                const toml::table* inner = node.as_table();
                if (inner == nullptr)
                    return fail(fmt::format("'{}' is a section, not a value", path), place(node.source()),
                                fmt::format("write [{}] on a line of its own", path));
                if (auto ok = read_section(path, *inner); !ok) return ok;
                continue;
            }
            const auto row = std::ranges::find_if(
                config_keys(), [&](const ConfigKey& k) { return k.section == section && k.name == name; });
            if (row != config_keys().end()) {
                if (auto ok = read_key(*row, path, node); !ok) return ok;
            } else if (section != "source") {  // the driver's own keys are read when the driver is known
                return unknown(section, name, node, place(key.source()));
            }
        }
        return {};
    }

    Result<void> unknown(const std::string& section, const std::string& name, const toml::node& node,
                         std::string where) const {
        if (node.is_table())
            return fail(fmt::format("unknown section [{}]", section.empty() ? name : section + "." + name),
                        std::move(where), way_to(section.empty() ? name : section + "." + name, sections_, "sections"));
        std::vector<std::string> legal;
        for (const ConfigKey& k : config_keys())
            if (k.section == section) legal.push_back(k.name);
        if (legal.empty())
            return fail(fmt::format("'{}' stands outside the section that it belongs to", name), std::move(where),
                        way_to(name, sections_, "sections"));
        return fail(fmt::format("unknown key '{}' in [{}]", name, section), std::move(where), way_to(name, legal, "keys"));
    }

    Result<void> read_key(const ConfigKey& row, const std::string& path, const toml::node& node) {
        const KeyValue example = row.get(config_);
        const auto value = convert(node, example);
        if (!value)
            return fail(fmt::format("'{}' must be {}", path, type_name(example)), place(node.source()),
                        "legal: " + row.legal);
        if (!row.is_legal(*value))
            return fail(fmt::format("'{}' cannot be {}", path, toml_text(*value)), place(node.source()),
                        "legal: " + row.legal);
        if (path == "source.driver") return read_driver(std::get<std::string>(*value), node);
        row.set(config_, *value);
        resolve(path);
        return {};
    }

    Result<void> read_driver(const std::string& driver, const toml::node& node) {
        if (find_device(devices_, driver) == nullptr) {
            std::vector<std::string> legal;
            for (const DeviceRow& row : devices_) legal.emplace_back(row.driver);
            return fail(fmt::format("unknown driver '{}'", driver), place(node.source()), way_to(driver, legal, "drivers"));
        }
        if (driver != config_.source.driver) config_.source.device.values.clear();  // they were another driver's
        config_.source.driver = driver;
        return {};
    }

    // Paths in a file are relative to the file, so that it can be started from anywhere.
    void resolve(const std::string& path) const {
        for (auto [key, text] : {std::pair{"record.path", &config_.record.path},
                                 std::pair{"pipeline.calibration", &config_.calibration},
                                 std::pair{"server.focus_socket", &config_.server.focus_socket},
                                 std::pair{"server.admin_socket", &config_.server.admin_socket}})
            if (path == key && !text->empty()) *text = (folder_ / *text).lexically_normal().string();
    }

    Result<void> read_source(const toml::table* source) {
        drivers::DeviceSettings& device = config_.source.device;
        if (source == nullptr) return {};
        device.where = place(source->source());
        const DeviceRow* driver = find_device(devices_, config_.source.driver);
        for (const auto& [key, node] : *source) {
            const std::string name{key.str()};
            const bool ours = std::ranges::any_of(config_keys(), [&](const ConfigKey& k) { return k.section == "source" && k.name == name; });
            if (ours) continue;
            std::vector<std::string> legal;
            for (const ConfigKey& k : config_keys())
                if (k.section == "source") legal.push_back(k.name);
            if (driver != nullptr)
                for (const drivers::DeviceKey& k : driver->keys) legal.emplace_back(k.name);
            if (std::ranges::find(legal, name) == legal.end())
                return fail(fmt::format("unknown key '{}' in [source] of driver '{}'", name, config_.source.driver),
                            place(key.source()), way_to(name, legal, "keys"));
            std::string value;
            if (const auto text = node.value_exact<std::string>()) {
                value = *text;
            } else if (const auto flag = node.value_exact<bool>()) {
                value = *flag ? "true" : "false";
            } else if (const auto whole = node.value_exact<std::int64_t>()) {
                value = fmt::format("{}", *whole);
            } else if (const auto number = node.value_exact<double>()) {
                value = fmt::format("{}", *number);
            } else {
                return fail(fmt::format("'source.{}' must be text, a number, true or false", name), place(node.source()));
            }
            if (name == "path" && !value.empty()) value = (folder_ / value).lexically_normal().string();
            device.values[name] = value;
            device.where_of[name] = place(node.source());
        }
        return {};
    }

    Config& config_;
    const std::string& name_;
    const std::filesystem::path& folder_;
    const std::vector<DeviceRow>& devices_;
    std::vector<std::string> sections_;
};

bool is_toml(const std::string& line) {
    try {
        static_cast<void>(toml::parse(line));
        return true;
    } catch (const toml::parse_error&) {
        return false;
    }
}

Result<void> read_into(Config& config, std::string_view text, const std::string& name,
                       const std::filesystem::path& folder, const std::vector<DeviceRow>& devices) {
    toml::table root;
    try {
        root = toml::parse(text, name);
    } catch (const toml::parse_error& error) {
        return fail(fmt::format("this is not TOML: {}", error.description()),
                    fmt::format("{}:{}:{}", name, error.source().begin.line, error.source().begin.column),
                    "`fovead --print-config` prints a file to start from");
    }
    return Reader(config, name, folder, devices).read(root);
}

}  // namespace

Result<Config> parse_config(std::string_view text, const std::string& name, const std::filesystem::path& folder,
                            const std::vector<DeviceRow>& devices) {
    Config config;
    if (auto ok = read_into(config, text, name, folder, devices); !ok) return std::unexpected(ok.error());
    return config;
}

Result<Config> load_config(const std::filesystem::path& file, const std::vector<DeviceRow>& devices) {
    std::ifstream in(file, std::ios::binary);
    std::ostringstream text;
    if (in) text << in.rdbuf();
    if (!in)
        return fail_errno("cannot read the config file", errno != 0 ? errno : EIO, file.string(),
                          "`fovead --print-config > FILE` writes one to start from");
    return parse_config(text.str(), file.string(), std::filesystem::absolute(file).parent_path(), devices);
}

Result<void> set_key(Config& config, std::string_view assignment, const std::vector<DeviceRow>& devices) {
    const std::size_t equals = assignment.find('=');
    const std::string shown = fmt::format("--set {}", assignment);
    if (equals == std::string_view::npos || assignment.find('.') > equals || assignment.find('\n') != std::string_view::npos)
        return fail("this sets nothing", shown, "write --set SECTION.KEY=VALUE, e.g. --set source.speed=2");
    const std::string key{assignment.substr(0, equals)}, value{assignment.substr(equals + 1)};
    const std::filesystem::path folder = std::filesystem::current_path();
    std::string line = key + " = " + value;
    if (!is_toml(line)) line = key + " = " + toml_text(value);  // text without its quotes, as shells leave it
    Config changed = config;
    if (auto ok = read_into(changed, line, "--set", folder, devices); !ok) {
        ok.error().where = shown;  // a line and column of a made-up file would mislead
        return ok;
    }
    for (auto& [name, where] : changed.source.device.where_of)
        if (where.starts_with("--set:")) where = fmt::format("--set source.{}", name);
    if (changed.source.device.where.starts_with("--set")) changed.source.device.where = config.source.device.where;
    config = std::move(changed);
    return {};
}

std::string print_config(const Config& config) {
    std::string out, section;
    for (const ConfigKey& key : config_keys()) {
        if (key.section != section) {
            if (section == "source")
                for (const auto& [name, value] : config.source.device.values) out += fmt::format("{} = {}\n", name, toml_text(value));
            section = key.section;
            out += fmt::format("[{}]\n", section);
        }
        out += fmt::format("{} = {}\n", key.name, toml_text(key.get(config)));
    }
    return out;
}

std::string print_default_config(const std::vector<DeviceRow>& devices) {
    std::string out =
        "# The settings of fovead. Every key is shown with its default; a key that is left out has it too.\n"
        "# Written by `fovead --print-config`. Relative paths are relative to this file.\n";
    const Config defaults;
    std::string section;
    const auto driver_keys = [&] {
        for (const DeviceRow& row : devices) {
            out += fmt::format("\n# Keys of driver \"{}\": {}.\n", row.driver, row.one_line);
            for (const drivers::DeviceKey& key : row.keys) {
                out += fmt::format("#   {}\n#   {} = {}\n", key.doc, key.name, key.default_toml);
            }
        }
    };
    for (const ConfigKey& key : config_keys()) {
        if (key.section != section) {
            if (section == "source") driver_keys();
            section = key.section;
            out += fmt::format("\n[{}]\n", section);
        }
        std::string legal = key.legal;
        if (section == "source" && key.name == "driver") {
            std::vector<std::string> names;
            for (const DeviceRow& row : devices) names.emplace_back(row.driver);
            legal = joined(names);
        }
        out += fmt::format("# {}; {}\n{} = {}\n", key.doc, legal, key.name, toml_text(key.get(defaults)));
    }
    return out;
}

}  // namespace fovea::service
