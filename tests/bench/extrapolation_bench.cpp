// What the GL call costs by how much of the picture moves: all of it, a quarter, nothing, beside the compare alone, in turn and
// in one run. Figures: processor time of the process, all threads, until the driver is done; ratios of medians.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstring>
#include <ctime>
#include <string>
#include <vector>

#include "render/extrapolation/gl_extrapolator.hpp"
#include "render/extrapolation/gl_regions.hpp"
#include "render/extrapolation/gl_state.hpp"
#include "render/gl/context.hpp"
#include "tools/extrapolation_scenes.hpp"

using namespace fovea;
using namespace fovea::render::extrapolation;

namespace {

double processor_ms() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

double median(std::vector<double>& v) {
    std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
    return v[v.size() / 2];
}

void still_part(benchmark::State& state, Backend backend) {
    constexpr int kSize = 1024;
    auto context = gl::Context::create();
    if (!context) return state.SkipWithError("no EGL context");
    GlFunctions gl;
    static_cast<void>(load(gl, gl::driver_function));
    auto call = GlExtrapolator::create(gl::driver_function, {.backend = backend});
    if (!call) return state.SkipWithError(call.error().message().c_str());
    const tools::ExtrapolationScene scene("translation", 1);
    const auto src1 = scene.render(0, kSize, false), src2 = scene.render(1, kSize, false);
    auto quarter = src1.rgba;   // of the picture, in its middle, as src2 has it
    for (int y = kSize / 4; y < 3 * kSize / 4; ++y) {
        const auto at = static_cast<std::size_t>(4 * (y * kSize + kSize / 4));
        std::memcpy(quarter.data() + at, src2.rgba.data() + at, static_cast<std::size_t>(2 * kSize));
    }
    GLuint textures[4];
    gl.GenTextures(4, textures);
    for (int i = 0; i < 4; ++i) {
        gl.BindTexture(GL_TEXTURE_2D, textures[i]);
        gl.TexStorage2D(GL_TEXTURE_2D, 1, GL_RGBA8, kSize, kSize);
        gl.TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, kSize, kSize, GL_RGBA, GL_UNSIGNED_BYTE, (i == 1 ? src2.rgba : i == 2 ? quarter : src1.rgba).data());
    }
    GlRunner runner(gl);
    if (!runner.build(false, 2, true)) return state.SkipWithError("the shaders do not build");
    std::vector<double> ms[4];   // everything, a quarter, nothing, the compare alone
    GlWork work[3];
    {
        GlRegions regions(runner);
        {
            const GlStateGuard guard(gl, true);
            regions.resize(kSize, kSize, kSize / 2, kSize / 2, 5, false);
        }
        bool warm = false;
        for (auto _ : state)
            for (int repeat = 0; repeat < (warm ? 1 : 2); ++repeat, warm = true)
                for (int what = 0; what < 4; ++what) {
                    gl.Finish();
                    const double before = processor_ms();
                    if (what < 3) {
                        static_cast<void>(call->extrapolate(textures[0], textures[what == 0 ? 1 : what == 1 ? 2 : 0], textures[3], 0.5f));
                    } else {
                        const GlStateGuard guard(gl, true);
                        runner.begin();
                        regions.find_moving(textures[0], textures[1]);
                    }
                    gl.Finish();
                    if (warm) ms[what].push_back(processor_ms() - before);
                    if (what < 3) work[what] = call->work();
                }
    }
    gl.DeleteTextures(4, textures);
    const double all = median(ms[0]);
    state.counters["ms"] = all;
    state.counters["quarter"] = median(ms[1]) / all;
    state.counters["still"] = median(ms[2]) / all;
    state.counters["compare"] = median(ms[3]) / all;
    state.counters["tiles"] = work[0].searched;
    state.counters["tiles_quarter"] = work[1].searched;
    state.counters["tiles_still"] = work[2].searched;
}

}  // namespace

BENCHMARK_CAPTURE(still_part, processor, Backend::processor)->Iterations(7)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(still_part, compute, Backend::compute)->Iterations(7)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(still_part, fragment, Backend::fragment)->Iterations(7)->Unit(benchmark::kMillisecond);
