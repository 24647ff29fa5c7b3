// The synthetic eye: repeatable, every effect by itself, nothing for what is absent; its scenario file and its device.
#include "drivers/synthetic/synthetic_eye.hpp"

#include <cstring>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/synthetic/synthetic_device.hpp"
#include "tests/allocation/allocation_count.hpp"
#include "tests/drivers/synthetic/collect.hpp"

namespace fovea::drivers::synthetic {
namespace {

using namespace test;
using testing::HasSubstr;

Scenario all_of_it(double duration_s) {
    Scenario s = everything();
    s.binocular = true;
    s.duration_s = duration_s;
    s.rate_hz = 250;
    s.drop_outs->rate_per_min = 60;
    s.slip->rate_per_min = 60;
    s.blinks->rate_per_min = 40;
    return s;
}

bool same_bits(const std::vector<SyntheticSample>& a, const std::vector<SyntheticSample>& b) {
    if (a.size() != b.size()) return false;
    for (std::size_t i = 0; i < a.size(); ++i) {
        if (a[i].parts != b[i].parts || a[i].truth_dir_head != b[i].truth_dir_head || a[i].sample.exposed != b[i].sample.exposed ||
            a[i].sample.received != b[i].sample.received || a[i].movement != b[i].movement || a[i].sample.id != b[i].sample.id)
            return false;
        for (std::size_t e = 0; e < kEyeCount; ++e)
            if (a[i].sample.eyes[e].gaze_dir_head != b[i].sample.eyes[e].gaze_dir_head || a[i].sample.eyes[e].valid != b[i].sample.eyes[e].valid) return false;
    }
    return true;
}

// Known answers of the Random123 distribution (kat_vectors), philox4x32 with 10 rounds.
TEST(RandomStream, IsPhilox) {
    EXPECT_EQ(philox4x32({0, 0, 0, 0}, {0, 0}), (PhiloxBlock{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
    EXPECT_EQ(philox4x32({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}),
              (PhiloxBlock{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

TEST(RandomStream, IsUniformAndNormalAndNeverZero) {
    const RandomStream random(3, 4);
    std::vector<double> u, n;
    for (std::uint64_t i = 0; i < 20000; ++i) {
        u.push_back(random.uniform(i));
        n.push_back(random.normal(i, 1).first);
        n.push_back(random.normal(i, 1).second);
        ASSERT_GT(u.back(), 0);
        ASSERT_LT(u.back(), 1);
    }
    EXPECT_NEAR(mean(u), 0.5, 0.01);
    EXPECT_NEAR(deviation(u), 1 / std::sqrt(12), 0.005);
    EXPECT_NEAR(mean(n), 0, 0.02);
    EXPECT_NEAR(deviation(n), 1, 0.02);
    EXPECT_NE(RandomStream(3, 5).uniform(0), random.uniform(0)) << "another effect";
    EXPECT_NE(RandomStream(4, 4).uniform(0), random.uniform(0)) << "another seed";
}

TEST(SyntheticEye, GivesTheSameBitsForTheSameSeedAndOthersForAnother) {
    const Scenario s = all_of_it(4);
    Scenario other = s;
    other.seed = 2;
    EXPECT_TRUE(same_bits(collect(s), collect(s)));
    EXPECT_FALSE(same_bits(collect(s), collect(other)));
}

TEST(SyntheticEye, WithoutAnyEffectLooksStraightAheadAtAnEvenRate) {
    Scenario s;
    s.duration_s = 2;
    const auto all = collect(s);
    ASSERT_EQ(all.size(), 2000u);
    for (std::size_t i = 0; i < all.size(); ++i) {
        ASSERT_EQ(all[i].sample.eye(Eye::combined).gaze_dir_head, (Direction<HeadFrame>{}));
        ASSERT_EQ(all[i].truth_dir_head, (Direction<HeadFrame>{}));
        ASSERT_EQ(to_ns(all[i].sample.exposed), static_cast<std::int64_t>(i) * 1'000'000);
        ASSERT_EQ(all[i].sample.received, all[i].sample.exposed);
        ASSERT_FALSE(all[i].sample.head.valid);
        for (const Offset& o : all[i].parts) ASSERT_EQ(o, Offset{});
    }
}

class EachEffect : public testing::TestWithParam<std::uint8_t> {
protected:
    static Effect effect() { return static_cast<Effect>(GetParam()); }
};

// The promise on which comparisons rest: turning one effect off changes no other.
TEST_P(EachEffect, LeavesAllOthersTheSameToTheBitWhenItIsTakenOut) {
    const Scenario with = all_of_it(12);
    Scenario without = with;
    ASSERT_TRUE(remove(without, to_string(effect())));
    ASSERT_FALSE(has(without, effect()));
    SyntheticEye a(with), b(without);
    SyntheticSample x, y;
    bool did_something = false;
    for (std::uint64_t i = 0; i < 3000; ++i) {
        const std::int64_t t = a.even_exposure_ns(i);  // the rate's jitter moves samples in time; compare at the same times
        a.sample_at(i, t, x);
        b.sample_at(i, t, y);
        did_something |= part(x, effect()) != Offset{};
        EXPECT_EQ(part(y, effect()), Offset{});
        for (std::size_t e = 0; e < kEffectCount; ++e) {
            const auto other = static_cast<Effect>(e);
            // These two have no random numbers of their own: they follow from what they are given.
            if (!has(without, other) || other == Effect::quantisation || other == Effect::miscalibration) continue;
            ASSERT_EQ(x.parts[e], y.parts[e]) << to_string(other) << " at sample " << i;
        }
        if (effect() != Effect::rate_jitter) {
            ASSERT_EQ(a.exposure_ns(i), b.exposure_ns(i));
        }
    }
    EXPECT_TRUE(did_something) << "the scenario must show the effect";
}

TEST_P(EachEffect, IsTheSameAloneAsAmongAllOthers) {
    const Scenario all = all_of_it(6);
    Scenario alone = all;
    const auto needed = [](Effect e) {  // what effect() cannot be without
        const Effect p = effect();
        const bool shifts = p == Effect::saccades || p == Effect::post_saccadic_oscillation;
        return e == p || (e == Effect::fixations && shifts) || (e == Effect::saccades && shifts) ||
               (e == Effect::head && p == Effect::vestibulo_ocular_reflex);
    };
    for (std::size_t e = 0; e < kEffectCount; ++e)
        if (!needed(static_cast<Effect>(e))) remove(alone, to_string(static_cast<Effect>(e)));
    ASSERT_TRUE(has(alone, effect()));
    if (effect() == Effect::quantisation || effect() == Effect::miscalibration) return;
    SyntheticEye a(all), b(alone);
    SyntheticSample x, y;
    for (std::uint64_t i = 0; i < 1500; ++i) {
        a.sample_at(i, a.even_exposure_ns(i), x);
        b.sample_at(i, a.even_exposure_ns(i), y);
        ASSERT_EQ(part(x, effect()), part(y, effect())) << i;
    }
}

INSTANTIATE_TEST_SUITE_P(SyntheticEye, EachEffect, testing::Range(std::uint8_t{0}, std::uint8_t{kEffectCount}),
                         [](const auto& p) { return std::string(to_string(static_cast<Effect>(p.param))); });

TEST(SyntheticEye, AllocatesNothingBetweenSamples) {
    SyntheticEye eye(all_of_it(0));
    SyntheticSample s;
    ASSERT_TRUE(eye.next(s));
    const std::size_t before = fovea::test::allocations();
    for (int i = 0; i < 5000; ++i) ASSERT_TRUE(eye.next(s));
    EXPECT_EQ(fovea::test::allocations(), before);
}

// Streams differ by effect: two effects of the same kind must not move together.
TEST(SyntheticEye, GivesBothEyesNoiseOfTheirOwn) {
    Scenario s;
    s.binocular = true;
    s.duration_s = 5;
    s.noise.emplace();
    std::vector<double> left, right;
    double together = 0;
    for (const auto& x : collect(s)) {
        left.push_back(degrees(x.sample.eye(Eye::left).gaze_dir_head).x_deg);
        right.push_back(degrees(x.sample.eye(Eye::right).gaze_dir_head).x_deg);
        together += left.back() * right.back();
    }
    EXPECT_LT(std::fabs(together) / static_cast<double>(left.size()) / (deviation(left) * deviation(right)), 0.05);
}

TEST(SyntheticEye, ShowsTargetsBeforeTheEyeIsThere) {
    Scenario s;
    s.fixations = Fixations{.pattern = "targets", .median_ms = 1000, .spread = 0, .rows = 2, .columns = 3};
    s.saccades.emplace();
    s.duration_s = 6;
    const auto targets = shown_targets(s);
    ASSERT_GE(targets.size(), 6u);
    for (std::size_t i = 0; i < targets.size(); ++i)
        for (std::size_t k = 0; k < i; ++k)
            if (i < 6) {
                EXPECT_GT(angle_between(targets[i].dir_head, targets[k].dir_head), 0.05) << "each comes once in a round";
            }
    EXPECT_EQ(targets[0].end_ns, 800'000'000);
    for (const auto& x : collect(s)) {
        const std::int64_t t = to_ns(x.sample.exposed);
        for (const auto& shown : targets)
            if (t > shown.start_ns + 350'000'000 && t < shown.end_ns) {
                ASSERT_LT(angle_between(x.truth_dir_head, shown.dir_head), 1e-9) << t;
            }
    }
}

// Scenario files

TEST(Scenario, ReadsTheFilesThatAreShipped) {
    std::size_t files = 0;
    for (const auto& entry : std::filesystem::directory_iterator(FOVEA_SOURCE_DIR "/configs/scenarios")) {
        const auto s = load_scenario(entry.path());
        ASSERT_TRUE(s) << s.error().message();
        EXPECT_EQ(s->name, entry.path().stem().string());
        ++files;
    }
    EXPECT_GE(files, 7u);
}

TEST(Scenario, ReadsWhatItPrints) {
    const auto s = parse_scenario(print_keys(), "printed");
    ASSERT_TRUE(s) << s.error().message();
    const Scenario defaults = everything();
    EXPECT_TRUE(same_bits(collect(*s), collect(defaults)));
}

TEST(Scenario, SaysWhatIsWrongWhereAndWhatIsLegal) {
    const struct {
        const char *text, *where, *what, *way_out;
    } cases[] = {
        {"seed = -1", "f:1:8", "'seed'", ""},
        {"rate_hz = 0", "f:1:11", "'rate_hz' cannot be 0", "1 to 20000"},
        {"rate_hz = nan", "f:1:11", "'rate_hz'", "1 to 20000"},
        {"\n[noise]\nstd_deg = \"big\"", "f:3:11", "'noise.std_deg' cannot be", "0 to 20"},
        {"[noise]\nstd = 1", "f:2:1", "unknown key 'std' in [noise]", "std_deg, colour"},
        {"[noize]\n", "f:1:", "no effect [noize]", "noise"},
        {"colour = 1", "f:1:1", "unknown key 'colour'", "rate_hz"},
        {"noise = 3", "f:1:9", "'noise' is an effect", "[noise]"},
        {"[fixations]\npattern = \"stare\"", "f:2:11", "'fixations.pattern'", "search, reading, targets, hold"},
        {"[fixations]\nrows = 2.5", "f:2:8", "'fixations.rows'", "1 to 20"},
        {"[saccades]", "f:1:1", "[saccades] needs [fixations]", "add"},
        {"[vestibulo_ocular_reflex]", "f:1:1", "needs [head]", "add"},
        {"[latency]\nleast_ms = 9\nmean_ms = 3", "f:1:1", "'latency.mean_ms' is below", "change"},
        {"[noise\n", "f:1:", "not TOML", "--keys"},
    };
    for (const auto& c : cases) {
        const auto s = parse_scenario(c.text, "f");
        ASSERT_FALSE(s) << c.text;
        EXPECT_THAT(s.error().where, HasSubstr(c.where)) << c.text << " -> " << s.error().message();
        EXPECT_THAT(s.error().what, HasSubstr(c.what));
        EXPECT_THAT(s.error().way_out, HasSubstr(c.way_out)) << c.text;
    }
    EXPECT_THAT(load_scenario("/nowhere/s.toml").error().message(), HasSubstr("/nowhere/s.toml"));
}

// The device

TEST(SyntheticDevice, DeliversEachSampleWhenItArrives) {
    Scenario s;
    s.rate_hz = 100;
    s.duration_s = 0.05;
    s.latency = Latency{.least_ms = 7, .mean_ms = 7};
    ManualTime time(instant_from_ns(5'000'000'000));
    auto device = make_device(s, "here", true, time);
    ASSERT_TRUE(device->open());
    GazeSample out;
    const Instant far = instant_from_ns(9'000'000'000);
    EXPECT_EQ(device->poll(out, far), PollStatus::nothing) << "the first is still on its way";
    time.advance(std::chrono::milliseconds(7));
    ASSERT_EQ(device->poll(out, far), PollStatus::sample);
    EXPECT_EQ(to_ns(out.exposed), 5'000'000'000);
    EXPECT_EQ(to_ns(out.received), 5'007'000'000);
    EXPECT_FALSE(out.exposed_estimated);
    EXPECT_EQ(device->poll(out, far), PollStatus::nothing);
    time.advance(std::chrono::seconds(1));
    for (int i = 1; i < 5; ++i) {
        ASSERT_EQ(device->poll(out, far), PollStatus::sample);
        EXPECT_EQ(out.id, static_cast<std::uint64_t>(i + 1));
        EXPECT_EQ(to_ns(out.exposed), 5'000'000'000 + i * 10'000'000);
    }
    EXPECT_EQ(device->poll(out, far), PollStatus::ended);
    device->close();
    ASSERT_TRUE(device->open());
    time.advance(std::chrono::seconds(1));
    EXPECT_EQ(device->poll(out, far), PollStatus::nothing) << "opened anew it begins anew";
    EXPECT_EQ(device->counters().samples, 5u);
}

TEST(SyntheticDevice, TakesItsSettingsAndRefusesWrongOnes) {
    const SystemTime time;
    const std::string path = FOVEA_SOURCE_DIR "/configs/scenarios/search.toml";
    const auto make = [&](std::map<std::string, std::string> values) { return create({.values = std::move(values), .where = "c:1", .where_of = {{"without", "c:7"}}}, time); };
    EXPECT_TRUE(make({{"path", path}, {"seed", "7"}, {"without", "blinks noise"}, {"speed", "max"}}));
    EXPECT_THAT(make({}).error().message(), HasSubstr("needs a path"));
    EXPECT_THAT(make({{"path", path}, {"without", "blink"}}).error().message(), testing::AllOf(HasSubstr("'blink'"), HasSubstr("c:7")));
    EXPECT_THAT(make({{"path", path}, {"seed", "-2"}}).error().message(), HasSubstr("seed"));
    EXPECT_THAT(make({{"path", "/nowhere.toml"}}).error().message(), HasSubstr("/nowhere.toml"));
    const auto rows = device_table();
    EXPECT_TRUE(std::ranges::any_of(rows, [](const DeviceRow& r) { return std::strcmp(r.driver, "synthetic") == 0; }));
}

}  // namespace
}  // namespace fovea::drivers::synthetic
