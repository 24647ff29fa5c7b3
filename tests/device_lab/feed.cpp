#include "tests/device_lab/feed.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <poll.h>

#include "replay/recording.hpp"

namespace fovea::lab {

void die(const std::string& what) {
    std::fprintf(stderr, "device lab: %s%s%s\n", what.c_str(), errno != 0 ? ": " : "", errno != 0 ? std::strerror(errno) : "");
    std::exit(1);
}

Arguments::Arguments(int argc, char** argv, std::vector<std::string> known) {
    for (int i = 1; i < argc; i += 2) {
        errno = 0;
        const std::string name = argv[i];
        if (std::ranges::find(known, name) == known.end()) {
            std::string all;
            for (const auto& k : known) all += " " + k;
            die("unknown option " + name + "; there are:" + all);
        }
        if (i + 1 >= argc) die("option " + name + " needs a value");
        given_.emplace_back(name, argv[i + 1]);
    }
}

std::string Arguments::text(const std::string& name, const std::string& fallback) const {
    for (const auto& [key, value] : given_)
        if (key == name) return value;
    return fallback;
}

long Arguments::number(const std::string& name, long fallback) const {
    const std::string t = text(name, "");
    return t.empty() ? fallback : std::strtol(t.c_str(), nullptr, 0);
}

Feed::Feed(const std::string& recording, double rate_hz) : period_ns_{std::llround(1e9 / rate_hz)} {
    const auto loaded = replay::load_recording(recording);
    if (!loaded) die(loaded.error().message());
    const auto& all = loaded->samples;
    if (all.empty()) die(recording + " is empty");
    const std::int64_t first = all.front().sample.device_time.ns, last = all.back().sample.device_time.ns;
    std::size_t k = 0;
    for (std::int64_t t = first; t <= last; t += period_ns_) {
        while (k + 1 < all.size() && all[k + 1].sample.device_time.ns <= t) ++k;
        const EyeState& e = all[k].sample.eye(Eye::combined);
        FeedSample s;
        s.time_us = 1'000'000 + (t - first) / 1000;
        s.dir = e.gaze_dir_head;
        s.valid = e.valid && e.gaze_dir_head.z < -0.3;
        samples_.push_back(s);
    }
}

FeedSample Feed::at(std::uint64_t index) const {
    FeedSample s = samples_[index % samples_.size()];
    s.time_us = 1'000'000 + static_cast<std::int64_t>(index) * period_ns_ / 1000;
    return s;
}

TruthLog::TruthLog(const std::string& path, double rate_hz) {
    if (path.empty()) return;
    file_ = std::fopen(path.c_str(), "w");
    if (file_ == nullptr) die("cannot write " + path);
    std::fprintf(file_, "# fovea-gaze-csv 1\n# device: emulated in the device lab\n# rate_hz: %g\n"
                        "t_ns,received_ns,exposed_ns,combined_x,combined_y,combined_z,combined_valid\n", rate_hz);
}

TruthLog::~TruthLog() {
    if (file_ != nullptr) std::fclose(file_);
}

void TruthLog::add(const FeedSample& s, Instant sent) {
    if (file_ == nullptr) return;
    const auto ns = static_cast<long long>(to_ns(sent));
    std::fprintf(file_, "%lld,%lld,%lld,%.17g,%.17g,%.17g,%d\n", static_cast<long long>(s.time_us) * 1000, ns, ns, s.dir.x,
                 s.dir.y, s.dir.z, s.valid ? 1 : 0);
}

bool wait_until(Instant t, int fd) {
    for (;;) {
        const Duration left = std::max<Duration>(t - MonotonicClock::now(), Duration{});
        const timespec ts{static_cast<time_t>(left.count() / 1'000'000'000), left.count() % 1'000'000'000};
        pollfd p{fd, POLLIN, 0};
        const int got = ppoll(&p, fd >= 0 ? 1 : 0, &ts, nullptr);
        if (got > 0) return true;
        if (got == 0) return false;
        if (errno != EINTR) die("ppoll");
        return false;
    }
}

}  // namespace fovea::lab
