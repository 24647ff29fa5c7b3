#include "render/effects/declared.hpp"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <toml++/toml.h>
#include <variant>

namespace fovea::effects {
namespace {

constexpr const char* kOtherKind = "";   // a value that is neither boolean, number nor "auto"
using Value = std::variant<bool, double, std::string>;

std::string names(const auto& entries) {
    std::string all;
    for (const auto& e : entries) all += (all.empty() ? "" : ", ") + std::string(e.name);
    return all;
}

// One key of either table, from either language.
Result<void> put(Declared& d, std::string_view table, std::string_view key, const Value& value, const std::string& where) {
    const auto unknown = [&](const std::string& legal) { return fail("unknown key '" + std::string(table) + "." + std::string(key) + "'", where, "legal keys: " + legal); };
    if (table == "effects") {
        for (const EffectEntry& e : effect_entries()) {
            if (key != e.name) continue;
            if (const auto* b = std::get_if<bool>(&value)) d.effects[static_cast<std::size_t>(e.effect)] = *b;
            else if (const auto* s = std::get_if<std::string>(&value); s == nullptr || *s != "auto") return fail("'effects." + std::string(key) + "' is no choice", where, "true, false or \"auto\"");
            return {};
        }
        return unknown(names(effect_entries()));
    }
    if (table == "needs") {
        for (std::size_t i = 0; i < need_entries().size(); ++i) {
            const NeedEntry& e = need_entries()[i];
            if (key != e.name) continue;
            const auto* n = std::get_if<double>(&value);
            if (n == nullptr || !(*n >= 0 && *n <= e.most)) return fail("'needs." + std::string(key) + "' is out of range", where, "a number from 0 to " + std::to_string(e.most));
            d.needs[i] = *n;
            return {};
        }
        return unknown(names(need_entries()));
    }
    if (table == "lens") {
        if (!d.lens) d.lens.emplace();
        for (const LensEntry& e : lens_entries()) {
            if (key != e.name) continue;
            const auto* n = std::get_if<double>(&value);
            if (n == nullptr || !(*n >= e.least && *n <= e.most)) return fail("'lens." + std::string(key) + "' is out of range", where, "a number from " + std::to_string(e.least) + " to " + std::to_string(e.most));
            *d.lens.*e.value = *n;
            return {};
        }
        return unknown(names(lens_entries()));
    }
    return fail("unknown table '" + std::string(table) + "'", where, "legal tables: effects, needs, lens");
}

std::string at(const std::string& path, const toml::source_region& region) {
    return path + ":" + std::to_string(region.begin.line) + ":" + std::to_string(region.begin.column);
}

// What `over` says wins.
void merge(Declared& under, const Declared& over) {
    bool any = false;
    for (std::size_t i = 0; i < kEffects; ++i)
        if (over.effects[i]) under.effects[i] = over.effects[i], any = true;
    for (std::size_t i = 0; i < over.needs.size(); ++i)
        if (over.needs[i]) under.needs[i] = over.needs[i], any = true;
    if (over.lens) under.lens = over.lens, any = true;
    if (any) under.origin = under.origin.empty() ? over.origin : over.origin + " or " + under.origin;
}

}  // namespace

Result<Declared> declared_in_json(const std::string& text, const std::string& origin) {
    Declared d;
    d.origin = origin;
    const auto json = nlohmann::json::parse(text, nullptr, false);
    if (!json.is_object()) return fail("the `fovea` extras are no object", origin);
    for (const auto& [table, entries] : json.items()) {
        if (!entries.is_object()) return fail("'" + table + "' of the `fovea` extras is no object", origin, "legal tables: effects, needs, lens");
        for (const auto& [key, v] : entries.items()) {
            const Value value = v.is_boolean() ? Value(v.get<bool>()) : v.is_number() ? Value(v.get<double>()) : v.is_string() ? Value(v.get<std::string>()) : Value(std::string(kOtherKind));
            if (auto ok = put(d, table, key, value, origin); !ok) return std::unexpected(ok.error());
        }
    }
    if (d.lens)
        if (auto ok = check_lens(*d.lens, origin); !ok) return std::unexpected(ok.error());
    return d;
}

Result<SceneFile> read_scene_file(const std::string& text, const std::string& path) {
    SceneFile file;
    file.declared.origin = path;
    toml::table root;
    try {
        root = toml::parse(text, path);
    } catch (const toml::parse_error& e) {
        return fail(std::string(e.description()), at(path, e.source()), "see configs/scenes for examples");
    }
    for (const auto& [key, node] : root) {
        const std::string where = at(path, node.source());
        if (key == "scene") {
            const auto name = node.value<std::string>();
            if (!name || name->empty()) return fail("'scene' is no name", where, "a built-in name or a .gltf or .glb file beside this one");
            file.scene = *name;
            continue;
        }
        const toml::table* table = node.as_table();
        if (table == nullptr) return fail("unknown key '" + std::string(key.str()) + "'", where, "legal: scene, [effects], [needs], [lens]");
        for (const auto& [entry, v] : *table) {
            const Value value = v.is_boolean() ? Value(v.value<bool>().value_or(false)) : v.is_number() ? Value(v.value<double>().value_or(0)) : Value(v.value<std::string>().value_or(kOtherKind));
            if (auto ok = put(file.declared, key.str(), entry.str(), value, at(path, v.source())); !ok) return std::unexpected(ok.error());
        }
    }
    if (file.declared.lens)
        if (auto ok = check_lens(*file.declared.lens, path); !ok) return std::unexpected(ok.error());
    if (file.scene.empty()) return fail("no 'scene'", path, "scene = \"circuit\", or a .gltf or .glb file beside this one");
    return file;
}

Result<Opened> open_scene(const std::string& scene) {
    namespace fs = std::filesystem;
    Declared from_file;
    std::string name = scene;
    if (fs::path(scene).extension() == ".toml") {
        std::ifstream in(scene);
        if (!in) return fail("cannot be read", scene, "a scene is a built-in name (fovea scene list), a .gltf or .glb file, or a .toml scene file");
        auto file = read_scene_file({std::istreambuf_iterator<char>(in), {}}, scene);
        if (!file) return std::unexpected(file.error());
        from_file = std::move(file->declared);
        name = file->scene;
        const bool built_in = fs::path(name).extension().empty() && name.find('/') == name.npos;
        if (!built_in) name = (fs::path(scene).parent_path() / name).string();
    }
    auto source = scene::load_source(name);
    if (!source) return std::unexpected(source.error());
    Opened opened{*std::move(source), {}};
    if (opened.source.model && !opened.source.model->declared.empty()) {
        auto extras = declared_in_json(opened.source.model->declared, "the extras of " + name);
        if (!extras) return std::unexpected(extras.error());
        opened.declared = *std::move(extras);
    }
    merge(opened.declared, from_file);
    return opened;
}

}  // namespace fovea::effects
