#include <fovea/fovea.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <atomic>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <fcntl.h>

#include <limits>
#include <sstream>
#include <thread>

#include "protocol/client/focal.hpp"
#include "tests/allocation/allocation_count.hpp"
#include "tests/protocol/tiny_daemon.hpp"
#include "tests/protocol/two_processes.hpp"

using namespace fovea;
using namespace std::chrono_literals;
using fovea::test::Child;
using fovea::test::SocketDir;
using fovea::test::TinyDaemon;

namespace {

using Dir = Direction<HeadFrame>;
Dir at(double azimuth, double elevation = 0) { return from_azimuth_elevation<HeadFrame>({azimuth, elevation}); }

fovea_view square_view(std::uint32_t eye = FOVEA_EYE_COMBINED) {
    fovea_view v;
    FOVEA_INIT(&v);
    v.eye = eye;
    v.tan_left = -1, v.tan_right = 1, v.tan_up = 1, v.tan_down = -1;
    v.head_from_view[0] = 1;
    return v;
}

MotionModel looking(Dir combined, Dir left, Dir right, std::uint64_t sequence = 1) {
    MotionModel m;
    m.sequence = sequence, m.sample_id = sequence + 100;
    m.published = MonotonicClock::now();
    m.exposed = m.published - 3ms, m.received = m.published - 2ms, m.filtered = m.published - 1ms;
    m.eyes_present = kAllEyes;
    const Dir dirs[] = {combined, left, right};
    for (std::size_t e = 0; e < kEyeCount; ++e) {
        m.eyes[e].reference = m.exposed;
        m.eyes[e].gaze_dir_head = dirs[e];
        m.eyes[e].event = GazeEvent::fixation;
        m.eyes[e].ever_valid = true;
        for (HorizonPoint& h : m.eyes[e].horizons) h.radius68_rad = 0.01f, h.radius95_rad = 0.02f;
    }
    return m;
}
MotionModel looking(Dir dir, std::uint64_t sequence = 1) { return looking(dir, dir, dir, sequence); }

struct Connected {
    fovea_client* client = nullptr;
    explicit Connected(const std::string& path, std::uint32_t flags = 0) {
        fovea_connect_info info;
        FOVEA_INIT(&info);
        info.socket_path = path.c_str();
        info.flags = flags;
        result = fovea_connect(&info, &client);
    }
    ~Connected() { fovea_disconnect(client); }
    Connected(const Connected&) = delete;
    Connected& operator=(const Connected&) = delete;

    struct Latch {
        fovea_result result;
        fovea_focal focal;
        fovea_latch_info info;
        [[nodiscard]] bool live() const { return (info.flags & FOVEA_LATCH_LIVE) != 0; }
    };
    [[nodiscard]] Latch latch(Duration ahead = 0ms, const fovea_view& view = square_view()) const {
        Latch l;
        FOVEA_INIT(&l.focal);
        FOVEA_INIT(&l.info);
        l.result = fovea_latch(client, fovea_now_ns() + ahead.count(), &view, 1, &l.focal, &l.info);
        return l;
    }
    [[nodiscard]] fovea_status status() const {
        fovea_status s;
        FOVEA_INIT(&s);
        EXPECT_EQ(fovea_get_status(client, &s), FOVEA_OK);
        return s;
    }
    // Until the maintenance thread has seen what is asked for; the test's time limit ends a wait in vain.
    template <class Condition>
    void until(Condition condition) const {
        while (!condition(status())) std::this_thread::yield();
    }
    fovea_result result;
};

fovea_frame frame_of(const Connected::Latch& l) {
    fovea_frame f;
    FOVEA_INIT(&f);
    f.flags = FOVEA_FRAME_PHOTON_SIMULATED;
    f.frame = 1;
    f.submitted_ns = fovea_now_ns();
    f.gpu_done_ns = f.submitted_ns + 1;
    f.photon_ns = f.submitted_ns + 2;
    f.pixels_full = 100, f.pixels_shaded = 40;
    f.view_count = 1;
    f.views[0] = square_view(FOVEA_EYE_RIGHT);
    f.foveas[0] = {0.25f, -0.5f, 0.3f, 0.4f};
    f.latch = l.info;
    return f;
}

bool legal(const fovea_focal& f) {
    const float n = std::sqrt(f.gaze_dir_view[0] * f.gaze_dir_view[0] + f.gaze_dir_view[1] * f.gaze_dir_view[1] +
                              f.gaze_dir_view[2] * f.gaze_dir_view[2]);
    return std::abs(f.x_ndc) <= 1 && std::abs(f.y_ndc) <= 1 && f.radius68_rad >= 0 && f.radius95_rad >= 0 &&
           f.radius95_rad < 4 && f.ndc_per_rad_x > 0 && f.ndc_per_rad_y > 0 && std::isfinite(f.ndc_per_rad_x) &&
           std::isfinite(f.ndc_per_rad_y) && std::abs(n - 1) < 1e-5f;
}

}  // namespace

