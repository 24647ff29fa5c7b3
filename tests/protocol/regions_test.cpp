#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <fcntl.h>
#include <sys/mman.h>

#include <cstring>
#include <random>
#include <thread>

#include "protocol/focus_region.hpp"
#include "protocol/frames_region.hpp"
#include "protocol/samples_region.hpp"
#include "tests/allocation/allocation_count.hpp"
#include "tests/protocol/two_processes.hpp"

using namespace fovea;
using namespace std::chrono_literals;
using fovea::test::Child;

namespace {

constexpr Instant kNow = instant_from_ns(1'000'000'000'000);

// A model all of whose values follow from its number, so that a mixture of two is noticed.
MotionModel numbered(std::uint64_t n, std::uint8_t eyes = kAllEyes) {
    MotionModel m;
    m.sequence = n;
    m.sample_id = n + 1;
    m.exposed = instant_from_ns(static_cast<std::int64_t>(n) * 3);
    m.received = m.exposed + 1ns, m.filtered = m.exposed + 2ns, m.published = m.exposed + 3ns;
    m.exposed_estimated = n % 2 != 0;
    m.eyes_present = eyes;
    for (std::size_t e = 0; e < kEyeCount; ++e) {
        EyeMotion& eye = m.eyes[e];
        const double x = static_cast<double>(n) + 0.25 * static_cast<double>(e);
        eye.reference = m.exposed;
        eye.gaze_dir_head = {x, x + 1, x + 2};
        eye.velocity_rad_s = {x + 3, x + 4};
        eye.event = static_cast<GazeEvent>(n % 5);
        eye.ever_valid = n % 3 != 0;
        eye.lost_before = n % 7 == 0;
        eye.valid_since = m.exposed - 5ns, eye.lost_since = m.exposed - 9ns;
        eye.held_dir_head = {x + 5, x + 6, x + 7};
        eye.saccade = {m.exposed + 4ns, Duration{static_cast<std::int64_t>(n)}, {x, 0, 1}, {0, x, 2}};
        for (std::size_t i = 0; i < eye.horizons.size(); ++i) {
            const float f = static_cast<float>(n % 100000) + static_cast<float>(i);
            eye.horizons[i] = {f, f + 1, f + 2, f + 3};
        }
    }
    return m;
}

bool same(const EyeMotion& a, const EyeMotion& b) {
    for (std::size_t i = 0; i < a.horizons.size(); ++i)
        if (std::memcmp(&a.horizons[i], &b.horizons[i], sizeof a.horizons[i]) != 0) return false;
    return a.reference == b.reference && a.gaze_dir_head == b.gaze_dir_head && a.velocity_rad_s == b.velocity_rad_s &&
           a.event == b.event && a.ever_valid == b.ever_valid && a.lost_before == b.lost_before &&
           a.valid_since == b.valid_since && a.lost_since == b.lost_since && a.held_dir_head == b.held_dir_head &&
           a.saccade.onset == b.saccade.onset && a.saccade.duration == b.saccade.duration &&
           a.saccade.start_dir_head == b.saccade.start_dir_head &&
           a.saccade.landing_dir_head == b.saccade.landing_dir_head;
}
bool same(const MotionModel& a, const MotionModel& b, std::uint8_t eyes = kAllEyes) {
    for (std::size_t e = 0; e < kEyeCount; ++e)
        if ((eyes >> e & 1) != 0 && !same(a.eyes[e], b.eyes[e])) return false;
    return a.sequence == b.sequence && a.sample_id == b.sample_id && a.exposed == b.exposed && a.received == b.received &&
           a.filtered == b.filtered && a.published == b.published && a.exposed_estimated == b.exposed_estimated &&
           a.eyes_present == b.eyes_present;
}

FrameTiming good_frame(std::uint64_t n = 1) {
    FrameTiming t;
    t.frame = n;
    t.model_sequence = 7, t.sample_id = 6;
    t.exposed = kNow - 30ms, t.received = kNow - 28ms, t.filtered = kNow - 27ms, t.published = kNow - 26ms;
    t.latched = kNow - 20ms, t.submitted = kNow - 19ms, t.gpu_done = kNow - 10ms, t.photon = kNow - 4ms;
    t.predicted_photon = kNow - 5ms;
    t.pixels_full = 1000, t.pixels_shaded = 300;
    t.view_count = 2;
    for (ViewFovea& v : t.views) v.half_width_ndc = 0.3, v.half_height_ndc = 0.4, v.eye = Eye::left;
    return t;
}

FocusPublisher publisher() { return FocusPublisher::create(LossPolicy{}, kNow).value(); }

}  // namespace

