#include "drivers/synthetic/scenario.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <fstream>
#include <sstream>

#include <fmt/format.h>

#include <toml++/toml.h>

#include "drivers/synthetic/scenario_keys.hpp"

namespace fovea::drivers::synthetic {
namespace {

constexpr double kLongest_s = 86400, kFastest_hz = 20000;

std::vector<std::string> words(const char* text) {
    std::istringstream in(text);
    std::vector<std::string> list;
    for (std::string w; in >> w;) list.push_back(w);
    return list;
}

std::string number_text(double v) {
    const std::string text = fmt::format("{}", v);
    return text.find_first_of(".en") == std::string::npos ? text + ".0" : text;
}

// Reads the keys that the table names from one TOML table, then refuses those that it does not name.
class KeyReader {
public:
    KeyReader(const toml::table& table, std::string section, const std::string& file)
        : table_{table}, section_{std::move(section)}, file_{file} {}

    void number(const char* name, double& value, double least, double most, const char*) {
        const toml::node* node = find(name);
        if (node == nullptr) return;
        const auto v = node->value<double>();
        const bool is_number = node->is_floating_point() || node->is_integer();
        if (!is_number || !v || !(*v >= least && *v <= most))
            return refuse(name, *node, fmt::format("legal: a number from {} to {}", least, most));
        value = *v;
    }
    void whole(const char* name, int& value, int least, int most, const char*) {
        const toml::node* node = find(name);
        if (node == nullptr) return;
        const auto v = node->value_exact<std::int64_t>();
        if (!v || *v < least || *v > most) return refuse(name, *node, fmt::format("legal: a whole number from {} to {}", least, most));
        value = static_cast<int>(*v);
    }
    void choice(const char* name, std::string& value, const char* legal, const char*) {
        const toml::node* node = find(name);
        if (node == nullptr) return;
        const auto list = words(legal);
        const auto v = node->value_exact<std::string>();
        if (!v || std::ranges::find(list, *v) == list.end()) return refuse(name, *node, fmt::format("legal: {}", fmt::join(list, ", ")));
        value = *v;
    }
    void flag(const char* name, bool& value, const char*) {
        const toml::node* node = find(name);
        if (node == nullptr) return;
        const auto v = node->value_exact<bool>();
        if (!v) return refuse(name, *node, "legal: true, false");
        value = *v;
    }

    // `others` are names that stand in the same table without being this reader's.
    [[nodiscard]] Result<void> finish(const std::vector<std::string>& others = {}) const {
        if (failure_) return std::unexpected(*failure_);
        for (const auto& [key, node] : table_) {
            const std::string name{key.str()};
            if (std::ranges::find(known_, name) != known_.end() || std::ranges::find(others, name) != others.end()) continue;
            const bool is_table = node.is_table();
            return fail(is_table ? fmt::format("there is no effect [{}]", name)
                                 : fmt::format("unknown key '{}'{}", name, section_.empty() ? "" : " in [" + section_ + "]"),
                        place(key.source()), fmt::format("legal: {}", fmt::join(is_table ? others : known_, ", ")));
        }
        return {};
    }
    [[nodiscard]] std::string place(const toml::source_region& r) const {
        return fmt::format("{}:{}:{}", file_, r.begin.line, r.begin.column);
    }

private:
    const toml::node* find(const char* name) {
        known_.emplace_back(name);
        return table_.get(name);
    }
    void refuse(const char* name, const toml::node& node, std::string way_out) {
        if (failure_) return;
        std::ostringstream value;
        value << toml::node_view<const toml::node>(node);
        failure_ = Error{fmt::format("'{}' cannot be {}", section_.empty() ? name : section_ + "." + name, value.str()),
                         place(node.source()), std::move(way_out)};
    }

