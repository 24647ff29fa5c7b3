#include "tools/layer_auto.hpp"

#include <fnmatch.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <map>

#include <fmt/core.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>
#include <toml++/toml.h>

namespace fovea::tools {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> rule_folders(const std::string& named) {
    if (!named.empty()) return {named};
    std::error_code ignored;
    const fs::path bin = fs::read_symlink("/proc/self/exe", ignored).parent_path();
    return {"/etc/fovea/layer", "/usr/share/fovea/layer", bin / "../../../configs/layer"};
}

bool is_number(const std::string& text, double least, double most) {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc{} && end == text.data() + text.size() && value >= least && value <= most;
}

Error wrong(const fs::path& file, const std::string& what) {
    return {what, file.string(), "configs/layer/README.md lists the legal keys and their ranges"};
}

// The keys of one file as the layer reads them.
Result<std::map<std::string, std::string>> read_keys(const toml::table& table, const fs::path& file) {
    std::map<std::string, std::string> keys;
    for (const auto& [name, node] : table) {
        const std::string key(name.str());
        if (key == "programs") continue;
        const auto number = node.value<double>();
        if (key == "focus") {
            const auto* pair = node.as_array();
            const auto x = pair && pair->size() == 2 ? pair->get(0)->value<double>() : std::nullopt;
            const auto y = pair && pair->size() == 2 ? pair->get(1)->value<double>() : std::nullopt;
            if (!x || !y) return std::unexpected(wrong(file, "focus is not two numbers"));
            keys[key] = fmt::format("{},{}", *x, *y);
        } else if (key == "except") {
            std::vector<std::string> names;
            const auto* list = node.as_array();
            if (!list) return std::unexpected(wrong(file, "except is not a list of names"));
            for (const auto& item : *list) names.push_back(item.value_or(std::string()));
            keys[key] = fmt::format("{}", fmt::join(names, ","));
        } else if (key == "always" && node.is_boolean()) {
            keys[key] = node.value_or(false) ? "1" : "0";
        } else if (number && (key == "gain_x" || key == "gain_y" || key == "area" || key == "fov_deg" || key == "offscreen")) {
            keys[key] = fmt::format("{}", *number);
        } else {
            return std::unexpected(wrong(file, fmt::format("'{}' is no key, or its value has the wrong type", key)));
        }
    }
    return keys;
}

Result<std::map<std::string, std::string>> rules_for(const AutoOptions& options, const std::string& program) {
    for (const fs::path& folder : rule_folders(options.rules)) {
        std::error_code error;
        std::vector<fs::path> files;
        for (const auto& entry : fs::directory_iterator(folder, error))
            if (entry.path().extension() == ".toml") files.push_back(entry.path());
        if (error && !options.rules.empty()) return std::unexpected(Error{"cannot read the folder", folder.string(), "name a folder of rule files with --rules"});
        std::sort(files.begin(), files.end());
        for (const fs::path& file : files) {
            toml::table parsed;
            try {
                parsed = toml::parse_file(file.string());
            } catch (const toml::parse_error& e) {
                return std::unexpected(wrong(file, fmt::format("line {}: {}", e.source().begin.line, e.description())));
            }
            const auto* programs = parsed["programs"].as_array();
            if (!programs) return std::unexpected(wrong(file, "no list 'programs'"));
            const bool matches = std::any_of(programs->begin(), programs->end(), [&](const toml::node& pattern) {
                return fnmatch(pattern.value_or(std::string()).c_str(), program.c_str(), 0) == 0;
            });
            if (matches) return read_keys(parsed, file);
        }
    }
    return std::map<std::string, std::string>{};
}

}  // namespace

