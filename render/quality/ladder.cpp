#include "render/quality/ladder.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <iterator>

#include <toml++/toml.h>

namespace fovea::quality {
namespace {

using Parameters = foveation::MethodSettings;

// The keys of a setting that are numbers: name, range, who has it, and where it lives.
struct Key {
    const char* name;
    double low, high;
    const char* methods;   // separated by blanks
    std::function<double(const Setting&)> get;
    std::function<void(Setting&, double)> set;
};

const std::vector<Key>& keys() {
    static const std::vector<Key> all = {
        {"gain", 0.1, 1000, "scaled_bins scaled_bins_late", [](const Setting& s) { return s.gain; }, [](Setting& s, double v) { s.gain = v; }},
        {"levels", 1, density::kMaxLevels, "scaled_bins scaled_bins_late", [](const Setting& s) { return double(s.parameters.plan.level_count); },
         [](Setting& s, double v) { s.parameters.plan.level_count = static_cast<int>(v); }},
        {"ratio", 0.05, 1, "inset_outset", [](const Setting& s) { return s.parameters.inset_outset.ratio; },
         [](Setting& s, double v) { s.parameters.inset_outset.ratio = v; }},
        {"context_scale", 0.05, 1, "dynamic_viewports", [](const Setting& s) { return s.parameters.dynamic_viewports.context_scale; },
         [](Setting& s, double v) { s.parameters.dynamic_viewports.context_scale = v; }},
        {"focus_extent", 0.05, 1, "dynamic_viewports", [](const Setting& s) { return s.parameters.dynamic_viewports.focus_extent; },
         [](Setting& s, double v) { s.parameters.dynamic_viewports.focus_extent = v; }},
        {"inner_radius", 0, 4, "shading_rate", [](const Setting& s) { return s.parameters.shading_rate.inner_radius; },
         [](Setting& s, double v) { s.parameters.shading_rate.inner_radius = v; }},
        {"outer_radius", 0, 4, "shading_rate", [](const Setting& s) { return s.parameters.shading_rate.outer_radius; },
         [](Setting& s, double v) { s.parameters.shading_rate.outer_radius = v; }},
    };
    return all;
}

// Whole words only: scaled_bins is the beginning of scaled_bins_late.
bool has_word(std::string_view words, std::string_view word) {
    for (std::size_t at = words.find(word); at != std::string_view::npos; at = words.find(word, at + 1)) {
        const std::size_t end = at + word.size();
        if ((at == 0 || words[at - 1] == ' ') && (end == words.size() || words[end] == ' ')) return true;
    }
    return false;
}

bool has_bins(const Setting& s) { return has_word("scaled_bins scaled_bins_late", s.method); }
bool by_rectangles(const Setting& s) { return s.parameters.executor == foveation::BinExecutor::rectangles; }
bool has_pairs(const Setting& s) { return s.parameters.plan.levels == density::standard_levels(true); }

std::unexpected<Error> fault(const std::string& what, const std::string& name, const toml::source_region& at, const std::string& way_out) {
    return fail(what, name + ":" + std::to_string(at.begin.line) + ":" + std::to_string(at.begin.column), way_out);
}

Result<Setting> parse_setting(const toml::table& table, const std::string& name) {
    Setting s;
    std::string known_methods;
    for (const auto& m : foveation::methods())
        if (std::string_view(m.name) != "auto") known_methods += std::string(known_methods.empty() ? "" : " ") + m.name;
    const auto* method = table.get("method");
    if (method == nullptr || !method->is_string()) return fault("a setting without a method", name, table.source(), "method is one of: " + known_methods);
    s.method = method->as_string()->get();
    if (!has_word(known_methods, s.method)) return fault("unknown method '" + s.method + "'", name, method->source(), "one of: " + known_methods);
    if (has_bins(s)) s.parameters.plan.levels = density::standard_levels(table["pairs"].value_or(false));
    for (const auto& [key, node] : table) {
        const std::string word{key.str()};
        const toml::source_region& at = node.source();
        if (word == "method") continue;
        if (word == "label") {
            if (!node.is_string()) return fault("label is no text", name, at, "");
            s.label = node.as_string()->get();
            continue;
        }
        if (has_bins(s) && word == "pairs") {
            if (!node.is_boolean()) return fault("pairs is true or false", name, at, "");
            continue;
        }
        if (has_bins(s) && word == "reading") {
            const std::string value = node.value_or(std::string());
            if (value != "linear" && value != "area") return fault("reading is \"linear\" or \"area\"", name, at, "");
            s.parameters.plan.reading = value == "area" ? density::Reading::area : density::Reading::linear;
            continue;
        }
        if (s.method == "scaled_bins" && word == "executor") {
            const std::string value = node.value_or(std::string());
            if (value != "masks" && value != "rectangles") return fault("executor is \"masks\" or \"rectangles\"", name, at, "");
            s.parameters.executor = value == "masks" ? foveation::BinExecutor::masks : foveation::BinExecutor::rectangles;
            continue;
        }
        const auto number = node.value<double>();
        if (word == "cost" || word == "error") {
            if (!number || !std::isfinite(*number) || *number < 0 || (word == "cost" && *number == 0))
                return fault(word + " is no measured value", name, at, word == "cost" ? "a number above 0" : "a number, 0 or more");
            (word == "cost" ? s.cost : s.error) = *number;
            continue;
        }
        const Key* found = nullptr;
        std::string legal = "label, method, cost, error";
        if (has_bins(s)) legal += ", reading, pairs";
        if (s.method == "scaled_bins") legal += ", executor";
        for (const Key& k : keys()) {
            if (!has_word(k.methods, s.method)) continue;
            legal += std::string(", ") + k.name;
            if (word == k.name) found = &k;
        }
        if (found == nullptr) return fault("unknown key '" + word + "' of method " + s.method, name, at, "legal keys: " + legal);
        if (!number || !(*number >= found->low && *number <= found->high)) {
            char range[64];
            std::snprintf(range, sizeof range, "%g to %g", found->low, found->high);
            return fault(word + " is out of range", name, at, range);
        }
        found->set(s, *number);
    }
    if (s.label.empty()) s.label = s.method;
    return s;
}

std::string quoted(const std::string& text) {
    std::string out = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') out += '\\';
        out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    }
    return out + '"';
}

std::string shortest(double v) {
    char text[40];
    for (int digits = 6; digits <= 17; ++digits) {
        std::snprintf(text, sizeof text, "%.*g", digits, v);
        if (std::strtod(text, nullptr) == v) break;
    }
    return text;
}

}  // namespace

