// Frame time foveated against full in the same run, beside the ratio of pixels shaded; and planning.
//
// `full` and the method under test take turns, frame by frame, so that whatever else the machine does falls on both; the
// figures are ratios of medians: cpu_ratio (processor time of the process, all threads), wall_ratio, pixel_ratio.
#include <benchmark/benchmark.h>
#include <epoxy/gl.h>

#include <array>
#include <algorithm>
#include <ctime>
#include <map>
#include <string>
#include <vector>

#include "render/density/plan.hpp"
#include "render/foveation/method.hpp"
#include "render/gl/context.hpp"
#include "render/scene/scene.hpp"

using namespace fovea;

namespace {

constexpr int kHeavier = 4;   // extra lights that bring fragbox to about 100 ns a pixel, the fragment-heavy scene of the targets

double now_ms(clockid_t clock) {
    timespec t{};
    clock_gettime(clock, &t);
    return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

double median(std::vector<double>& v) {
    std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
    return v[v.size() / 2];
}

struct Cost {
    std::vector<double> cpu_ms, wall_ms, late_wall_ms, late_cpu_ms;   // late: from the latch on
    double pixels = 0;
    const char* executor = "";
};

// Two square targets, and a focal point for each; fewer than two where the driver gave no more.
struct TwoEyes {
    explicit TwoEyes(int size) : focus(2) {
        for (std::size_t i = 0; i < 2; ++i) {
            auto t = gl::RenderTarget::create({.width_px = size, .height_px = size});
            if (!t) return;
            owned.push_back(*std::move(t));
            targets.push_back({owned.back().framebuffer(), 0, 0, size, size});
            focus[i].count = 1;
        }
    }
    std::vector<gl::RenderTarget> owned;
    std::vector<foveation::ViewTarget> targets;
    std::vector<foveation::ViewFocus> focus;
};

const gl::Context* context() {
    static auto c = gl::Context::create();
    return c ? &*c : nullptr;
}

void foveation_frame(benchmark::State& state, const std::string& scene_name, const std::string& method_name, int size, float gain,
                     const foveation::MethodSettings& settings = {}) {
    if (context() == nullptr) return state.SkipWithError("no EGL context");
    auto scene = scene::Scene::create({.name = scene_name, .extra_lights = scene_name == "fragbox" ? kHeavier : 0});
    if (!scene) return state.SkipWithError(scene.error().message().c_str());
    TwoEyes two(size);
    if (two.targets.size() != 2) return state.SkipWithError("the driver gives no targets of this size");
    auto& [owned, targets, focus] = two;
    for (foveation::ViewFocus& f : focus) f.points[0] = {0.05f, -0.10f, gain, gain, 0};
    std::map<std::string, std::unique_ptr<foveation::Method>> methods;
    for (const std::string& name : {std::string("full"), method_name}) {
        auto m = foveation::create_method(name, settings);
        if (!m) return state.SkipWithError(m.error().message().c_str());
        if (auto r = (*m)->prepare(targets); !r) return state.SkipWithError(r.error().message().c_str());
        methods[name] = *std::move(m);
    }
    gl::CommandList list;
    const auto eyes = scene::stereo_views();
    std::map<std::string, Cost> costs;
    const auto draw = [&](const std::string& name, bool counts) {
        const double cpu = now_ms(CLOCK_PROCESS_CPUTIME_ID), wall = now_ms(CLOCK_MONOTONIC);
        scene->record(3.0, eyes, list);
        foveation::Method& m = *methods[name];
        if (m.late_fovea()) {
            m.submit_early(list, targets, focus);
            gl::finish();
        }
        const double latch_wall = now_ms(CLOCK_MONOTONIC), latch_cpu = now_ms(CLOCK_PROCESS_CPUTIME_ID);
        const foveation::FrameCost cost = m.submit(list, targets, focus);
        gl::finish();
        m.observe(seconds((now_ms(CLOCK_PROCESS_CPUTIME_ID) - cpu) * 1e-3));   // processor time: other programs do not count
        if (!counts) return;
        Cost& c = costs[name];
        c.late_wall_ms.push_back(now_ms(CLOCK_MONOTONIC) - latch_wall);
        c.late_cpu_ms.push_back(now_ms(CLOCK_PROCESS_CPUTIME_ID) - latch_cpu);
        c.cpu_ms.push_back(now_ms(CLOCK_PROCESS_CPUTIME_ID) - cpu);
        c.wall_ms.push_back(now_ms(CLOCK_MONOTONIC) - wall);
        c.executor = cost.executor;
        c.pixels = static_cast<double>(cost.pixels_shaded) / static_cast<double>(cost.pixels_full);
    };
    for (const auto& [name, unused] : methods) draw(name, false);   // compiles the shaders
    if (method_name == "auto")
        for (int i = 0; i < 60; ++i) draw(method_name, false);      // it learns
    for (auto _ : state) {
        draw("full", true);
        draw(method_name, true);
        focus[0].points[0].x_ndc = -focus[0].points[0].x_ndc;   // a moving eye: planning is part of the frame
    }
    Cost &full = costs["full"], &mine = costs[method_name];
    state.counters["full_ns_per_px"] = median(full.cpu_ms) * 1e6 / (2.0 * size * size);
    state.counters["full_cpu_ms"] = median(full.cpu_ms);
    state.counters["cpu_ms"] = median(mine.cpu_ms);
    state.counters["cpu_ratio"] = median(mine.cpu_ms) / median(full.cpu_ms);
    state.counters["wall_ratio"] = median(mine.wall_ms) / median(full.wall_ms);
    state.counters["pixel_ratio"] = mine.pixels;
    state.SetLabel(mine.executor);
    if (methods[method_name]->late_fovea()) {
        state.counters["latch_to_done_cpu_ratio"] = median(mine.late_cpu_ms) / median(full.cpu_ms);
        state.counters["latch_to_done_wall_ratio"] = median(mine.late_wall_ms) / median(full.wall_ms);
    }
}

// Arm's four views drawn by one draw each against one draw per view, in turn: at_once / repeated.
void views_at_once(benchmark::State& state, const char* scene_name, gl::ViewDrawing drawing, int size) {
    if (context() == nullptr) return state.SkipWithError("no EGL context");
    if (!gl::can_draw(drawing)) return state.SkipWithError("this driver cannot (run it by `fovea layer run`)");
    auto scene = scene::Scene::create({.name = scene_name});
    if (!scene) return state.SkipWithError(scene.error().message().c_str());
    TwoEyes two(size);
    if (two.targets.size() != 2) return state.SkipWithError("the driver gives no targets of this size");
    auto& [owned, targets, focus] = two;
    for (foveation::ViewFocus& f : focus) f.points[0] = {0.05f, -0.10f, 4, 4, 0};
    std::array<std::unique_ptr<foveation::Method>, 2> methods;
    std::array<Cost, 2> costs;
    std::array<std::uint32_t, 2> draws{};
    for (std::size_t i = 0; i < 2; ++i) {
        foveation::MethodSettings s;
        s.inset_outset.drawing = i == 0 ? gl::ViewDrawing::repeated : drawing;
        auto m = foveation::create_method("inset_outset", s);
        if (!m || !(*m)->prepare(targets)) return state.SkipWithError("no method");
        methods[i] = *std::move(m);
    }
    if (!scene->draw_at_once(methods[1]->views_at_once())) return state.SkipWithError("no programs");
    gl::CommandList list;
    const auto eyes = scene::stereo_views();
    const auto draw = [&](std::size_t i, bool counts) {
        const double cpu = now_ms(CLOCK_PROCESS_CPUTIME_ID), wall = now_ms(CLOCK_MONOTONIC);
        scene->record(3.0, eyes, list);
        draws[i] = methods[i]->submit(list, targets, focus).draws;
        gl::finish();
        if (!counts) return;
        costs[i].cpu_ms.push_back(now_ms(CLOCK_PROCESS_CPUTIME_ID) - cpu);
        costs[i].wall_ms.push_back(now_ms(CLOCK_MONOTONIC) - wall);
    };
    for (const std::size_t i : {0u, 1u}) draw(i, false);
    for (auto _ : state)
        for (const std::size_t i : {0u, 1u}) draw(i, true);
    state.counters["draws_repeated"] = draws[0];
    state.counters["draws"] = draws[1];
    state.counters["cpu_ms"] = median(costs[1].cpu_ms);
    state.counters["cpu_ratio"] = median(costs[1].cpu_ms) / median(costs[0].cpu_ms);
    state.counters["wall_ratio"] = median(costs[1].wall_ms) / median(costs[0].wall_ms);
}
BENCHMARK_CAPTURE(views_at_once, circuit_instanced, "circuit", gl::ViewDrawing::instanced, 512)->Name("Views/circuit/512/instanced")->Iterations(9)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(views_at_once, fragbox_instanced, "fragbox", gl::ViewDrawing::instanced, 512)->Name("Views/fragbox/512/instanced")->Iterations(9)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(views_at_once, vert_instanced, "vert", gl::ViewDrawing::instanced, 256)->Name("Views/vert/256/instanced")->Iterations(3)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(views_at_once, circuit_multiview, "circuit", gl::ViewDrawing::multiview2, 512)->Name("Views/circuit/512/multiview2")->Iterations(9)->Unit(benchmark::kMillisecond)->UseRealTime();

// What foveation adds to a frame: 2 x 1024x1024, a moving gaze, and one recorded draw that lies outside both views. What is
// left are the level passes' clears and masks, and the resolve. cpu_ms, wall_ms: median of the iterations, GPU done included.
void mask_and_resolve(benchmark::State& state, int size, float gain, foveation::Resolver resolver) {
    if (context() == nullptr) return state.SkipWithError("no EGL context");
    TwoEyes eyes(size);
    foveation::MethodSettings settings;
    settings.resolver = resolver;
    auto method = foveation::create_method("scaled_bins", settings);
    if (!method || !(*method)->prepare(eyes.targets)) return state.SkipWithError("no method");
    gl::CommandList list;
    list.begin({}, {});
    gl::Draw nowhere;
    nowhere.bounds.fill({0, 0, 0, 0});
    list.add(nowhere);
    std::vector<double> cpu, wall;
    float x = 0.05f;
    for (auto _ : state) {
        x = -x;
        for (foveation::ViewFocus& f : eyes.focus) f.points[0] = {x, -0.1f, gain, gain, 0};
        const double cpu0 = now_ms(CLOCK_PROCESS_CPUTIME_ID), wall0 = now_ms(CLOCK_MONOTONIC);
        (*method)->submit(list, eyes.targets, eyes.focus);
        gl::finish();
        cpu.push_back(now_ms(CLOCK_PROCESS_CPUTIME_ID) - cpu0);
        wall.push_back(now_ms(CLOCK_MONOTONIC) - wall0);
    }
    state.counters["cpu_ms"] = median(cpu);
    state.counters["wall_ms"] = median(wall);
}

BENCHMARK_CAPTURE(mask_and_resolve, gain4, 1024, 4.0f, foveation::Resolver::automatic)
    ->Name("Overhead/mask and resolve/2x1024/gain 4")->Iterations(60)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(mask_and_resolve, gain10, 1024, 10.0f, foveation::Resolver::automatic)
    ->Name("Overhead/mask and resolve/2x1024/gain 10")->Iterations(60)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(mask_and_resolve, gain4_2048, 2048, 4.0f, foveation::Resolver::automatic)
    ->Name("Overhead/mask and resolve/2x2048/gain 4")->Iterations(30)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(mask_and_resolve, gain4_gpu, 1024, 4.0f, foveation::Resolver::gpu)
    ->Name("Overhead/mask and resolve/2x1024/gain 4/resolver gpu")->Iterations(30)->Unit(benchmark::kMillisecond)->UseRealTime();

// An unfoveated frame through the runtime (record, prepare, submit) against the same draws issued straight from GL, in turn.
void unfoveated_frame(benchmark::State& state, const char* method_name) {
    if (context() == nullptr) return state.SkipWithError("no EGL context");
    auto scene = scene::Scene::create({.name = "circuit"});
    TwoEyes eyes(1024);
    auto method = foveation::create_method(method_name, {});
    if (!scene || !method || !(*method)->prepare(eyes.targets)) return state.SkipWithError("no scene or method");
    const auto views = scene::stereo_views();
    gl::CommandList list, direct;
    scene->record(3.0, views, direct);
    const auto plain = [&] {
        for (std::size_t v = 0; v < eyes.targets.size(); ++v) {
            glBindFramebuffer(GL_FRAMEBUFFER, eyes.targets[v].framebuffer);
            glViewport(0, 0, 1024, 1024);
            glDisable(GL_SCISSOR_TEST);
            glDisable(GL_STENCIL_TEST);
            glEnable(GL_DEPTH_TEST);
            glDepthMask(GL_TRUE);
            glClearColor(0.05f, 0.06f, 0.09f, 1);
            glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
            direct.submit({.view = static_cast<std::uint32_t>(v)});
        }
    };
    const auto runtime = [&] {
        scene->record(3.0, views, list);
        static_cast<void>((*method)->prepare(eyes.targets));
        (*method)->submit(list, eyes.targets, eyes.focus);   // focal points at their default: full density everywhere
    };
    std::vector<double> plain_ms, runtime_ms;
    const auto timed = [](auto draw, std::vector<double>& into) {
        const double start = now_ms(CLOCK_PROCESS_CPUTIME_ID);
        draw();
        gl::finish();
        into.push_back(now_ms(CLOCK_PROCESS_CPUTIME_ID) - start);
    };
    timed(plain, plain_ms);
    timed(runtime, runtime_ms);
    plain_ms.clear();
    runtime_ms.clear();
    for (auto _ : state) {
        timed(plain, plain_ms);
        timed(runtime, runtime_ms);
    }
    state.counters["plain_cpu_ms"] = median(plain_ms);
    state.counters["cpu_ratio"] = median(runtime_ms) / median(plain_ms);
}

BENCHMARK_CAPTURE(unfoveated_frame, full, "full")->Name("Overhead/unfoveated frame/full")->Iterations(15)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(unfoveated_frame, bins, "scaled_bins")->Name("Overhead/unfoveated frame/scaled_bins")->Iterations(15)->Unit(benchmark::kMillisecond)->UseRealTime();

// A frame in which the app has neither drawn nor cleared, prepare included.
void empty_frame(benchmark::State& state, const char* method_name) {
    if (context() == nullptr) return state.SkipWithError("no EGL context");
    TwoEyes eyes(1024);
    auto method = foveation::create_method(method_name, {});
    if (!method || !(*method)->prepare(eyes.targets)) return state.SkipWithError("no method");
    gl::CommandList list;
    list.begin({.keep_color = true, .keep_depth = true}, {});
    for (foveation::ViewFocus& f : eyes.focus) f.points[0] = {0.1f, 0, 4, 4, 0};
    for (auto _ : state) {
        static_cast<void>((*method)->prepare(eyes.targets));
        benchmark::DoNotOptimize((*method)->submit(list, eyes.targets, eyes.focus));
    }
}

BENCHMARK_CAPTURE(empty_frame, bins, "scaled_bins")->Name("Overhead/empty frame/scaled_bins")->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(empty_frame, late, "scaled_bins_late")->Name("Overhead/empty frame/scaled_bins_late")->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(empty_frame, inset, "inset_outset")->Name("Overhead/empty frame/inset_outset")->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(empty_frame, automatic, "auto")->Name("Overhead/empty frame/auto")->Unit(benchmark::kMicrosecond);

void plan_update(benchmark::State& state, int bins, int points, bool moving) {
    auto plan = density::Plan::create({.width_px = 2048, .height_px = 2048, .bin_px = 2048 / bins});
    std::vector<density::FocalPoint> p(static_cast<std::size_t>(points), density::FocalPoint{0.1f, -0.2f, 4, 4, 0});
    float step = 0.001f;
    for (auto _ : state) {
        if (moving) {
            p[0].x_ndc += step;
            if (p[0].x_ndc > 0.9f || p[0].x_ndc < -0.9f) step = -step;
        }
        benchmark::DoNotOptimize(plan->update(p));
    }
}

BENCHMARK_CAPTURE(plan_update, still, 64, 4, false)->Name("Plan/64x64 bins/4 points/still");
BENCHMARK_CAPTURE(plan_update, moving_1, 64, 1, true)->Name("Plan/64x64 bins/1 point/moving");
BENCHMARK_CAPTURE(plan_update, moving_4, 64, 4, true)->Name("Plan/64x64 bins/4 points/moving");
BENCHMARK_CAPTURE(plan_update, fine_1, 128, 1, true)->Name("Plan/128x128 bins/1 point/moving");
BENCHMARK_CAPTURE(plan_update, fine_4, 128, 4, true)->Name("Plan/128x128 bins/4 points/moving");

[[maybe_unused]] const bool registered = [] {
    for (const char* scene : {"fragbox", "circuit"})
        for (const int size : {1024, 2048})
            for (const int gain : {4, 10}) {
                const std::string name = std::string("Foveation/scaled_bins/") + scene + "/" + std::to_string(size) + "/gain " + std::to_string(gain);
                benchmark::RegisterBenchmark(name.c_str(), foveation_frame, scene, "scaled_bins", size, static_cast<float>(gain), foveation::MethodSettings{})
                    ->Iterations(7)->Unit(benchmark::kMillisecond)->UseRealTime();
            }
    for (const int gain : {4, 10})
        benchmark::RegisterBenchmark(("Foveation/scaled_bins_late/fragbox/1024/gain " + std::to_string(gain)).c_str(), foveation_frame, "fragbox",
                                     "scaled_bins_late", 1024, static_cast<float>(gain), foveation::MethodSettings{})
            ->Iterations(7)->Unit(benchmark::kMillisecond)->UseRealTime();
    // The same by either executor, and by the one that auto takes.
    for (const int gain : {4, 10}) {
        const std::string name = "Foveation/beads/1024/gain " + std::to_string(gain);
        foveation::MethodSettings lists;
        lists.executor = foveation::BinExecutor::rectangles;
        benchmark::RegisterBenchmark((name + "/level masks").c_str(), foveation_frame, "beads", "scaled_bins", 1024, static_cast<float>(gain), foveation::MethodSettings{})
            ->Iterations(9)->Unit(benchmark::kMillisecond)->UseRealTime();
        benchmark::RegisterBenchmark((name + "/rectangle lists").c_str(), foveation_frame, "beads", "scaled_bins", 1024, static_cast<float>(gain), lists)
            ->Iterations(9)->Unit(benchmark::kMillisecond)->UseRealTime();
    }
    benchmark::RegisterBenchmark("Foveation/beads/1024/gain 4/auto", foveation_frame, "beads", "auto", 1024, 4.0f, foveation::MethodSettings{})
        ->Iterations(9)->Unit(benchmark::kMillisecond)->UseRealTime();
    benchmark::RegisterBenchmark("Foveation/inset_outset/fragbox/1024", foveation_frame, "fragbox", "inset_outset", 1024, 4.0f, foveation::MethodSettings{})
        ->Iterations(7)->Unit(benchmark::kMillisecond)->UseRealTime();
    benchmark::RegisterBenchmark("Foveation/auto/vert/512/gain 4", foveation_frame, "vert", "auto", 512, 4.0f, foveation::MethodSettings{})
        ->Iterations(15)->Unit(benchmark::kMillisecond)->UseRealTime();
    return true;
}();


}  // namespace