TEST(Seqlock, RefusesACopyDuringWhichTheWriterCameBy) {
    Word sequence{0}, words[4]{};
    const auto write = [&](std::uint64_t version, int count) {
        SeqlockWriter w(sequence, words, version);
        for (int i = 0; i < count; ++i) w.put(version);
    };
    EXPECT_FALSE(SeqlockReader(sequence, words, 1).whole());   // never written
    write(1, 4);
    SeqlockReader undisturbed(sequence, words, 1);
    ASSERT_TRUE(undisturbed.whole());
    for (int i = 0; i < 4; ++i) EXPECT_EQ(undisturbed.get(), 1u);
    EXPECT_TRUE(undisturbed.still_whole());

    SeqlockReader overtaken(sequence, words, 1);
    EXPECT_EQ(overtaken.get(), 1u);
    write(9, 4);
    EXPECT_EQ(overtaken.get(), 9u);   // torn
    EXPECT_FALSE(overtaken.still_whole());
    {
        SeqlockWriter half(sequence, words, 17);
        half.put(17);
        EXPECT_FALSE(SeqlockReader(sequence, words, 17).whole());   // not yet
        EXPECT_FALSE(SeqlockReader(sequence, words, 9).whole());    // not any more
    }
    EXPECT_TRUE(SeqlockReader(sequence, words, 17).whole());
}

TEST(FocusRegion, CarriesEveryFieldOfAModel) {
    FocusPublisher p = publisher();
    FocusReader r = FocusReader::map(p.fd()).value();
    MotionModel m;
    EXPECT_FALSE(r.read(m));   // nothing published yet
    for (std::uint64_t n = 1; n <= 100; ++n) {
        p.publish(numbered(n));
        ASSERT_TRUE(r.read(m));
        EXPECT_TRUE(same(m, numbered(n))) << n;
        EXPECT_EQ(r.latest(), n);
    }
}

TEST(FocusRegion, CopiesOnlyTheEyesAskedForAndTheCombinedOneForThoseThatAreNotThere) {
    FocusPublisher p = publisher();
    const FocusReader r = FocusReader::map(p.fd()).value();
    p.publish(numbered(5, eye_bit(Eye::combined) | eye_bit(Eye::right)));
    MotionModel m;
    ASSERT_TRUE(r.read(m, eye_bit(Eye::right)));
    EXPECT_TRUE(same(m.eye(Eye::right), numbered(5).eyes[2]));
    EXPECT_TRUE(same(m.eyes[0], EyeMotion{}));   // untouched
    ASSERT_TRUE(r.read(m, eye_bit(Eye::left)));
    EXPECT_TRUE(same(m.eye(Eye::left), numbered(5).eyes[0]));
}

TEST(FocusRegion, ALatchReadsWhatItsPhotonTimeNeeds) {
    FocusPublisher p = publisher();
    const FocusReader r = FocusReader::map(p.fd()).value();
    MotionModel sent = numbered(21, 1);   // 21: lost_before is set
    EyeMotion& eye = sent.eyes[0];
    eye.gaze_dir_head = {}, eye.held_dir_head = {}, eye.ever_valid = true;
    eye.reference = kNow, eye.valid_since = kNow - 2s, eye.lost_since = kNow - 3s;
    for (std::size_t i = 0; i < eye.horizons.size(); ++i) {
        const float f = 0.01f * static_cast<float>(i * i);
        eye.horizons[i] = {f, -f, 0.02f + f, 0.03f + f};
    }
    for (const bool lost_before : {false, true}) {
        eye.lost_before = lost_before;
        p.publish(sent);
        for (Duration d = -10ms; d < 900ms; d += 3ms) {
            MotionModel got;
            ASSERT_TRUE(r.read_at(got, 1, kNow + d));
            EXPECT_EQ(evaluate(got.eyes[0], LossPolicy{}, kNow + d), evaluate(eye, LossPolicy{}, kNow + d)) << d.count();
        }
    }
}