bool Setting::same_method(const Setting& other) const noexcept {
    const Parameters &a = parameters, &b = other.parameters;
    return method == other.method && a.executor == b.executor && a.plan.reading == b.plan.reading && a.plan.level_count == b.plan.level_count && a.plan.levels == b.plan.levels &&
           a.inset_outset.ratio == b.inset_outset.ratio && a.dynamic_viewports.context_scale == b.dynamic_viewports.context_scale &&
           a.dynamic_viewports.focus_extent == b.dynamic_viewports.focus_extent && a.shading_rate.inner_radius == b.shading_rate.inner_radius &&
           a.shading_rate.outer_radius == b.shading_rate.outer_radius;
}

std::vector<double> Ladder::costs() const {
    std::vector<double> all;
    for (const Setting& s : settings) all.push_back(s.cost);
    return all;
}

Result<Ladder> make_ladder(std::vector<Setting> settings, std::string_view pick) {
    std::stable_sort(settings.begin(), settings.end(), [](const Setting& a, const Setting& b) { return a.cost != b.cost ? a.cost > b.cost : a.error < b.error; });
    Ladder ladder;
    for (std::size_t i = 0; i < settings.size(); ++i) {
        bool beaten = false;   // by one that is at least as good and no dearer
        for (std::size_t k = 0; k < settings.size(); ++k)
            beaten = beaten || (k != i && settings[k].cost <= settings[i].cost && settings[k].error <= settings[i].error &&
                                (settings[k].cost < settings[i].cost || settings[k].error < settings[i].error || k < i));
        if (!beaten) ladder.settings.push_back(settings[i]);
    }
    if (ladder.settings.empty() || ladder.settings.size() > kMaxSettings)
        return fail("a ladder of " + std::to_string(ladder.settings.size()) + " settings", "quality", "1 to 32 are possible");
    const auto found = std::ranges::find(ladder.settings, pick, &Setting::label);
    if (!pick.empty() && found == ladder.settings.end()) {
        std::string labels;
        for (const Setting& s : ladder.settings) labels += (labels.empty() ? "" : "; ") + s.label;
        return fail("no setting of the ladder is called '" + std::string(pick) + "'", "quality", "there are: " + labels);
    }
    ladder.pick = pick.empty() ? 0 : static_cast<std::size_t>(found - ladder.settings.begin());
    return ladder;
}