TEST(Focal, IsTheProjectionOfTheGazeInATurnedAsymmetricView) {
    fovea_view given = square_view();
    given.tan_left = -1.4f, given.tan_right = 0.9f, given.tan_up = 1.1f, given.tan_down = -1.3f;
    const float s = std::sin(0.1f), c = std::cos(0.1f);   // turned 0.2 rad to the left about +y
    given.head_from_view[0] = 1.5f * c, given.head_from_view[2] = 1.5f * s;   // not of unit length: normalised
    const client::View view = client::view_of(given).value();
    const client::Focal f = client::focal_of(view, at(0.3, -0.2));
    const NdcPoint expected = project(view.fov, view.head_from_view.inverse() * at(0.3, -0.2)).value();
    EXPECT_NEAR(f.point.x, expected.x, 1e-12);
    EXPECT_NEAR(f.point.y, expected.y, 1e-12);
    EXPECT_FALSE(f.outside);
    const Direction<ViewFrame> ahead = view.head_from_view.inverse() * at(-0.2);
    EXPECT_NEAR(angle_between(ahead, Direction<ViewFrame>{}), 0, 1e-6);   // the view looks 0.2 to the left
}

TEST(Focal, GivesTheLocalScale) {
    fovea_view given = square_view();
    given.tan_left = -0.5f, given.tan_right = 1.5f;
    const client::View view = client::view_of(given).value();
    for (const double azimuth : {-0.3, 0.0, 0.8})
        for (const double elevation : {-0.5, 0.0, 0.4}) {
            const client::Focal f = client::focal_of(view, at(azimuth, elevation));
            ASSERT_FALSE(f.outside);
            for (const double step : {1e-5}) {   // two points a little apart in x and in y
                const auto a = unproject(view.fov, f.point);
                EXPECT_NEAR(f.ndc_per_rad_x * angle_between(a, unproject(view.fov, {f.point.x + step, f.point.y})) / step, 1, 1e-4);
                EXPECT_NEAR(f.ndc_per_rad_y * angle_between(a, unproject(view.fov, {f.point.x, f.point.y + step})) / step, 1, 1e-4);
            }
        }
}

TEST(Focal, OutsideIsTheNearestPointOfTheEdgeAndNeverMirrored) {
    const client::View view = client::view_of(square_view()).value();
    const auto outside = [&](Dir d) {
        const client::Focal f = client::focal_of(view, d);
        EXPECT_TRUE(f.outside);
        return f.point;
    };
    EXPECT_EQ(outside(at(1.0)), (NdcPoint{1, 0}));
    EXPECT_EQ(outside(at(-1.0)), (NdcPoint{-1, 0}));
    EXPECT_EQ(outside(at(2.5)), (NdcPoint{1, 0}));     // behind, to the right
    EXPECT_EQ(outside(at(-2.5)), (NdcPoint{-1, 0}));
    EXPECT_EQ(outside(at(0, 1.2)), (NdcPoint{0, 1}));
    EXPECT_EQ(outside(at(0, 1.5707)), (NdcPoint{0, 1}));
    const NdcPoint behind_and_up = outside(Dir::from({0.1, 0.9, 0.3}).value());
    EXPECT_EQ(behind_and_up.y, 1);
    EXPECT_NEAR(behind_and_up.x, 2.0 / 9, 1e-12);      // worked out by hand: 0.1 * 2 / 0.9
    const NdcPoint ahead_and_up = outside(Dir::from({0.1, 0.9, -0.3}).value());
    EXPECT_EQ(ahead_and_up.y, 1);
    EXPECT_NEAR(ahead_and_up.x, 1.0 / 6, 1e-12);       // 0.1 * 2 / (0.9 + 0.3)
    const NdcPoint exactly_behind = outside(Dir{0, 0, 1});
    EXPECT_EQ(std::max(std::abs(exactly_behind.x), std::abs(exactly_behind.y)), 1);
}