TEST(FocusRegion, HandsOutEachPolicyOnce) {
    FocusPublisher p = publisher();
    FocusReader r = FocusReader::map(p.fd()).value();
    ASSERT_TRUE(r.new_policy());
    EXPECT_FALSE(r.new_policy());
    p.set_policy({1ms, 2ms, 3ms, {0, 0.6, -0.8}, 0.125});
    const LossPolicy got = r.new_policy().value();
    EXPECT_EQ(got.hold, 1ms);
    EXPECT_EQ(got.ease, 2ms);
    EXPECT_EQ(got.recover, 3ms);
    EXPECT_EQ(got.static_dir_head, (Direction<HeadFrame>{0, 0.6, -0.8}));
    EXPECT_EQ(got.static_radius_rad, 0.125);
    EXPECT_FALSE(r.new_policy());
}

TEST(FocusRegion, ShowsTheHeartbeatAndWhoBeats) {
    FocusPublisher p = publisher();
    const FocusReader r = FocusReader::map(p.fd()).value();
    EXPECT_EQ(r.heartbeat(), kNow);
    p.beat(kNow + 5ms);
    EXPECT_EQ(r.heartbeat(), kNow + 5ms);
    EXPECT_EQ(r.daemon_pid(), getpid());
    EXPECT_EQ(r.epoch(), p.epoch());
    EXPECT_NE(publisher().epoch(), p.epoch());
}

TEST(FocusRegion, CannotBeMappedWritableByAnyoneElse) {
    FocusPublisher p = publisher();
    SamplesPublisher s = SamplesPublisher::create({8, 8}, 1).value();
    for (const int fd : {p.fd(), s.fd()}) {
        EXPECT_EQ(mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0), MAP_FAILED);
        EXPECT_EQ(errno, EPERM);
        const std::string path = "/proc/self/fd/" + std::to_string(fd);   // opened anew, the seals still hold
        const UniqueFd again(open(path.c_str(), O_RDWR));
        ASSERT_TRUE(again);
        EXPECT_EQ(mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_SHARED, again.get(), 0), MAP_FAILED);
        EXPECT_EQ(write(again.get(), "x", 1), -1);
        void* readable = mmap(nullptr, 4096, PROT_READ, MAP_SHARED, fd, 0);
        ASSERT_NE(readable, MAP_FAILED);
        EXPECT_NE(mprotect(readable, 4096, PROT_READ | PROT_WRITE), 0);   // nor turned writable afterwards
        munmap(readable, 4096);
        EXPECT_NE(ftruncate(fd, 0), 0);
        EXPECT_NE(ftruncate(fd, 1 << 24), 0);
        EXPECT_NE(fcntl(fd, F_ADD_SEALS, F_SEAL_WRITE), 0);
    }
    p.publish(numbered(1));   // the daemon itself still can
    MotionModel m;
    EXPECT_TRUE(FocusReader::map(p.fd()).value().read(m));
}

