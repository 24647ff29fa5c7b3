// What the tests of replay/ share: a directory of their own, and recordings with every kind of value in them.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <bit>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include "replay/recording.hpp"

namespace fovea::replay::testing {

class TempDir {
public:
    TempDir() {
        std::string name = (std::filesystem::temp_directory_path() / "fovea_replay_XXXXXX").string();
        path_ = ::mkdtemp(name.data());
    }
    ~TempDir() {
        std::error_code ignored;
        std::filesystem::permissions(path_, std::filesystem::perms::owner_all, ignored);
        std::filesystem::remove_all(path_, ignored);
    }
    TempDir(const TempDir&) = delete;
    TempDir& operator=(const TempDir&) = delete;
    [[nodiscard]] std::filesystem::path operator/(std::string_view name) const { return path_ / name; }
    [[nodiscard]] const std::filesystem::path& path() const { return path_; }

private:
    std::filesystem::path path_;
};

inline void write_file(const std::filesystem::path& path, std::string_view text) {
    std::ofstream(path, std::ios::binary).write(text.data(), static_cast<std::streamsize>(text.size()));
}

inline std::string read_file(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
}

inline std::filesystem::path source_path(std::string_view name) {
    return std::filesystem::path(FOVEA_SOURCE_DIR) / name;
}

// Bit for bit, but one NaN is as good as another.
inline bool same_bits(double a, double b) {
    return (std::isnan(a) && std::isnan(b)) || std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}
inline bool same(const Direction<HeadFrame>& a, const Direction<HeadFrame>& b) {
    return same_bits(a.x, b.x) && same_bits(a.y, b.y) && same_bits(a.z, b.z);
}
inline bool same(const GazeSample& a, const GazeSample& b) {
    bool equal = a.id == b.id && a.device_time == b.device_time && a.exposed == b.exposed &&
                 a.received == b.received && a.exposed_estimated == b.exposed_estimated &&
                 a.head.valid == b.head.valid;
    const auto &p = a.head.world_from_head, &q = b.head.world_from_head;
    equal &= same_bits(p.w, q.w) && same_bits(p.x, q.x) && same_bits(p.y, q.y) && same_bits(p.z, q.z);
    for (std::size_t e = 0; e < kEyeCount; ++e) {
        const EyeState &x = a.eyes[e], &y = b.eyes[e];
        equal &= x.valid == y.valid && same(x.gaze_dir_head, y.gaze_dir_head) && same_bits(x.openness, y.openness) &&
                 same_bits(x.pupil_mm, y.pupil_mm) && same_bits(x.confidence, y.confidence);
    }
    return equal;
}
inline bool same(const RecordedSample& a, const RecordedSample& b) {
    return same(a.sample, b.sample) && a.label == b.label;
}

// Samples with every kind of value: epoch nanoseconds above 2^53, negative and repeated times, -0.0, subnormals,
// unknown values, invalid eyes with and without a direction, NaN directions, gaps in the ids.
inline Recording odd_recording(std::size_t count, unsigned seed) {
    std::mt19937_64 rng(seed);
    std::normal_distribution<double> normal;
    const auto chance = [&](double p) { return std::uniform_real_distribution<double>(0, 1)(rng) < p; };
    Recording r;
    r.info = {"", "a device, with a comma", "somewhere: there", "MIT", 90.5, true, true};
    std::int64_t t = 1'650'316'509'598'345'895;
    std::uint64_t id = 0;
    for (std::size_t i = 0; i < count; ++i) {
        RecordedSample s;
        GazeSample& g = s.sample;
        t += chance(0.2) ? 0 : chance(0.05) ? -7'000'003 : 4'000'001;
        g.id = id += chance(0.1) ? 3 : 1;
        g.device_time.ns = t;
        g.exposed = instant_from_ns(t - 1'650'000'000'000'000'001);
        g.received = g.exposed + Duration{static_cast<std::int64_t>(rng() % 9'000'000)};
        g.exposed_estimated = chance(0.1);
        for (EyeState& eye : g.eyes) {
            eye.valid = chance(0.8);
            const auto d = Direction<HeadFrame>::from({0.3 * normal(rng), 0.3 * normal(rng), -1});
            if (eye.valid || chance(0.5)) eye.gaze_dir_head = *d;
            if (chance(0.1)) eye.gaze_dir_head = {-0.0, 0.0, -1.0};
            if (!eye.valid && chance(0.2)) eye.gaze_dir_head = {kUnknown, 5e-324, INFINITY};
            if (chance(0.7)) eye.openness = std::abs(normal(rng));
            if (chance(0.7)) eye.pupil_mm = chance(0.1) ? 5e-324 : 3 + normal(rng);
            if (chance(0.7)) eye.confidence = chance(0.1) ? -0.0 : 1.0 / 3;
        }
        g.head.valid = chance(0.9);
        const double a = normal(rng);
        if (g.head.valid) g.head.world_from_head = {std::cos(a), std::sin(a), 0.0, -0.0};
        s.label = static_cast<Label>(rng() % kLabelCount);
        r.samples.push_back(s);
    }
    return r;
}

}  // namespace fovea::replay::testing