RC_GTEST_PROP(Focal, OutsideHasNoNearerPointOnTheEdge, ()) {
    const auto number = [](double scale) { return scale * 0.001 * *rc::gen::resize(100, rc::gen::inRange(-1000, 1000)); };
    fovea_view given = square_view();
    given.tan_left = static_cast<float>(-1 + number(0.9)), given.tan_right = static_cast<float>(1 + number(0.9));
    given.tan_up = static_cast<float>(1 + number(0.9)), given.tan_down = static_cast<float>(-1 + number(0.9));
    const client::View view = client::view_of(given).value();
    const auto d = Dir::from({number(1), number(1), number(0.5) - 0.501});   // in front of the view
    const client::Focal f = client::focal_of(view, *d);
    RC_PRE(f.outside);
    RC_ASSERT(std::max(std::abs(f.point.x), std::abs(f.point.y)) > 1 - 1e-12);
    const double chosen = angle_between(unproject(view.fov, f.point), f.gaze_dir_view);
    for (int i = -50; i <= 50; ++i)
        for (const NdcPoint p : {NdcPoint{0.02 * i, 1}, {0.02 * i, -1}, {1, 0.02 * i}, {-1, 0.02 * i}})
            RC_ASSERT(angle_between(unproject(view.fov, p), f.gaze_dir_view) >= chosen - 1e-9);
}

TEST(View, ThatCannotBeIsRefused) {
    const float nan = std::nanf(""), inf = std::numeric_limits<float>::infinity();
    const auto refused = [](auto spoil) {
        fovea_view v = square_view();
        spoil(v);
        return !client::view_of(v).has_value();
    };
    EXPECT_FALSE(refused([](fovea_view&) {}));
    EXPECT_TRUE(refused([](fovea_view& v) { v.eye = 3; }));
    EXPECT_TRUE(refused([=](fovea_view& v) { v.tan_up = nan; }));
    EXPECT_TRUE(refused([=](fovea_view& v) { v.tan_right = inf; }));
    EXPECT_TRUE(refused([](fovea_view& v) { v.tan_left = v.tan_right; }));
    EXPECT_TRUE(refused([](fovea_view& v) { v.tan_down = 2; }));
    EXPECT_TRUE(refused([](fovea_view& v) { v.head_from_view[0] = 0; }));
    EXPECT_TRUE(refused([=](fovea_view& v) { v.head_from_view[2] = nan; }));
    EXPECT_TRUE(refused([=](fovea_view& v) { v.head_from_view[1] = inf; }));
    EXPECT_TRUE(refused([](fovea_view& v) { v.head_from_view[3] = 1e30f; }));
}

TEST(Latch, GivesEachViewItsEyesGazeFromTheNewestModel) {
    const SocketDir dir;
    TinyDaemon daemon(dir.path());
    const Connected c(dir.path());
    ASSERT_EQ(c.result, FOVEA_OK) << fovea_last_error(nullptr);
    EXPECT_EQ(c.latch().info.model_sequence, 0u);   // connected, nothing published
    EXPECT_NE(c.latch().focal.flags & FOVEA_FOCAL_STATIC, 0u);
    EXPECT_FALSE(c.latch().live());
    daemon.focus.publish(looking(at(0), at(-0.2), at(0.3, 0.1), 7));
    fovea_view views[2] = {square_view(FOVEA_EYE_LEFT), square_view(FOVEA_EYE_RIGHT)};
    fovea_focal focals[2];
    for (fovea_focal& f : focals) FOVEA_INIT(&f);
    fovea_latch_info info;
    FOVEA_INIT(&info);
    daemon.focus.beat(MonotonicClock::now());
    ASSERT_EQ(fovea_latch(c.client, fovea_now_ns() + 10'000'000, views, 2, focals, &info), FOVEA_OK);
    EXPECT_NEAR(focals[0].x_ndc, -std::tan(0.2), 1e-6);
    EXPECT_NEAR(focals[0].y_ndc, 0, 1e-6);
    EXPECT_NEAR(focals[1].x_ndc, std::tan(0.3), 1e-6);
    EXPECT_GT(focals[1].y_ndc, 0);
    EXPECT_EQ(focals[0].flags, 0u);
    EXPECT_EQ(focals[0].event, unsigned{FOVEA_EVENT_FIXATION});
    EXPECT_FLOAT_EQ(focals[0].radius68_rad, 0.01f);
    EXPECT_EQ(info.model_sequence, 7u);
    EXPECT_EQ(info.sample_id, 107u);
    EXPECT_LE(info.published_ns, info.latched_ns);
    EXPECT_LT(info.exposed_ns, info.received_ns);
    EXPECT_EQ(c.status().latches, 4u);
    ASSERT_EQ(fovea_latch(c.client, fovea_now_ns(), views, 2, focals, nullptr), FOVEA_OK);   // info may be null
}