TEST(FocusRegion, RefusesWhatIsNoneOfItsOwn) {
    const auto made = [](std::size_t bytes, auto fill) {
        SharedMemory m = SharedMemory::create("test", bytes, Access::daemon_writes).value();
        fill(reinterpret_cast<FocusRegion*>(m.data()));
        return FocusReader::map(m.fd());
    };
    EXPECT_FALSE(made(4096, [](FocusRegion*) {}));   // too small
    EXPECT_FALSE(made(sizeof(FocusRegion), [](FocusRegion*) {}));   // not ready: no version
    const auto other = made(sizeof(FocusRegion), [](FocusRegion* r) { r->magic = kFocusMagic, r->abi = kAbiVersion + 1; });
    ASSERT_FALSE(other);
    EXPECT_NE(other.error().message().find("version " + std::to_string(kAbiVersion + 1)), std::string::npos);
    EXPECT_NE(other.error().message().find("has " + std::to_string(kAbiVersion)), std::string::npos);
    EXPECT_FALSE(made(sizeof(FocusRegion), [](FocusRegion* r) { r->abi = kAbiVersion; }));   // no magic
    EXPECT_FALSE(FocusReader::map(-1));
    EXPECT_FALSE(FocusReader::map(UniqueFd(open("/dev/null", O_RDONLY)).get()));
    const UniqueFd unsealed(memfd_create("test", MFD_CLOEXEC | MFD_ALLOW_SEALING));
    ASSERT_EQ(ftruncate(unsealed.get(), sizeof(FocusRegion)), 0);
    EXPECT_FALSE(FocusReader::map(unsealed.get()));
}

TEST(FocusRegion, NeverShowsATornModelToReadersOfAWriterAtFullSpeed) {
    FocusPublisher p = publisher();
    std::atomic<bool> stop = false;
    std::thread writer([&] {
        for (std::uint64_t n = 1; !stop.load(std::memory_order_relaxed); ++n) p.publish(numbered(n));
    });
    const auto read = [&] {
        const FocusReader r = FocusReader::map(p.fd()).value();
        MotionModel m;
        std::uint64_t newest = 0;
        for (int good = 0; good < 20000;) {
            if (!r.read(m)) continue;
            ++good;
            ASSERT_TRUE(same(m, numbered(m.sequence))) << m.sequence;
            ASSERT_GE(m.sequence, newest);
            newest = m.sequence;
        }
    };
    std::thread other(read);
    read();
    other.join();
    stop = true;
    writer.join();
}

TEST(FocusRegion, ServesTheNewestWholeModelAfterTheWriterWasKilledInMidPublish) {
    for (int round = 0; round < 20; ++round) {
        FocusPublisher p = publisher();
        const FocusReader r = FocusReader::map(p.fd()).value();
        Child writer([&] {
            for (std::uint64_t n = 1;; ++n) p.publish(numbered(n));
            return 0;
        });
        MotionModel m;
        const std::uint64_t until = 1000 + static_cast<std::uint64_t>(round) * 37;
        while (r.latest() < until)
            if (r.read(m)) { ASSERT_TRUE(same(m, numbered(m.sequence))); }
        writer.kill_and_wait();
        const std::uint64_t last = r.latest();
        for (int i = 0; i < 3; ++i) {   // dead for good, and still readable
            ASSERT_TRUE(r.read(m));
            EXPECT_TRUE(same(m, numbered(last)));
        }
    }
}

TEST(FocusRegion, IsReadWhileTheNextSlotIsHalfWritten) {
    FocusPublisher p = publisher();
    const FocusReader r = FocusReader::map(p.fd()).value();
    p.publish(numbered(41));
    SharedMemory mine = SharedMemory::create("test", sizeof(FocusRegion), Access::daemon_writes).value();
    // What a writer leaves behind that is killed after a few words of the next model.
    std::memcpy(static_cast<void*>(mine.data()), [&] {
        static std::vector<std::byte> copy(sizeof(FocusRegion));
        EXPECT_EQ(pread(p.fd(), copy.data(), copy.size(), 0), static_cast<ssize_t>(copy.size()));
        return copy.data();
    }(), sizeof(FocusRegion));
    auto* region = reinterpret_cast<FocusRegion*>(mine.data());
    FocusSlot& next = region->slots[2 % kFocusSlots];
    next.sequence = 2 * 2 + 1;
    for (int i = 0; i < 30; ++i) next.words[i] = ~0ull;
    MotionModel m;
    const FocusReader dead = FocusReader::map(mine.fd()).value();
    ASSERT_TRUE(dead.read(m));
    EXPECT_TRUE(same(m, numbered(41)));
}

