#include "replay/recorder.hpp"

#include <gtest/gtest.h>

#include "tests/replay/support.hpp"

using namespace fovea;
using namespace fovea::replay;
using namespace fovea::replay::testing;

namespace {

GazeSample sample_of(std::uint64_t id) {
    GazeSample s;
    s.id = id;
    s.device_time.ns = static_cast<std::int64_t>(id) * 1'000'003;
    s.exposed = instant_from_ns(s.device_time.ns);
    s.received = s.exposed + Duration{5};
    s.eye(Eye::combined).valid = true;
    s.eye(Eye::combined).gaze_dir_head = *Direction<HeadFrame>::from({0.001 * static_cast<double>(id), 0, -1});
    return s;
}

MotionModel model_of(std::uint64_t id) {
    MotionModel m;
    m.sequence = m.sample_id = id;
    m.exposed = sample_of(id).exposed;
    m.eyes[0].gaze_dir_head = sample_of(id).eyes[0].gaze_dir_head;
    return m;
}

FrameTiming frame_of(std::uint64_t n) {
    FrameTiming t;
    t.frame = n;
    t.sample_id = n * 2;
    t.view_count = 1;
    return t;
}

SamplesPublisher publisher(std::size_t samples) {
    auto p = SamplesPublisher::create({samples, 64}, 1);
    EXPECT_TRUE(p) << p.error().message();
    return std::move(*p);
}

Recorder start(const std::filesystem::path& path, SamplesPublisher& source, const RecorderOptions& options = {}) {
    auto reader = SamplesReader::map(source.fd());
    EXPECT_TRUE(reader);
    auto recorder = Recorder::start(path, std::move(*reader), options);
    EXPECT_TRUE(recorder) << recorder.error().message();
    return std::move(*recorder);
}

}  // namespace

TEST(Recorder, WritesEveryPublishedSampleModelAndFrame) {
    const TempDir dir;
    SamplesPublisher source = publisher(4096);
    source.publish_sample(sample_of(999), model_of(999));  // before the recording: not part of it
    RecorderOptions options;
    options.info.device = "synthetic";
    options.meta["config"] = "x = 1";
    Recorder recorder = start(dir / "a.fovea", source, options);
    for (std::uint64_t i = 1; i <= 3000; ++i) {
        source.publish_sample(sample_of(i), model_of(i));
        if (i % 100 == 0) source.publish_frame(5, frame_of(i / 100));
    }
    recorder.add_event({instant_from_ns(1), "source_lost", "pulled"});
    const auto stopped = recorder.stop();
    ASSERT_TRUE(stopped) << stopped.error().message();
    EXPECT_EQ(stopped->samples, 3000u);
    EXPECT_EQ(stopped->frames, 30u);
    EXPECT_EQ(stopped->samples_lost + stopped->frames_lost + stopped->rows_dropped, 0u);

    const auto session = SessionReader::open(dir / "a.fovea");
    ASSERT_TRUE(session) << session.error().message();
    EXPECT_EQ(session->info().device, "synthetic");
    EXPECT_EQ(session->meta().at("config"), "x = 1");
    std::uint64_t n = 0;
    ASSERT_TRUE(session->samples([&](const RecordedSample& r) {
        EXPECT_TRUE(same(r.sample, sample_of(++n)));
        return true;
    }));
    EXPECT_EQ(n, 3000u);
    n = 0;
    ASSERT_TRUE(session->models([&](const MotionModel& m) {
        ++n;
        EXPECT_EQ(m.sequence, n);
        EXPECT_EQ(m.exposed, model_of(n).exposed);
        EXPECT_EQ(m.eyes[0].gaze_dir_head, model_of(n).eyes[0].gaze_dir_head);
        return true;
    }));
    EXPECT_EQ(n, 3000u);
    n = 0;
    ASSERT_TRUE(session->frames([&](const SessionFrame& f) {
        EXPECT_EQ(f.client, 5u);
        EXPECT_EQ(f.timing.frame, ++n);
        return true;
    }));
    EXPECT_EQ(n, 30u);
    EXPECT_EQ(session->events()->size(), 1u);
}

TEST(Recorder, CountsWhatWasOverwrittenAndSaysSoInTheSession) {
    const TempDir dir;
    SamplesPublisher source = publisher(64);
    auto reader = SamplesReader::map(source.fd());
    ASSERT_TRUE(reader);
    for (std::uint64_t i = 1; i <= 5000; ++i) source.publish_sample(sample_of(i), model_of(i));
    RecorderOptions options;
    options.from_oldest = true;  // it comes too late for most of them
    auto recorder = Recorder::start(dir / "a.fovea", std::move(*reader), options);
    ASSERT_TRUE(recorder);
    const auto stopped = recorder->stop();
    ASSERT_TRUE(stopped);
    EXPECT_GT(stopped->samples, 0u);
    EXPECT_GT(stopped->samples_lost, 4900u);
    EXPECT_EQ(stopped->samples + stopped->samples_lost, 5000u);
    const auto session = SessionReader::open(dir / "a.fovea");
    ASSERT_TRUE(session);
    std::int64_t lost = -1;
    const auto counters = session->counters();
    ASSERT_TRUE(counters);
    for (const auto& c : *counters)
        if (c.name == "recorder.samples_lost") lost = c.value;
    EXPECT_EQ(lost, static_cast<std::int64_t>(stopped->samples_lost));
}

TEST(Recorder, StoppingTwiceIsOneStop) {
    const TempDir dir;
    SamplesPublisher source = publisher(64);
    Recorder recorder = start(dir / "a.fovea", source);
    source.publish_sample(sample_of(1), model_of(1));
    ASSERT_TRUE(recorder.stop());
    const auto again = recorder.stop();
    ASSERT_TRUE(again);
    EXPECT_EQ(again->samples, 1u);
}

TEST(Recorder, AFileThatExistsIsRefused) {
    const TempDir dir;
    write_file(dir / "a.fovea", "precious");
    SamplesPublisher source = publisher(64);
    auto reader = SamplesReader::map(source.fd());
    ASSERT_TRUE(reader);
    EXPECT_FALSE(Recorder::start(dir / "a.fovea", std::move(*reader), {}));
    EXPECT_EQ(read_file(dir / "a.fovea"), "precious");
}