TEST(Latch, IsNeverEarlierThanThePublicationOfItsModel) {
    const SocketDir dir;
    TinyDaemon daemon(dir.path());
    const Connected c(dir.path());
    ASSERT_EQ(c.result, FOVEA_OK) << fovea_last_error(nullptr);
    std::atomic<bool> done{false};
    std::thread publisher([&] {  // as fast as it can, so that some are published while a latch runs
        MotionModel m = looking(at(0));
        while (!done.load(std::memory_order_relaxed)) {
            m.published = MonotonicClock::now();
            daemon.focus.publish(m);
        }
    });
    unsigned early = 0;
    for (int i = 0; i < 100'000; ++i) {
        const fovea_latch_info info = c.latch().info;
        early += info.model_sequence != 0 && info.latched_ns < info.published_ns;
    }
    done.store(true, std::memory_order_relaxed);
    publisher.join();
    EXPECT_EQ(early, 0u);
}

TEST(Latch, IsLiveOnlyWhileTheHeartBeats) {
    const SocketDir dir;
    TinyDaemon daemon(dir.path());
    const Connected c(dir.path());
    daemon.focus.publish(looking(at(0.1)));
    daemon.focus.beat(MonotonicClock::now() + 1h);   // as good as beating
    EXPECT_TRUE(c.latch().live());
    daemon.focus.beat(MonotonicClock::now() - 251ms);
    EXPECT_FALSE(c.latch().live());
    EXPECT_EQ(c.latch().info.model_sequence, 1u);
    daemon.focus.beat(MonotonicClock::now() + 1h);
    EXPECT_TRUE(c.latch().live());
}

TEST(Latch, NeverShowsDeadGazeAsLiveEvenFromADaemonWhoseSamplesLieInTheFuture) {
    const SocketDir dir;
    auto daemon = std::make_unique<TinyDaemon>(dir.path());
    const Connected c(dir.path());
    MotionModel m = looking(at(0.5));
    for (EyeMotion& e : m.eyes) e.reference += 1h;
    daemon->focus.publish(m);
    daemon->focus.beat(MonotonicClock::now() + 1h);
    EXPECT_TRUE(c.latch().live());
    daemon.reset();
    c.until([](const fovea_status& s) { return s.connected == 0; });
    const Connected::Latch l = c.latch(10s);
    EXPECT_FALSE(l.live());
    EXPECT_NE(l.focal.flags & FOVEA_FOCAL_STATIC, 0u);
    EXPECT_NEAR(l.focal.x_ndc, 0, 1e-6);
}

TEST(Latch, FollowsTheLossPolicyOfADaemonThatDied) {
    const SocketDir dir;
    LossPolicy policy;
    policy.static_dir_head = at(-0.2);
    auto daemon = std::make_unique<TinyDaemon>(dir.path(), policy);
    const Connected c(dir.path());
    daemon->focus.publish(looking(at(0.4)));
    EXPECT_NEAR(c.latch().focal.x_ndc, std::tan(0.4), 1e-6);
    daemon.reset();
    c.until([](const fovea_status& s) { return s.connected == 0; });
    EXPECT_EQ(c.status().heartbeat_age_ns, -1);
    const auto later = c.latch(1s);
    EXPECT_NEAR(later.focal.x_ndc, -std::tan(0.2), 1e-6);
    EXPECT_EQ(later.focal.flags, unsigned{FOVEA_FOCAL_STATIC});
    EXPECT_FLOAT_EQ(later.focal.radius95_rad, 0.35f);
    // "has gone", or already that the first attempt to reconnect found nobody.
    EXPECT_NE(std::string(fovea_last_error(c.client)).find(dir.path()), std::string::npos);
}