TEST(SamplesRegion, BroadcastsEverySampleAndFrameToEveryReader) {
    SamplesPublisher p = SamplesPublisher::create({16, 8}, 9).value();
    SamplesReader a = SamplesReader::map(p.fd()).value(), b = SamplesReader::map(p.fd()).value();
    GazeSample raw;
    raw.id = 3, raw.device_time.ns = -5, raw.exposed = kNow, raw.received = kNow + 1ms, raw.exposed_estimated = true;
    raw.eyes[1] = {true, {0, 0.6, -0.8}, 0.5, 4.25, 0.75};
    raw.head = {true, {0.5, 0.5, -0.5, 0.5}};
    p.publish_sample(raw, numbered(3));
    p.publish_frame(42, good_frame(8));
    for (SamplesReader* r : {&a, &b}) {
        SampleRecord s;
        ASSERT_TRUE(r->next_sample(s));
        EXPECT_FALSE(r->next_sample(s));
        EXPECT_TRUE(same(s.model, numbered(3)));
        EXPECT_EQ(s.raw.id, 3u);
        EXPECT_EQ(s.raw.device_time.ns, -5);
        EXPECT_EQ(s.raw.received, kNow + 1ms);
        EXPECT_TRUE(s.raw.exposed_estimated);
        EXPECT_FALSE(s.raw.eyes[0].valid);
        EXPECT_TRUE(std::isnan(s.raw.eyes[0].pupil_mm));
        EXPECT_TRUE(s.raw.eyes[1].valid);
        EXPECT_EQ(s.raw.eyes[1].gaze_dir_head, (Direction<HeadFrame>{0, 0.6, -0.8}));
        EXPECT_EQ(s.raw.eyes[1].pupil_mm, 4.25);
        EXPECT_EQ(s.raw.eyes[1].confidence, 0.75);
        EXPECT_EQ(s.raw.head.world_from_head, raw.head.world_from_head);
        FrameRecord f;
        ASSERT_TRUE(r->next_frame(f));
        EXPECT_FALSE(r->next_frame(f));
        EXPECT_EQ(f.client_id, 42u);
        EXPECT_EQ(f.timing.frame, 8u);
        EXPECT_EQ(f.timing.photon, kNow - 4ms);
        EXPECT_EQ(f.timing.view_count, 2u);
        EXPECT_EQ(f.timing.views[1].eye, Eye::left);
        EXPECT_EQ(f.timing.views[1].half_height_ndc, 0.4);
        EXPECT_TRUE(f.timing.photon_simulated);
    }
}

TEST(SamplesRegion, CountsExactlyWhatASlowReaderLost) {
    SamplesPublisher p = SamplesPublisher::create({16, 8}, 9).value();
    SamplesReader r = SamplesReader::map(p.fd()).value();
    std::uint64_t got = 0, newest = 0;
    SampleRecord s;
    for (std::uint64_t n = 1; n <= 1000; ++n) {
        p.publish_sample({}, numbered(n, 1));
        if (n % 50 != 0) continue;   // 34 too many for the ring
        while (r.next_sample(s)) {
            ++got;
            EXPECT_GT(s.model.sequence, newest);
            newest = s.model.sequence;
        }
    }
    EXPECT_EQ(newest, 1000u);
    EXPECT_GT(r.lost_samples(), 0u);
    EXPECT_EQ(got + r.lost_samples(), 1000u);
}

TEST(SamplesRegion, GivesOnlyWholeRecordsInOrderWhileTheWriterLapsTheReader) {
    SamplesPublisher p = SamplesPublisher::create({16, 8}, 9).value();
    constexpr std::uint64_t kCount = 60000;
    std::thread writer([&] {
        for (std::uint64_t n = 1; n <= kCount; ++n) {
            GazeSample raw;
            raw.id = n;
            p.publish_sample(raw, numbered(n));
        }
    });
    SamplesReader r = SamplesReader::map(p.fd()).value();
    std::uint64_t got = 0, newest = 0;
    SampleRecord s;
    while (newest < kCount) {
        if (!r.next_sample(s)) continue;
        ASSERT_TRUE(same(s.model, numbered(s.raw.id))) << s.raw.id;
        ASSERT_GT(s.raw.id, newest);
        newest = s.raw.id;
        ++got;
    }
    writer.join();
    EXPECT_EQ(got + r.lost_samples(), kCount);
}

