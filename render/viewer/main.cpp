// `fovea-view`: wiring only.
#include <csignal>
#include <cstdio>
#include <exception>

#include "render/foveation/driver_traits.hpp"
#include "render/viewer/viewer.hpp"

namespace {
std::atomic<bool> stop{false};
static_assert(std::atomic<bool>::is_always_lock_free);   // set from a signal handler
void on_signal(int) { stop.store(true, std::memory_order_relaxed); }
}  // namespace

int main(int argc, char** argv) {
    using namespace fovea::viewer;
    struct sigaction action{};
    action.sa_handler = on_signal;
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
    std::signal(SIGPIPE, SIG_IGN);
    try {
        int exit_code = kSuccess;
        const auto options = parse_options(argc, argv, &exit_code);
        if (!options) return exit_code;
        fovea::foveation::keep_driver_traits_in(fovea::foveation::traits_folder());
        const auto summary = run(*options, stop);
        if (!summary) {
            std::fprintf(stderr, "fovea-view: %s\n", summary.error().error.message().c_str());
            return summary.error().code;
        }
        std::fputs((options->json ? to_json(*summary, *options) : to_text(*summary, *options)).c_str(), stdout);
        return kSuccess;
    } catch (const std::exception& e) {
        std::fprintf(stderr, "fovea-view: %s\n", e.what());
        return kFailed;
    }
}