TEST(Client, ReconnectsToARestartedDaemonAndTakesItsModels) {
    const SocketDir dir;
    auto daemon = std::make_unique<TinyDaemon>(dir.path());
    const Connected c(dir.path());
    for (std::uint64_t start = 1; start <= 4; ++start) {
        daemon->focus.publish(looking(at(0.1 * static_cast<double>(start)), start));
        c.until([&](const fovea_status& s) { return s.connects == start; });
        EXPECT_EQ(c.latch().info.model_sequence, start);
        daemon.reset();
        c.until([](const fovea_status& s) { return s.connected == 0; });
        EXPECT_EQ(c.latch().info.model_sequence, start);   // the dead daemon's last word stands
        if (start == 2) std::this_thread::yield();
        daemon = std::make_unique<TinyDaemon>(dir.path());
        c.until([&](const fovea_status& s) { return s.connects == start + 1; });
        EXPECT_EQ(c.latch().info.model_sequence, start);   // ... also until the new one has spoken
        EXPECT_FALSE(c.latch().live());
    }
}

TEST(Client, GoesOnWhileItsDaemonIsKilledAndStartedAgain) {
    const SocketDir dir;
    const Connected c(dir.path(), FOVEA_CONNECT_WAIT);
    ASSERT_EQ(c.result, FOVEA_OK);
    for (std::uint64_t round = 1; round <= 3; ++round) {
        Child daemon([&] {
            fovea::test::TinyService d(dir.path());
            for (std::uint64_t n = 1; d.serve(0, -1); ++n) {
                d.focus.publish(looking(at(0.1), n));
                d.focus.beat(MonotonicClock::now());
            }
            return 0;
        });
        while (!c.latch().live()) std::this_thread::yield();
        EXPECT_EQ(c.status().connects, round);
        for (int i = 0; i < 1000; ++i) ASSERT_TRUE(legal(c.latch().focal));
        daemon.kill_and_wait();
        c.until([](const fovea_status& s) { return s.connected == 0; });
        EXPECT_FALSE(c.latch().live());
        EXPECT_NEAR(c.latch().focal.x_ndc, std::tan(0.1), 1e-5);   // held
        EXPECT_NE(c.latch(10s).focal.flags & FOVEA_FOCAL_STATIC, 0u);
    }
}

RC_GTEST_PROP(Latch, IsLegalForAnyModelAnyViewAndAnyTime, ()) {
    static const SocketDir dir;
    static TinyDaemon daemon(dir.path());
    static const Connected c(dir.path());
    const auto bits = [] { return *rc::gen::resize(100, rc::gen::arbitrary<std::uint64_t>()); };
    const auto any = [&] { return *rc::gen::arbitrary<bool>() ? std::bit_cast<double>(bits()) : 0.001 * *rc::gen::inRange(-2000, 2000); };
    const auto anyf = [&] { return std::bit_cast<float>(static_cast<std::uint32_t>(bits())); };
    MotionModel m;
    m.sequence = 1;
    m.eyes_present = static_cast<std::uint8_t>(bits());
    for (EyeMotion& e : m.eyes) {
        e.reference = *rc::gen::arbitrary<bool>() ? MonotonicClock::now() : instant_from_ns(static_cast<std::int64_t>(bits()));
        e.gaze_dir_head = {any(), any(), any()};
        e.held_dir_head = {any(), any(), any()};
        e.ever_valid = true;
        e.lost_before = *rc::gen::arbitrary<bool>();
        e.lost_since = instant_from_ns(static_cast<std::int64_t>(bits()));
        e.valid_since = instant_from_ns(static_cast<std::int64_t>(bits()));
        for (HorizonPoint& h : e.horizons) h = {anyf(), anyf(), anyf(), anyf()};
    }
    daemon.focus.publish(m);
    daemon.focus.beat(MonotonicClock::now());
    fovea_view v = square_view(*rc::gen::inRange<std::uint32_t>(0, 3));
    v.tan_left = static_cast<float>(any()), v.tan_right = static_cast<float>(any());
    v.tan_up = static_cast<float>(any()), v.tan_down = static_cast<float>(any());
    for (float& q : v.head_from_view) q = static_cast<float>(any());
    fovea_focal f;
    FOVEA_INIT(&f);
    const fovea_focal untouched = f;
    const std::int64_t photon = *rc::gen::arbitrary<bool>() ? fovea_now_ns() : static_cast<std::int64_t>(bits());
    if (fovea_latch(c.client, photon, &v, 1, &f, nullptr) == FOVEA_OK)
        RC_ASSERT(legal(f));
    else
        RC_ASSERT(std::memcmp(&f, &untouched, sizeof f) == 0);   // nothing is written
}