Result<std::string> auto_environment(const AutoOptions& options, const std::string& program) {
    auto keys = rules_for(options, fs::path(program).filename().string());
    if (!keys) return std::unexpected(keys.error());
    // A vector option of CLI11 would take the `--` that ends our own options for its own end.
    if (!options.gain.empty()) {
        const std::size_t comma = options.gain.find(',');
        (*keys)["gain_x"] = options.gain.substr(0, comma);
        (*keys)["gain_y"] = comma == std::string::npos ? options.gain : options.gain.substr(comma + 1);
        for (const char* key : {"gain_x", "gain_y"})
            if (!is_number((*keys)[key], 0, 1e6)) return fail("no gain: " + options.gain, "--gain", "one number from 0 to 1e6, or two as in 4,3");
    }
    if (!options.focus.empty()) {
        const std::size_t comma = options.focus.find(',');
        if (comma == std::string::npos || !is_number(options.focus.substr(0, comma), -10, 10) || !is_number(options.focus.substr(comma + 1), -10, 10))
            return fail("no focal point: " + options.focus, "--focus", "two numbers from -10 to 10, as in 0.2,-0.1");
        (*keys)["focus"] = options.focus;
    }
    if (options.area) (*keys)["area"] = fmt::format("{}", *options.area);
    if (options.fov_deg) (*keys)["fov_deg"] = fmt::format("{}", *options.fov_deg);
    if (options.always) (*keys)["always"] = "1";
    if (options.compare) (*keys)["compare"] = "1", (*keys)["always"] = "0";
    std::string text;
    for (const auto& [key, value] : *keys) text += (text.empty() ? "" : ";") + key + "=" + value;
    return text;
}

std::string auto_report(const std::string& counters_json) {
    const auto counters = nlohmann::json::parse(counters_json, nullptr, false);
    if (counters.is_discarded() || !counters.contains("auto")) return {};
    const auto full = counters.value("pixels_full", 0.0), planned = counters.value("pixels_planned", 0.0);
    std::string text = fmt::format("{} frames; {} submissions foveated, {} at full density; {:.0f} % of the pixels\n",
                                   counters.value("frames", 0), counters.value("submissions_levels", 0),
                                   counters.value("submissions_native", 0), full > 0 ? 100 * planned / full : 100.0);
    for (const auto& [reason, n] : counters["auto"]["full_density_submissions"].items())
        text += fmt::format("  full density because of {}: {}\n", reason, n.get<std::uint64_t>());
    int number = 0;
    for (const auto& program : counters["auto"]["programs"]) {
        ++number;
        std::string why;
        for (const auto& [reason, n] : program["draws_full"].items()) why += fmt::format(", {} {}", reason, n.get<std::uint64_t>());
        const auto foveated = program.value("draws_foveated", std::uint64_t{0});
        if (foveated == 0 && why.empty()) continue;  // never drawn to a target that could be foveated
        text += fmt::format("  program {:<2} may be foveated in {} draws{}   | {}\n", number, foveated, why, program.value("shader", ""));
    }
    return text;
}

std::string comparison_report(const std::string& counters_json) {
    const auto counters = nlohmann::json::parse(counters_json, nullptr, false);
    if (counters.is_discarded() || !counters.contains("auto")) return {};
    const auto compare = counters["auto"].value("compare", nlohmann::json());
    if (!compare.is_object()) return "no comparison: the program drew fewer than 54 frames\n";
    const auto line = [&](const char* what, const char* key) {
        const auto processor = compare[std::string(key) + "_processor"], time = compare[std::string(key) + "_time"];
        return fmt::format("{:<36} {:.3f} of the processor time ({:.3f} to {:.3f}), {:.3f} of the time ({:.3f} to {:.3f})\n", what,
                           processor[1].get<double>(), processor[0].get<double>(), processor[2].get<double>(), time[1].get<double>(),
                           time[0].get<double>(), time[2].get<double>());
    };
    return fmt::format("a frame straight from the driver: {:.2f} ms of processor time, {:.2f} ms; {} pairs of blocks, median and middle half\n",
                       compare.value("processor_ms", 0.0), compare.value("time_ms", 0.0), compare.value("pairs", 0)) +
           line("recorded, replayed at full density", "recorded") + line("foveated", "levels");
}

}  // namespace fovea::tools