TEST(SamplesRegion, StartsWithTheNextRecordAfterSkipToNewest) {
    SamplesPublisher p = SamplesPublisher::create({16, 8}, 9).value();
    p.publish_sample({}, numbered(1));
    SamplesReader r = SamplesReader::map(p.fd()).value();
    r.skip_to_newest();
    SampleRecord s;
    EXPECT_FALSE(r.next_sample(s));
    p.publish_sample({}, numbered(2));
    ASSERT_TRUE(r.next_sample(s));
    EXPECT_EQ(s.model.sequence, 2u);
    EXPECT_EQ(r.lost_samples(), 0u);
}

TEST(SamplesRegion, RefusesImpossibleCapacitiesAndForeignMemory) {
    EXPECT_FALSE(SamplesPublisher::create({100, 8}, 1));
    EXPECT_FALSE(SamplesPublisher::create({8, 0}, 1));
    EXPECT_FALSE(SamplesPublisher::create({std::size_t{1} << 40, 8}, 1));
    FocusPublisher p = publisher();
    EXPECT_FALSE(SamplesReader::map(p.fd()));
    SamplesPublisher s = SamplesPublisher::create({8, 8}, 1).value();
    EXPECT_FALSE(FocusReader::map(s.fd()));
}

TEST(FramesRegion, CarriesAReportUnchanged) {
    FrameCollector c = FrameCollector::create().value();
    FrameReporter r = FrameReporter::map(c.fd()).value();
    EXPECT_FALSE(c.next(kNow));
    FrameTiming sent = good_frame(77);
    sent.exposed_estimated = true, sent.photon_simulated = false, sent.photon_estimated = true;
    sent.kind = FrameKind::extrapolated;
    sent.views[1].head_from_view = {0.5, -0.5, 0.5, 0.5};
    sent.views[1].center_ndc = {-0.25, 1};
    ASSERT_TRUE(r.submit(sent));
    const auto got = c.next(kNow);
    ASSERT_TRUE(got);
    EXPECT_EQ(got->frame, 77u);
    EXPECT_EQ(got->model_sequence, 7u);
    EXPECT_EQ(got->exposed, sent.exposed);
    EXPECT_EQ(got->photon, sent.photon);
    EXPECT_EQ(got->predicted_photon, sent.predicted_photon);
    EXPECT_TRUE(got->exposed_estimated);
    EXPECT_FALSE(got->photon_simulated);
    EXPECT_TRUE(got->photon_estimated);
    EXPECT_EQ(got->kind, FrameKind::extrapolated);
    EXPECT_EQ(got->views[1].head_from_view, sent.views[1].head_from_view);
    EXPECT_EQ(got->views[1].center_ndc, sent.views[1].center_ndc);
    EXPECT_FALSE(c.next(kNow));
    EXPECT_EQ(c.counters().accepted, 1u);
}

TEST(FramesRegion, DropsWhatTheDaemonDoesNotDrainAndGoesOnAfterwards) {
    FrameCollector c = FrameCollector::create().value();
    FrameReporter r = FrameReporter::map(c.fd()).value();
    std::uint64_t sent = 0;
    while (r.submit(good_frame(sent + 1))) ++sent;
    EXPECT_EQ(sent, kFrameSlots);
    EXPECT_EQ(c.next(kNow)->frame, 1u);
    EXPECT_TRUE(r.submit(good_frame(1000)));
    EXPECT_FALSE(r.submit(good_frame(1001)));
    std::uint64_t last = 0;
    while (const auto t = c.next(kNow)) last = t->frame;
    EXPECT_EQ(last, 1000u);
}