TEST(Frames, ReachTheDaemonAsTheyWereSubmitted) {
    const SocketDir dir;
    TinyDaemon daemon(dir.path());
    const Connected c(dir.path());
    daemon.focus.publish(looking(at(0.1), 5));
    fovea_frame f = frame_of(c.latch(8ms));
    ASSERT_EQ(fovea_submit_frame(c.client, &f), FOVEA_OK) << fovea_last_error(c.client);
    const auto got = daemon.frames.next(MonotonicClock::now());
    ASSERT_TRUE(got);
    EXPECT_EQ(got->kind, FrameKind::rendered);
    EXPECT_EQ(got->model_sequence, 5u);
    EXPECT_EQ(got->sample_id, 105u);
    EXPECT_EQ(to_ns(got->latched), f.latch.latched_ns);
    EXPECT_EQ(to_ns(got->predicted_photon), f.latch.photon_ns);
    EXPECT_EQ(to_ns(got->photon), f.photon_ns);
    EXPECT_TRUE(got->photon_simulated);
    EXPECT_FALSE(got->photon_estimated);
    EXPECT_EQ(got->pixels_shaded, 40u);
    EXPECT_EQ(got->views[0].eye, Eye::right);
    EXPECT_EQ(got->views[0].center_ndc, (NdcPoint{0.25, -0.5}));
    EXPECT_EQ(c.status().frames_submitted, 1u);
    f.flags = FOVEA_FRAME_EXTRAPOLATED | FOVEA_FRAME_PHOTON_ESTIMATED;
    f.frame = 2;
    ASSERT_EQ(fovea_submit_frame(c.client, &f), FOVEA_OK) << fovea_last_error(c.client);
    const auto extrapolated = daemon.frames.next(MonotonicClock::now());
    ASSERT_TRUE(extrapolated);
    EXPECT_EQ(extrapolated->kind, FrameKind::extrapolated);
    EXPECT_FALSE(extrapolated->photon_simulated);
    EXPECT_TRUE(extrapolated->photon_estimated);
}

TEST(Frames, ThatCannotBeAreRefusedAndThoseWithoutADaemonCounted) {
    const SocketDir dir;
    auto daemon = std::make_unique<TinyDaemon>(dir.path());
    const Connected c(dir.path());
    daemon->focus.publish(looking(at(0.1)));
    fovea_frame f = frame_of(c.latch());
    f.gpu_done_ns = f.submitted_ns - 1;
    EXPECT_EQ(fovea_submit_frame(c.client, &f), FOVEA_ERROR_ARGUMENT);
    EXPECT_NE(std::string(fovea_last_error(c.client)).find("instants"), std::string::npos);
    f = frame_of(c.latch());
    f.foveas[0].half_width_ndc = -1;
    EXPECT_EQ(fovea_submit_frame(c.client, &f), FOVEA_ERROR_ARGUMENT);
    f.view_count = 5;
    EXPECT_EQ(fovea_submit_frame(c.client, &f), FOVEA_ERROR_ARGUMENT);
    EXPECT_EQ(fovea_submit_frame(c.client, nullptr), FOVEA_ERROR_ARGUMENT);
    f = frame_of(c.latch());
    for (std::size_t i = 0; i < kFrameSlots; ++i) EXPECT_EQ(fovea_submit_frame(c.client, &f), FOVEA_OK);
    EXPECT_EQ(c.status().frames_dropped, 0u);
    EXPECT_EQ(fovea_submit_frame(c.client, &f), FOVEA_OK);   // the daemon does not drain
    EXPECT_EQ(c.status().frames_dropped, 1u);
    daemon.reset();
    c.until([](const fovea_status& s) { return s.connected == 0; });
    EXPECT_EQ(fovea_submit_frame(c.client, &f), FOVEA_OK);
    EXPECT_EQ(c.status().frames_dropped, 2u);
    EXPECT_EQ(c.status().frames_submitted, kFrameSlots);
}

