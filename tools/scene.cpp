// `fovea scene`: which scenes there are, and what the effects planner makes of one of them, with the cost of each effect
// measured in this run.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "command_line/checks.hpp"
#include "render/effects/contents.hpp"
#include "render/effects/declared.hpp"
#include "render/effects/measure.hpp"
#include "render/effects/print.hpp"
#include "render/gl/context.hpp"
#include "tools/commands.hpp"

namespace fovea::tools {
namespace {

using effects::Effect;

struct Options {
    std::string scene, size = "512", method = "auto";
    double budget_ms = 0;
    int rounds = 3;
    bool json = false, cost = true;
};

int report(const Error& error, int code) {
    fmt::print(stderr, "fovea scene: {}\n", error.message());
    return code;
}

bool parse_size(const std::string& text, int* width, int* height) {
    char rest = 0;
    const int n = std::sscanf(text.c_str(), "%dx%d%c", width, height, &rest);
    if (n == 1) *height = *width;
    return (n == 2 || n == 1) && *width >= 16 && *height >= 16 && *width <= 8192 && *height <= 8192;
}

// What was found out about a scene.
struct Explained {
    effects::Plan plan;
    effects::Situation situation;
    std::string renderer;
    std::vector<std::string> remarks;
    bool software = false;
    std::array<std::optional<effects::Cost>, effects::kEffects> costs;
};

Result<Explained> explain(const Options& o, effects::Opened opened) {
    Explained x;
    x.situation = {.method = o.method, .budget_ms = o.budget_ms};
    static_cast<void>(parse_size(o.size, &x.situation.width_px, &x.situation.height_px));
    std::vector<effects::Spot> spots;
    effects::Needs needs = effects::look_at(opened.source, {.width_px = x.situation.width_px, .height_px = x.situation.height_px}, &spots);
    if (opened.source.model) x.remarks = opened.source.model->remarks;
    if (!o.cost) {
        if (!spots.empty()) x.remarks.push_back("print of procedural materials is not looked for without GL (--no-cost)");
        x.plan = effects::plan(needs, x.situation, opened.declared);
        return x;
    }
    auto context = gl::Context::create();
    if (!context) return std::unexpected(context.error());
    if (auto ok = effects::add_print(spots, needs); !ok) return std::unexpected(ok.error());
    x.renderer = context->info().renderer;
    x.software = context->info().software;
    auto scene = scene::Scene::create({.name = o.scene, .count_fragments = true}, std::move(opened.source));
    if (!scene) return std::unexpected(scene.error());
    const effects::MeasureSettings settings{.rounds = o.rounds, .software = x.software};
    if (auto ok = effects::measure_frames(*scene, x.situation, settings, needs); !ok) return std::unexpected(ok.error());
    x.plan = effects::plan(needs, x.situation, opened.declared);
    for (const auto& e : effects::effect_entries()) {
        auto cost = effects::measure_effect(e.effect, *scene, x.plan, x.situation, settings);
        if (!cost) return std::unexpected(cost.error());
        x.costs[static_cast<std::size_t>(e.effect)] = *cost;
    }
    const effects::Needs& n = x.plan.needs();
    if (n.full_ms > 0 && n.foveated_ms > 0) x.costs[static_cast<std::size_t>(Effect::foveation)] = effects::Cost{n.full_ms, n.foveated_ms};
    return x;
}

void print_json(const Options& o, const Explained& x) {
    nlohmann::ordered_json out{{"scene", o.scene}, {"method_asked", o.method}, {"method", x.plan.method()}, {"width_px", x.situation.width_px}, {"height_px", x.situation.height_px}};
    if (!x.renderer.empty()) {
        out["renderer"] = x.renderer;
        out["cost_is"] = x.software ? "processor time of all threads" : "wall time";
    }
    for (const auto& e : effects::need_entries()) out["needs"][e.name] = x.plan.needs().*e.value;
    for (const auto& e : effects::effect_entries()) {
        const effects::Decision& d = x.plan.decision(e.effect);
        nlohmann::ordered_json row{{"name", e.name}, {"on", d.on}, {"reason", d.reason}, {"does", e.summary}, {"wanted_for", e.wanted}};
        if (const auto& c = x.costs[static_cast<std::size_t>(e.effect)]) row["cost"] = {{"without_ms", c->without_ms}, {"with_ms", c->with_ms}, {"ratio", c->ratio()}};
        out["effects"].push_back(row);
    }
    out["remarks"] = x.remarks;
    fmt::print("{}\n", out.dump(2));
}

void print_text(const Options& o, const Explained& x) {
    const effects::Needs& n = x.plan.needs();
    fmt::print("{}: {:.0f} triangles, {:.0f} views of {}x{}\n", o.scene, n.triangles, n.views, x.situation.width_px, x.situation.height_px);
    fmt::print("contains  a visible triangle has {:.1f} px (median); of the picture: thin {:.1f} %, print {:.1f} %, small highlights {:.1f} %,\n"
               "          transparent {:.1f} %, moving on its own {:.1f} % ({:.1f} px a frame); the camera moves it {:.1f} px a frame\n",
               n.triangle_px, 100 * n.thin_share, 100 * n.text_share, 100 * n.glossy_share, 100 * n.transparent_share, 100 * n.moving_share, n.object_px, n.camera_px);
    for (const std::string& r : x.remarks) fmt::print("remark    {}\n", r);
    if (n.full_ms > 0)
        fmt::print("costs     {:.1f} ms in full, of it {:.1f} ms ({:.0f} %) for the geometry; {:.1f} ms foveated (ratio {:.2f}); {}, {}\n", n.full_ms, n.vertex_ms,
                   100 * n.vertex_ms / n.full_ms, n.foveated_ms, n.foveated_ms / n.full_ms, x.software ? "processor time" : "wall time", x.renderer);
    fmt::print("draws by  {}{}\n\n", x.plan.method(), o.method == "auto" ? " (auto)" : "");
    for (const auto& e : effects::effect_entries()) {
        const effects::Decision& d = x.plan.decision(e.effect);
        std::string cost = "-";
        if (const auto& c = x.costs[static_cast<std::size_t>(e.effect)]) cost = fmt::format("x{:.2f} ({:.1f} -> {:.1f} ms)", c->ratio(), c->without_ms, c->with_ms);
        fmt::print("{:<18} {:<4} {:<27} {}\n", e.name, d.on ? "on" : "off", cost, d.reason);
    }
    fmt::print("\n{}", o.cost ? "Costs: the same frame without and with the effect, in turn, medians; - where the method has no choice.\n" : "");
}

int run_explain(const Options& o) {
    auto opened = effects::open_scene(o.scene);
    if (!opened) return report(opened.error(), opened.error().where.empty() ? kUsage : kBadInput);
    auto explained = explain(o, *std::move(opened));
    if (!explained) return report(explained.error(), kFailed);
    if (o.json) print_json(o, *explained);
    else print_text(o, *explained);
    return kSuccess;
}

int run_list(bool json) {
    nlohmann::ordered_json out = nlohmann::ordered_json::array();
    for (const auto& s : scene::scenes()) {
        if (json) out.push_back({{"name", s.name}, {"summary", s.summary}});
        else fmt::print("{:<9} {}\n", s.name, s.summary);
    }
    if (json) fmt::print("{}\n", out.dump(2));
    else fmt::print("or the path of a .gltf or .glb file, or of a .toml scene file (docs/scenes.md)\n");
    return kSuccess;
}

}  // namespace

void add_scene(CLI::App& app, int* exit_code);
void add_scene(CLI::App& app, int* exit_code) {
    auto* c = app.add_subcommand("scene", "The scenes, and which effects one calls for, why, and at what cost");
    c->require_subcommand(1);
    auto o = std::make_shared<Options>();
    auto* list = c->add_subcommand("list", "The built-in scenes");
    list->add_flag("--json", o->json, "Print JSON");
    list->callback([o, exit_code] { *exit_code = run_list(o->json); });
    auto* e = c->add_subcommand("explain", "Each effect, on or off, the reason with its numbers, and its cost measured now");
    e->add_option("scene", o->scene, "A built-in name, a .gltf or .glb file, or a .toml scene file")->required();
    std::vector<std::string> methods;
    for (const auto& m : foveation::methods()) methods.emplace_back(m.name);
    e->add_option("--method", o->method, "Foveation method (default auto: the planner chooses)")->check(CLI::IsMember(methods));
    e->add_option("--size", o->size, "Pixels per eye, WIDTHxHEIGHT or one number (default 512)")->check([](const std::string& text) {
        int w = 0, h = 0;
        return parse_size(text, &w, &h) ? std::string() : "'" + text + "' is no size (16 to 8192)";
    });
    e->add_option("--budget-ms", o->budget_ms, "Time a frame may take; 0: no budget (default)")->check(command_line::within(0.0, 1e6));
    e->add_option("--repeat", o->rounds, "Frames of each kind; the median counts (default 3)")->check(CLI::Range(1, 1000));
    e->add_flag("!--no-cost", o->cost, "Only look at the scene: no GL, no frame is drawn");
    e->add_flag("--json", o->json, "Print JSON");
    e->footer("Example: fovea scene explain text --method inset_outset --size 1024\n"
              "Exit codes: 0 explained, 1 no driver, 2 wrong usage or no such scene, 3 a file that cannot be used.");
    e->callback([o, exit_code] { *exit_code = run_explain(*o); });
}

}  // namespace fovea::tools