Result<Ladder> parse_ladder(std::string_view text, const std::string& name) {
    toml::table root;
    try {
        root = toml::parse(text, name);
    } catch (const toml::parse_error& e) {
        return fault(std::string(e.description()), name, e.source(), "");
    }
    const auto* quality = root["quality"].as_table();
    if (quality == nullptr) return fail("no table [quality]", name, "`fovea tradeoff foveation --toml FILE` writes one");
    for (const auto& [key, node] : *quality)
        if (key.str() != "pick" && key.str() != "setting")
            return fault("unknown key '" + std::string(key.str()) + "'", name, node.source(), "legal keys: pick, [[quality.setting]]");
    const auto* list = (*quality)["setting"].as_array();
    if (list == nullptr) return fail("no [[quality.setting]]", name, "give at least one");
    std::vector<Setting> settings;
    for (const auto& node : *list) {
        if (!node.is_table()) return fault("a setting is a table", name, node.source(), "[[quality.setting]]");
        auto s = parse_setting(*node.as_table(), name);
        if (!s) return std::unexpected(s.error());
        settings.push_back(*std::move(s));
    }
    auto ladder = make_ladder(std::move(settings), (*quality)["pick"].value_or(std::string()));
    if (!ladder) return fail(ladder.error().what, name, ladder.error().way_out);
    return ladder;
}

Result<Ladder> load_ladder(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    if (!in) return fail("cannot read the quality file", path, "`fovea tradeoff foveation --toml FILE` writes one");
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    return parse_ladder(text, path);
}

std::string to_toml(const Ladder& ladder) {
    std::string s = "[quality]\npick = " + quoted(ladder.settings[ladder.pick].label) + "\n";
    for (const Setting& one : ladder.settings) {
        s += "\n[[quality.setting]]\nlabel = " + quoted(one.label) + "\nmethod = " + quoted(one.method) + "\n";
        for (const Key& k : keys())
            if (has_word(k.methods, one.method)) s += std::string(k.name) + " = " + shortest(k.get(one)) + "\n";
        if (has_bins(one)) {
            s += std::string("reading = ") + (one.parameters.plan.reading == density::Reading::area ? "\"area\"\n" : "\"linear\"\n");
            s += std::string("pairs = ") + (has_pairs(one) ? "true\n" : "false\n");
        }
        if (by_rectangles(one)) s += "executor = \"rectangles\"\n";
        s += "cost = " + shortest(one.cost) + "\nerror = " + shortest(one.error) + "\n";
    }
    return s;
}

Ladder built_in_ladder() {
    std::vector<Setting> all;
    const auto bins = [&](double gain, double cost, double error) {
        Setting s;
        char label[40];
        std::snprintf(label, sizeof label, "scaled_bins, gain %g", gain);
        s.label = label;
        s.method = "scaled_bins";
        s.gain = gain;
        s.parameters.plan.levels = density::standard_levels();
        s.cost = cost;
        s.error = error;
        all.push_back(std::move(s));
    };
    Setting full;
    full.label = "full";
    all.push_back(full);
    bins(1.5, 0.643, 6.67);
    bins(2, 0.564, 9.06);
    bins(3, 0.399, 12.6);
    bins(4, 0.368, 14.9);
    bins(6, 0.283, 17.4);
    bins(10, 0.240, 19.2);
    return *make_ladder(std::move(all), "scaled_bins, gain 4");
}

}  // namespace fovea::quality