TEST(FramesRegion, RefusesEachImpossibleValueAndCountsIt) {
    const double nan = std::nan("");
    const std::vector<std::function<void(FrameTiming&)>> bad_values = {
        [](FrameTiming& t) { t.frame = 0; },
        [](FrameTiming& t) { t.view_count = 0; },
        [](FrameTiming& t) { t.view_count = 5; },
        [](FrameTiming& t) { t.pixels_full = 0; },
        [](FrameTiming& t) { t.pixels_full = ~0ull; },
        [](FrameTiming& t) { t.pixels_shaded = 64001; },
        [](FrameTiming& t) { t.views[1].eye = static_cast<Eye>(3); },
        [=](FrameTiming& t) { t.views[1].fov.tan_left = nan; },
        [](FrameTiming& t) { t.views[0].fov.tan_left = 2; },
        [=](FrameTiming& t) { t.views[0].head_from_view.w = nan; },
        [](FrameTiming& t) { t.views[0].head_from_view = {0, 0, 0, 0}; },
        [=](FrameTiming& t) { t.views[0].center_ndc.x = nan; },
        [](FrameTiming& t) { t.views[0].center_ndc.y = -5; },
        [=](FrameTiming& t) { t.views[1].half_width_ndc = nan; },
        [](FrameTiming& t) { t.views[1].half_height_ndc = 0; },
    };
    const std::vector<std::function<void(FrameTiming&)>> bad_instants = {
        [](FrameTiming& t) { t.exposed = t.received + 1ns; },
        [](FrameTiming& t) { t.received = t.filtered + 1ns; },
        [](FrameTiming& t) { t.filtered = t.published + 1ns; },
        [](FrameTiming& t) { t.published = t.latched + 1ns; },
        [](FrameTiming& t) { t.latched = t.submitted + 1ns; },
        [](FrameTiming& t) { t.gpu_done = t.submitted - 1ns; },
        [](FrameTiming& t) { t.photon = t.submitted - 1ns; },
        [](FrameTiming& t) { t.photon = kNow + 11s; },
        [](FrameTiming& t) { t.exposed -= 2h; },
        [](FrameTiming& t) { t.exposed = instant_from_ns(INT64_MIN); },
        [](FrameTiming& t) { t.predicted_photon = instant_from_ns(INT64_MAX); },
        [](FrameTiming& t) { t.latched -= 2h; },
    };
    FrameCollector c = FrameCollector::create().value();
    FrameReporter r = FrameReporter::map(c.fd()).value();
    const auto submit = [&](const auto& spoil) {
        FrameTiming t = good_frame();
        spoil(t);
        ASSERT_TRUE(r.submit(t));
        EXPECT_FALSE(c.next(kNow));
    };
    for (std::size_t i = 0; i < bad_values.size(); ++i) {
        submit(bad_values[i]);
        EXPECT_EQ(c.counters().bad_values, i + 1);
    }
    for (std::size_t i = 0; i < bad_instants.size(); ++i) {
        submit(bad_instants[i]);
        EXPECT_EQ(c.counters().bad_instants, i + 1);
    }
    EXPECT_EQ(c.counters().accepted, 0u);
}

TEST(FramesRegion, AFrameWithoutAModelNeedsNoSampleInstants) {
    FrameTiming t = good_frame();
    t.model_sequence = 0;
    t.exposed = t.received = t.filtered = t.published = {};
    EXPECT_EQ(check(t, kNow), FrameFault::none);
}

TEST(FramesRegion, AnIndexThatCannotBeIsSkippedToAndCounted) {
    FrameCollector c = FrameCollector::create().value();
    SharedMemory hostile = SharedMemory::map(c.fd(), Access::client_writes, sizeof(FramesRegion), sizeof(FramesRegion)).value();
    auto* region = reinterpret_cast<FramesRegion*>(hostile.data());
    std::uint64_t faults = 0;
    for (const std::uint64_t head : {std::uint64_t{kFrameSlots} + 1, ~std::uint64_t{0}, std::uint64_t{1} << 63, std::uint64_t{0}}) {
        region->head = head;
        EXPECT_FALSE(c.next(kNow));
        EXPECT_EQ(c.counters().bad_index, ++faults);
        EXPECT_FALSE(c.next(kNow));   // resynchronised
        EXPECT_EQ(c.counters().bad_index, faults);
    }
    FrameReporter honest = FrameReporter::map(c.fd()).value();
    region->tail = region->head.load();
    ASSERT_TRUE(honest.submit(good_frame(5)));
    EXPECT_EQ(c.next(kNow)->frame, 5u);
}

