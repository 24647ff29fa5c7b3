// The pipeline per sample: noise, a saccade every 300 ms, a blink every 5 s, at 1000 Hz.
#include <algorithm>
#include <chrono>
#include <random>
#include <vector>

#include <benchmark/benchmark.h>

#include "daemon/pipeline/pipeline.hpp"
#include "daemon/pipeline/settings_table.hpp"
#include "protocol/sphere.hpp"

namespace {

using namespace fovea;

// Ten seconds; played round and round with ever later times.
std::vector<GazeSample> make_gaze() {
    std::mt19937_64 random{1};
    std::normal_distribution<double> noise(0, 0.0006);
    std::uniform_real_distribution<double> place(-0.25, 0.25);
    std::vector<GazeSample> samples(10'000);
    double x0 = 0, y0 = 0, x1 = 0, y1 = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
        if (i % 300 == 0) {
            x0 = x1, y0 = y1;
            x1 = place(random), y1 = place(random);
        }
        const double u = std::min(1.0, static_cast<double>(i % 300) / 45.0), way = u * u * u * (10 + u * (-15 + u * 6));
        GazeSample& s = samples[i];
        s.exposed = s.received = instant_from_ns(static_cast<std::int64_t>(i) * 1'000'000);
        s.eye(Eye::combined).valid = i % 5000 > 150;
        s.eye(Eye::combined).gaze_dir_head = from_azimuth_elevation<HeadFrame>(
            {x0 + way * (x1 - x0) + noise(random), y0 + way * (y1 - y0) + noise(random)});
    }
    return samples;
}

void run(benchmark::State& state, const pipeline::PipelineSettings& settings) {
    const std::vector<GazeSample> gaze = make_gaze();
    auto p = pipeline::Pipeline::create(settings);
    if (!p) {
        state.SkipWithError(p.error().message().c_str());
        return;
    }
    std::size_t i = 0;
    Duration lap{0};
    for (auto _ : state) {
        GazeSample s = gaze[i];
        s.exposed += lap;
        benchmark::DoNotOptimize(p->update(s));
        if (++i == gaze.size()) i = 0, lap += std::chrono::seconds(10);
    }
    state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations()));
}

void BM_Pipeline(benchmark::State& state) { run(state, {}); }
BENCHMARK(BM_Pipeline);

// The longest single updates, each timed by itself (the clock's own 20 to 40 ns included).
void BM_PipelineTail(benchmark::State& state) {
    const std::vector<GazeSample> gaze = make_gaze();
    auto p = pipeline::Pipeline::create({});
    std::vector<double> ns;
    Duration lap{0};
    for (auto _ : state) {
        ns.clear();
        for (const GazeSample& sample : gaze) {
            GazeSample s = sample;
            s.exposed += lap;
            const auto before = std::chrono::steady_clock::now();
            benchmark::DoNotOptimize(p->update(s));
            ns.push_back(std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - before).count());
        }
        lap += std::chrono::seconds(10);
    }
    std::sort(ns.begin(), ns.end());
    state.counters["p50_ns"] = ns[ns.size() / 2];
    state.counters["p99_ns"] = ns[ns.size() * 99 / 100];
    state.counters["p999_ns"] = ns[ns.size() * 999 / 1000];
}
BENCHMARK(BM_PipelineTail)->Unit(benchmark::kMillisecond);

void BM_PipelineFilter(benchmark::State& state) {
    pipeline::PipelineSettings s;
    s.filter = pipeline::filter_names()[static_cast<std::size_t>(state.range(0))];
    state.SetLabel(s.filter);
    run(state, s);
}
BENCHMARK(BM_PipelineFilter)->DenseRange(0, static_cast<int>(pipeline::filter_names().size()) - 1);

void BM_PipelinePredictor(benchmark::State& state) {
    pipeline::PipelineSettings s;
    s.predictor.name = pipeline::predictor_names()[static_cast<std::size_t>(state.range(0))];
    state.SetLabel(s.predictor.name);
    run(state, s);
}
BENCHMARK(BM_PipelinePredictor)->DenseRange(0, static_cast<int>(pipeline::predictor_names().size()) - 1);

}  // namespace