    const toml::table& table_;
    std::string section_;
    const std::string& file_;
    std::vector<std::string> known_;
    std::optional<Error> failure_;
};

struct KeyPrinter {
    std::string& out;
    void line(const char* name, const std::string& value, const std::string& legal, const char* doc) {
        out += fmt::format("{} = {:<{}}  # {}{}{}\n", name, value, std::max(1, 34 - static_cast<int>(std::string(name).size())), doc, legal.empty() ? "" : "; ", legal);
    }
    void number(const char* name, double& v, double least, double most, const char* doc) { line(name, number_text(v), fmt::format("{} to {}", least, most), doc); }
    void whole(const char* name, int& v, int least, int most, const char* doc) { line(name, fmt::format("{}", v), fmt::format("{} to {}", least, most), doc); }
    void choice(const char* name, std::string& v, const char* legal, const char* doc) { line(name, fmt::format("\"{}\"", v), fmt::format("{}", fmt::join(words(legal), ", ")), doc); }
    void flag(const char* name, bool& v, const char* doc) { line(name, v ? "true" : "false", "", doc); }
};

// What one key's range cannot say. Nothing is wrong: nothing.
std::optional<std::pair<Effect, std::string>> contradiction(const Scenario& s) {
    const auto needs = [&](Effect a, Effect b) { return has(s, a) && !has(s, b); };
    if (needs(Effect::saccades, Effect::fixations)) return {{Effect::saccades, "[saccades] needs [fixations]: there is nowhere to go"}};
    if (needs(Effect::post_saccadic_oscillation, Effect::saccades)) return {{Effect::post_saccadic_oscillation, "[post_saccadic_oscillation] needs [saccades]"}};
    if (needs(Effect::vestibulo_ocular_reflex, Effect::head)) return {{Effect::vestibulo_ocular_reflex, "[vestibulo_ocular_reflex] needs [head]"}};
    if (s.tremor && s.tremor->highest_hz < s.tremor->lowest_hz) return {{Effect::tremor, "'tremor.highest_hz' is below 'tremor.lowest_hz'"}};
    if (s.vergence && s.vergence->far_m < s.vergence->near_m) return {{Effect::vergence, "'vergence.far_m' is below 'vergence.near_m'"}};
    if (s.latency && s.latency->mean_ms < s.latency->least_ms) return {{Effect::latency, "'latency.mean_ms' is below 'latency.least_ms'"}};
    return std::nullopt;
}

}  // namespace

const char* to_string(Effect effect) noexcept {
    const char* found = "";
    Scenario s;
    effects(s, [&](Effect e, const char* name, auto&, const char*) {
        if (e == effect) found = name;
    });
    return found;
}

bool has(const Scenario& s, Effect effect) noexcept {
    bool found = false;
    effects(s, [&](Effect e, const char*, const auto& table, const char*) { found |= e == effect && table.has_value(); });
    return found;
}

bool remove(Scenario& s, std::string_view effect) noexcept {
    bool known = false;
    effects(s, [&](Effect, const char* name, auto& table, const char*) {
        if (effect != name) return;
        known = true;
        table.reset();
    });
    if (!s.fixations) s.saccades.reset();
    if (!s.saccades) s.post_saccadic_oscillation.reset();
    if (!s.head) s.vestibulo_ocular_reflex.reset();
    return known;
}

Scenario everything() {
    Scenario s;
    effects(s, [](Effect, const char*, auto& table, const char*) { table.emplace(); });
    return s;
}

Result<Scenario> parse_scenario(std::string_view text, const std::string& name) {
    toml::table root;
    try {
        root = toml::parse(text, name);
    } catch (const toml::parse_error& error) {
        return fail(fmt::format("this is not TOML: {}", error.description()),
                    fmt::format("{}:{}:{}", name, error.source().begin.line, error.source().begin.column),
                    "`fovea synth --keys` prints a file to start from");
    }
    Scenario s;
    std::vector<std::string> names = {"name", "seed"};
    Result<void> ok;
    effects(s, [&](Effect, const char* effect, auto& table, const char*) {
        names.emplace_back(effect);
        const toml::node* node = root.get(effect);
        if (node == nullptr || !ok) return;
        KeyReader reader(node->is_table() ? *node->as_table() : root, effect, name);
        if (!node->is_table()) {
            ok = fail(fmt::format("'{}' is an effect, not a value", effect), reader.place(node->source()), fmt::format("write [{}] on a line of its own", effect));
            return;
        }
        keys(table.emplace(), reader);
        ok = reader.finish();
    });
    if (!ok) return std::unexpected(ok.error());
    KeyReader top(root, "", name);
    if (const toml::node* node = root.get("name")) {
        const auto v = node->value_exact<std::string>();
        if (!v) return fail("'name' must be text in quotes", top.place(node->source()));
        s.name = *v;
    }
    if (const toml::node* node = root.get("seed")) {
        const auto v = node->value_exact<std::int64_t>();
        if (!v || *v < 0) return fail("'seed' must be a whole number, 0 or more", top.place(node->source()));
        s.seed = static_cast<std::uint64_t>(*v);
    }
    top.number("duration_s", s.duration_s, 0, kLongest_s, "");
    top.number("rate_hz", s.rate_hz, 1, kFastest_hz, "");
    top.flag("binocular", s.binocular, "");
    if (ok = top.finish(names); !ok) return std::unexpected(ok.error());
    if (const auto wrong = contradiction(s))
        return fail(wrong->second, top.place(root.get(to_string(wrong->first))->source()), "add or change the one or the other");
    return s;
}

Result<Scenario> load_scenario(const std::filesystem::path& file) {
    constexpr const char* kWayOut = "`fovea synth --keys` prints one to start from; configs/scenarios has more";
    std::error_code none;
    if (std::filesystem::is_directory(file, none)) return fail("is a directory", file.string(), kWayOut);
    std::ifstream in(file, std::ios::binary);
    if (!in) return fail_errno("cannot read the scenario", errno, file.string(), kWayOut);
    std::ostringstream text;
    text << in.rdbuf();
    if (text.str().empty()) return fail("the scenario is empty", file.string(), kWayOut);
    return parse_scenario(text.str(), file.string());
}

std::string print_keys() {
    Scenario s = everything();
    std::string out = "# Every effect of the synthetic eye. Leave out the tables that are not wanted: they then cost nothing.\n";
    KeyPrinter top{out};
    out += "name = \"everything\"\nseed = 1                                  # a whole number, 0 or more\n";
    top.number("duration_s", s.duration_s, 0, kLongest_s, "how long; as a device, 0 is without end");
    top.number("rate_hz", s.rate_hz, 1, kFastest_hz, "samples per second");
    top.flag("binocular", s.binocular, "the tracker also gives each eye");
    effects(s, [&](Effect, const char* name, auto& table, const char* doc) {
        out += fmt::format("\n[{}]  # {}\n", name, doc);
        keys(*table, KeyPrinter{out});
    });
    return out;
}

}  // namespace fovea::drivers::synthetic