TEST(Connect, ExplainsEachFailureAndClearsTheClient) {
    const SocketDir dir;
    const auto failed = [&](const char* path) {
        const Connected c(path);
        EXPECT_EQ(c.client, nullptr);
        return c.result;
    };
    EXPECT_EQ(failed(dir.path().c_str()), FOVEA_ERROR_NO_DAEMON);
    EXPECT_NE(std::string(fovea_last_error(nullptr)).find("start fovead"), std::string::npos);
    {
        TinyDaemon d(dir.path(), {}, [](int socket, const auto&) {   // an fovead of another version
            auto refusal = encode(Refusal{RefusalReason::version, "client 1, fovead 2: install the new libfovea"});
            refusal[8] = std::byte{2};
            return send_message(socket, refusal).has_value();
        });
        EXPECT_EQ(failed(dir.path().c_str()), FOVEA_ERROR_VERSION);
        EXPECT_NE(std::string(fovea_last_error(nullptr)).find("fovead 2"), std::string::npos);
    }
    {
        TinyDaemon d(dir.path(), {}, [](int socket, const auto&) {
            return send_message(socket, encode(Refusal{RefusalReason::permission, "no"})).has_value();
        });
        EXPECT_EQ(failed(dir.path().c_str()), FOVEA_ERROR_PERMISSION);
        const Connected waits(dir.path(), FOVEA_CONNECT_WAIT);   // WAIT waives only an absent daemon
        EXPECT_EQ(waits.result, FOVEA_ERROR_PERMISSION);
    }
    {   // a welcome with the wrong regions
        TinyDaemon d(dir.path(), {}, [](int socket, const auto&) {
            const UniqueFd null(open("/dev/null", O_RDWR));
            const int fds[] = {null.get(), null.get()};
            return send_message(socket, encode(Welcome{kGrantFocus, 2, 1}), fds).has_value();
        });
        EXPECT_EQ(failed(dir.path().c_str()), FOVEA_ERROR_PROTOCOL);
    }
    EXPECT_EQ(fovea_connect(nullptr, nullptr), FOVEA_ERROR_ARGUMENT);
    fovea_connect_info unset{};
    fovea_client* client = nullptr;
    EXPECT_EQ(fovea_connect(&unset, &client), FOVEA_ERROR_ARGUMENT);
    fovea_disconnect(nullptr);
    EXPECT_STRNE(fovea_result_text(static_cast<fovea_result>(-7)), "");
    EXPECT_EQ(fovea_api_version(), FOVEA_API_VERSION);
}

TEST(Latch, RefusesArgumentsThatCannotBe) {
    const SocketDir dir;
    TinyDaemon daemon(dir.path());
    const Connected c(dir.path());
    fovea_view v = square_view();
    fovea_focal f;
    FOVEA_INIT(&f);
    EXPECT_EQ(fovea_latch(nullptr, 0, &v, 1, &f, nullptr), FOVEA_ERROR_ARGUMENT);
    EXPECT_EQ(fovea_latch(c.client, 0, nullptr, 1, &f, nullptr), FOVEA_ERROR_ARGUMENT);
    EXPECT_EQ(fovea_latch(c.client, 0, &v, 1, nullptr, nullptr), FOVEA_ERROR_ARGUMENT);
    EXPECT_EQ(fovea_latch(c.client, 0, &v, 0, &f, nullptr), FOVEA_ERROR_ARGUMENT);
    EXPECT_EQ(fovea_latch(c.client, 0, &v, 5, &f, nullptr), FOVEA_ERROR_ARGUMENT);
    EXPECT_NE(std::string(fovea_last_error(c.client)).find("view_count"), std::string::npos);
    f.struct_size = 8;
    EXPECT_EQ(fovea_latch(c.client, 0, &v, 1, &f, nullptr), FOVEA_ERROR_ARGUMENT);
    FOVEA_INIT(&f);
    v.struct_size = 0;
    EXPECT_EQ(fovea_latch(c.client, 0, &v, 1, &f, nullptr), FOVEA_ERROR_ARGUMENT);
    // A program of a later version, whose structs are larger.
    struct Later {
        fovea_view view;
        std::uint64_t more[3];
    } later[2]{};
    for (Later& l : later) {
        l.view = square_view();
        l.view.struct_size = sizeof(Later);
    }
    later[1].view.tan_right = 3;
    fovea_focal two[2];
    for (fovea_focal& each : two) FOVEA_INIT(&each);
    ASSERT_EQ(fovea_latch(c.client, fovea_now_ns(), &later[0].view, 2, two, nullptr), FOVEA_OK);
    EXPECT_NEAR(two[0].x_ndc, 0, 1e-6);
    EXPECT_NEAR(two[1].x_ndc, -0.5, 1e-6);
}