RC_GTEST_PROP(FramesRegion, SurvivesAnyBytesAClientMayWrite, (std::uint64_t seed)) {
    FrameCollector c = FrameCollector::create().value();
    SharedMemory hostile = SharedMemory::map(c.fd(), Access::client_writes, sizeof(FramesRegion), sizeof(FramesRegion)).value();
    auto* words = reinterpret_cast<Word*>(hostile.data());
    std::mt19937_64 rng(seed);
    auto* region = reinterpret_cast<FramesRegion*>(hostile.data());
    for (int round = 0; round < 4; ++round) {
        for (std::size_t i = 0; i < sizeof(FramesRegion) / sizeof(Word); ++i)
            words[i].store(rng(), std::memory_order_relaxed);
        if (round % 2 == 0) region->head.store(rng() % 300 + c.counters().overrun, std::memory_order_relaxed);
        std::size_t looked = 0;
        while (const auto t = c.next(kNow)) {
            RC_ASSERT(check(*t, kNow) == FrameFault::none);
            RC_ASSERT(++looked <= kFrameSlots);
        }
    }
}

TEST(FramesRegion, DrainsABoundedNumberAgainstAClientThatKeepsWriting) {
    FrameCollector c = FrameCollector::create().value();
    SharedMemory hostile = SharedMemory::map(c.fd(), Access::client_writes, sizeof(FramesRegion), sizeof(FramesRegion)).value();
    auto* region = reinterpret_cast<FramesRegion*>(hostile.data());
    std::atomic<bool> stop = false;
    std::thread client([&] {
        for (std::uint64_t i = 0; !stop.load(std::memory_order_relaxed); ++i) {
            region->head.fetch_add(1, std::memory_order_relaxed);
            region->slots[i % kFrameSlots][i % kFrameSlotWords].store(i * 0x9e3779b97f4a7c15, std::memory_order_relaxed);
        }
    });
    for (int i = 0; i < 2000; ++i) EXPECT_FALSE(c.next(kNow));   // returns, each time
    stop = true;
    client.join();
    EXPECT_EQ(c.counters().accepted, 0u);
}

TEST(SteadyLoop, OfTheRegionsDoesNotAllocate) {
    if (!fovea::test::counts_allocations()) GTEST_SKIP() << "a sanitizer brings its own malloc";
    FocusPublisher p = publisher();
    FocusReader r = FocusReader::map(p.fd()).value();
    SamplesPublisher s = SamplesPublisher::create({16, 8}, 9).value();
    SamplesReader sr = SamplesReader::map(s.fd()).value();
    FrameCollector c = FrameCollector::create().value();
    FrameReporter fr = FrameReporter::map(c.fd()).value();
    MotionModel m;
    SampleRecord record;
    FrameRecord frame;
    const std::size_t before = fovea::test::allocations();
    for (std::uint64_t n = 1; n <= 100; ++n) {
        p.publish(numbered(n));
        p.set_policy({});
        p.beat(kNow);
        (void)r.read(m);
        (void)r.new_policy();
        s.publish_sample({}, m);
        s.publish_frame(1, good_frame());
        while (sr.next_sample(record)) {}
        while (sr.next_frame(frame)) {}
        (void)fr.submit(good_frame());
        (void)c.next(kNow);
    }
    EXPECT_EQ(fovea::test::allocations(), before);
    int* volatile counted = new int;   // the counter counts; volatile: the pair may not be elided
    delete counted;
    EXPECT_GT(fovea::test::allocations(), before);
}
