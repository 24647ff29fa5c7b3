#include "render/layer/stats.hpp"

#include <cstdio>
#include <cstdlib>
#include <ctime>

#include "render/layer/comparison.hpp"
#include "render/layer/pay_test.hpp"

namespace fovea::layer {

Stats stats;

const char* call_name(Call call) noexcept {
    switch (static_cast<unsigned>(call) - static_cast<unsigned>(Call::count_of_gl)) {
        case 1: return "eglSwapBuffers";
        case 2: return "eglMakeCurrent";
        case 3: return "eglCreateSync";
        case 4: return "(log full)";
        case 5: return "(draw at full density)";
        default: return gl_call_name(call);
    }
}

std::string Stats::json() const {
    std::string out = "{\n";
    const auto number = [&out](const char* name, const std::atomic<std::uint64_t>& value) {
        out += std::string("  \"") + name + "\": " + std::to_string(value.load(std::memory_order_relaxed)) + ",\n";
    };
    const auto by_call = [&out](const char* name, const std::atomic<std::uint64_t>* values, const char* end) {
        out += std::string("  \"") + name + "\": {";
        const char* comma = "";
        for (unsigned i = 0; i < kCallCount; ++i)
            if (const std::uint64_t n = values[i].load(std::memory_order_relaxed)) {
                out += std::string(comma) + "\"" + call_name(static_cast<Call>(i)) + "\": " + std::to_string(n);
                comma = ", ";
            }
        out += end;
    };
    number("contexts", contexts);
    number("frames", frames);
    number("submissions_native", submissions_native);
    number("submissions_levels", submissions_levels);
    number("draws_recorded", draws_recorded);
    number("resolves", resolves);
    number("targets_created", targets_created);
    number("pixels_full", pixels_full);
    number("pixels_planned", pixels_planned);
    number("depth_restored", depth_restored);
    number("extrapolations", extrapolations);
    number("contexts_lost", contexts_lost);
    if (auto_settings().on) {
        out += "  \"auto\": {\"full_density_submissions\": {";
        const char* comma = "";
        for (std::size_t i = 0; i < std::size(auto_native_by); ++i)
            if (const std::uint64_t n = auto_native_by[i].load(std::memory_order_relaxed)) {
                out += std::string(comma) + "\"" + full_rate_name(static_cast<FullRate>(i)) + "\": " + std::to_string(n);
                comma = ", ";
            }
        out += "}, \"programs\": " + program_reports_json();
        out += ", \"trial\": " + pay_sums().json();
        if (auto_settings().compare) out += ", \"compare\": " + comparison_json();
        out += "},\n";
    }
    by_call("submitted_by", submitted_by, "},\n");
    by_call("lateness_lost_by", lateness_lost_by, "}\n");
    return out + "}\n";
}

void Stats::write_if_asked() const {
    const char* path = std::getenv("FOVEA_LAYER_STATS");
    if (!path || !*path) return;
    const std::string fresh = std::string(path) + ".new";  // a reader sees the old file or the new one
    std::FILE* file = std::fopen(fresh.c_str(), "w");
    if (!file) {
        std::fprintf(stderr, "fovea layer: cannot write the counters to %s (FOVEA_LAYER_STATS)\n", path);
        return;
    }
    const std::string text = json();
    std::fwrite(text.data(), 1, text.size(), file);
    if (std::fclose(file) == 0) (void)std::rename(fresh.c_str(), path);
}

bool Stats::asked() noexcept {
    static const bool asked = std::getenv("FOVEA_LAYER_STATS") != nullptr;
    return asked;
}

void Stats::write_once_a_second() {
    if (!asked()) return;
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC_COARSE, &now);
    if (last_written_s_.exchange(now.tv_sec, std::memory_order_relaxed) != now.tv_sec) write_if_asked();
}

}  // namespace fovea::layer