TEST(SteadyLoop, OfLibfoveaDoesNotAllocate) {
    if (!fovea::test::counts_allocations()) GTEST_SKIP() << "a sanitizer brings its own malloc";
    const SocketDir dir;
    TinyDaemon daemon(dir.path());
    const Connected c(dir.path());
    daemon.focus.publish(looking(at(0.1)));
    const fovea_frame f = frame_of(c.latch());
    const std::size_t before = fovea::test::allocations();
    for (int i = 0; i < 1000; ++i) {
        (void)c.latch();
        (void)fovea_submit_frame(c.client, &f);
    }
    EXPECT_EQ(fovea::test::allocations(), before);
    (void)fovea_latch(c.client, 0, nullptr, 1, nullptr, nullptr);   // nor does a refused one
    EXPECT_EQ(fovea::test::allocations(), before);
    void* volatile counted = std::malloc(1);   // the counter counts
    std::free(counted);
    EXPECT_GT(fovea::test::allocations(), before);
}

namespace {
std::string output_of(const std::string& command) {
    std::string text;
    FILE* pipe = popen(command.c_str(), "r");
    char buffer[512];
    while (std::fgets(buffer, sizeof buffer, pipe) != nullptr) text += buffer;
    text += "exit " + std::to_string(pclose(pipe));
    return text;
}
}  // namespace

TEST(Libfovea, ExportsTheCInterfaceAndNothingElse) {
    const std::string symbols = output_of("nm -D --defined-only " FOVEA_LIBRARY " | awk '$2 != \"A\" {print $3}'");
    std::istringstream lines(symbols);
    std::size_t count = 0;
    for (std::string line; std::getline(lines, line) && !line.starts_with("exit");) {
        EXPECT_TRUE(line.starts_with("fovea_")) << line;
        ++count;
    }
    EXPECT_EQ(count, 10u) << symbols;   // as many as fovea.h declares
}

TEST(Libfovea, HeaderIsC99AndTheClientInCTalksToADaemon) {
    const std::string compiled = output_of(FOVEA_C_COMPILER " -std=c99 -Wall -Wextra -pedantic -Werror -D_POSIX_C_SOURCE=199309L -fsyntax-only"
                                           " -I" FOVEA_SOURCE_DIR "/protocol/include " FOVEA_SOURCE_DIR "/tests/protocol/c_client.c 2>&1");
    EXPECT_EQ(compiled, "exit 0");
    const SocketDir dir;
    {
        TinyDaemon daemon(dir.path());
        daemon.focus.publish(looking(at(0.1), 9));
        daemon.focus.beat(MonotonicClock::now() + 1h);
        const std::string said = output_of(FOVEA_BIN_DIR "/fovea_c_client " + dir.path() + " 2>&1");
        EXPECT_NE(said.find("model 9"), std::string::npos) << said;
        EXPECT_NE(said.find("live 100"), std::string::npos) << said;
        EXPECT_TRUE(said.ends_with("exit 0")) << said;
        std::size_t reports = 0;
        while (daemon.frames.next(MonotonicClock::now())) ++reports;
        EXPECT_EQ(reports, 100u);
    }
    const std::string alone = output_of(FOVEA_BIN_DIR "/fovea_c_client " + dir.path() + " 2>&1");
    EXPECT_NE(alone.find("no fovead answers"), std::string::npos) << alone;
    EXPECT_TRUE(alone.ends_with("exit 256")) << alone;
}
