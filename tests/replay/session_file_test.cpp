#include "replay/session_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <csignal>

#include "replay/import/fovea_csv.hpp"
#include "tests/replay/support.hpp"

using namespace fovea;
using namespace fovea::replay;
using namespace fovea::replay::testing;
using ::testing::HasSubstr;

namespace {

MotionModel odd_model(std::uint64_t sequence, std::uint8_t eyes_present) {
    MotionModel m;
    m.sequence = sequence;
    m.sample_id = sequence + 7;
    m.exposed = instant_from_ns(1'000'000'007 * static_cast<std::int64_t>(sequence));
    m.received = m.exposed + Duration{11};
    m.filtered = m.exposed + Duration{22};
    m.published = m.exposed + Duration{33};
    m.exposed_estimated = true;
    m.eyes_present = eyes_present;
    for (std::size_t i = 0; i < kEyeCount; ++i) {
        if (!((eyes_present >> i) & 1)) continue;
        EyeMotion& e = m.eyes[i];
        const double k = static_cast<double>(i + 1) / 3;
        e.reference = m.exposed - Duration{5};
        e.gaze_dir_head = *Direction<HeadFrame>::from({k, -0.1, -1});
        e.velocity_rad_s = {k, -k};
        e.event = GazeEvent::saccade;
        e.saccade = {m.exposed - Duration{100}, Duration{4567}, {}, *Direction<HeadFrame>::from({-k, 0.2, -1})};
        for (std::size_t h = 0; h < e.horizons.size(); ++h)
            e.horizons[h] = {static_cast<float>(h) / 7.0f, -static_cast<float>(k), 0.01f, 0.02f};
        e.ever_valid = true;
        e.valid_since = m.exposed - Duration{999};
        e.lost_before = i == 1;
        e.lost_since = m.exposed - Duration{5555};
        e.held_dir_head = *Direction<HeadFrame>::from({0, k, -1});
    }
    return m;
}

SessionFrame odd_frame(std::uint64_t n, std::uint32_t views) {
    SessionFrame f;
    f.client = 3;
    FrameTiming& t = f.timing;
    t.frame = n;
    t.model_sequence = n * 10;
    t.sample_id = n * 11;
    std::int64_t ns = static_cast<std::int64_t>(n) * 11'111'111;
    for (Instant* i : {&t.exposed, &t.received, &t.filtered, &t.published, &t.latched, &t.submitted, &t.gpu_done,
                       &t.photon, &t.predicted_photon})
        *i = instant_from_ns(ns += 1'000'003);
    t.photon_simulated = n % 2 == 0;
    t.photon_estimated = n % 3 == 0 && !t.photon_simulated;
    t.exposed_estimated = n % 3 == 0;
    t.kind = n % 5 == 0 ? FrameKind::extrapolated : FrameKind::rendered;
    t.pixels_shaded = 1'000 + n;
    t.pixels_full = std::uint64_t{1} << 40;
    t.view_count = views;
    for (std::uint32_t v = 0; v < views; ++v) {
        ViewFovea& w = t.views[v];
        w.eye = v == 0 ? Eye::left : Eye::right;
        w.fov = {-1.1, 0.9, 1.05, -0.95};
        w.head_from_view = {0.6, 0, 0.8, 0};
        w.center_ndc = {0.1 * v, -0.0};
        w.half_width_ndc = 0.3;
        w.half_height_ndc = 1.0 / 3;
    }
    return f;
}

void expect_same(const MotionModel& a, const MotionModel& b) {
    EXPECT_EQ(a.sequence, b.sequence);
    EXPECT_EQ(a.sample_id, b.sample_id);
    EXPECT_EQ(a.exposed, b.exposed);
    EXPECT_EQ(a.received, b.received);
    EXPECT_EQ(a.filtered, b.filtered);
    EXPECT_EQ(a.published, b.published);
    EXPECT_EQ(a.exposed_estimated, b.exposed_estimated);
    EXPECT_EQ(a.eyes_present, b.eyes_present);
    for (std::size_t i = 0; i < kEyeCount; ++i) {
        const EyeMotion &x = a.eyes[i], &y = b.eyes[i];
        EXPECT_EQ(x.reference, y.reference);
        EXPECT_TRUE(same(x.gaze_dir_head, y.gaze_dir_head));
        EXPECT_EQ(x.velocity_rad_s, y.velocity_rad_s);
        EXPECT_EQ(x.event, y.event);
        EXPECT_EQ(x.saccade.onset, y.saccade.onset);
        EXPECT_EQ(x.saccade.duration, y.saccade.duration);
        EXPECT_TRUE(same(x.saccade.start_dir_head, y.saccade.start_dir_head));
        EXPECT_TRUE(same(x.saccade.landing_dir_head, y.saccade.landing_dir_head));
        for (std::size_t h = 0; h < x.horizons.size(); ++h) {
            EXPECT_EQ(x.horizons[h].du_rad, y.horizons[h].du_rad);
            EXPECT_EQ(x.horizons[h].dv_rad, y.horizons[h].dv_rad);
            EXPECT_EQ(x.horizons[h].radius68_rad, y.horizons[h].radius68_rad);
            EXPECT_EQ(x.horizons[h].radius95_rad, y.horizons[h].radius95_rad);
        }
        EXPECT_EQ(x.ever_valid, y.ever_valid);
        EXPECT_EQ(x.valid_since, y.valid_since);
        EXPECT_EQ(x.lost_before, y.lost_before);
        EXPECT_EQ(x.lost_since, y.lost_since);
        EXPECT_TRUE(same(x.held_dir_head, y.held_dir_head));
    }
}

void expect_same(const SessionFrame& a, const SessionFrame& b) {
    const FrameTiming &x = a.timing, &y = b.timing;
    EXPECT_EQ(a.client, b.client);
    EXPECT_EQ(x.frame, y.frame);
    EXPECT_EQ(x.model_sequence, y.model_sequence);
    EXPECT_EQ(x.sample_id, y.sample_id);
    EXPECT_EQ(x.exposed, y.exposed);
    EXPECT_EQ(x.received, y.received);
    EXPECT_EQ(x.filtered, y.filtered);
    EXPECT_EQ(x.published, y.published);
    EXPECT_EQ(x.latched, y.latched);
    EXPECT_EQ(x.submitted, y.submitted);
    EXPECT_EQ(x.gpu_done, y.gpu_done);
    EXPECT_EQ(x.photon, y.photon);
    EXPECT_EQ(x.predicted_photon, y.predicted_photon);
    EXPECT_EQ(x.exposed_estimated, y.exposed_estimated);
    EXPECT_EQ(x.photon_simulated, y.photon_simulated);
    EXPECT_EQ(x.photon_estimated, y.photon_estimated);
    EXPECT_EQ(x.kind, y.kind);
    EXPECT_EQ(x.pixels_shaded, y.pixels_shaded);
    EXPECT_EQ(x.pixels_full, y.pixels_full);
    ASSERT_EQ(x.view_count, y.view_count);
    for (std::uint32_t v = 0; v < x.view_count; ++v) {
        EXPECT_EQ(x.views[v].eye, y.views[v].eye);
        EXPECT_EQ(x.views[v].fov.tan_left, y.views[v].fov.tan_left);
        EXPECT_EQ(x.views[v].fov.tan_right, y.views[v].fov.tan_right);
        EXPECT_EQ(x.views[v].fov.tan_up, y.views[v].fov.tan_up);
        EXPECT_EQ(x.views[v].fov.tan_down, y.views[v].fov.tan_down);
        EXPECT_EQ(x.views[v].head_from_view, y.views[v].head_from_view);
        EXPECT_TRUE(same_bits(x.views[v].center_ndc.y, y.views[v].center_ndc.y));
        EXPECT_EQ(x.views[v].center_ndc, y.views[v].center_ndc);
        EXPECT_EQ(x.views[v].half_width_ndc, y.views[v].half_width_ndc);
        EXPECT_EQ(x.views[v].half_height_ndc, y.views[v].half_height_ndc);
    }
}

// Runs SQL on a file from outside Fovea.
void tamper(const std::filesystem::path& path, const char* sql) {
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open(path.c_str(), &db), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(db, sql, nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(db);
    sqlite3_close(db);
}

std::size_t count_files(const std::filesystem::path& directory) {
    std::size_t n = 0;
    for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(directory)) ++n;
    return n;
}

}  // namespace

TEST(SessionFile, GivesBackEverythingThatWentIn) {
    const TempDir dir;
    const Recording recording = odd_recording(500, 1);
    auto writer = SessionWriter::create(dir / "a.fovea");
    ASSERT_TRUE(writer) << writer.error().message();
    writer->set_info(recording.info);
    writer->set_meta("config", "key = \"value\"\n");
    for (const auto& r : recording.samples) writer->add_sample(r.sample, r.label);
    for (std::uint64_t i = 1; i <= 40; ++i) writer->add_model(odd_model(i, static_cast<std::uint8_t>(1 + i % 7)));
    for (std::uint64_t i = 1; i <= 30; ++i) writer->add_frame(odd_frame(i, static_cast<std::uint32_t>(i % 5)));
    writer->add_event({instant_from_ns(5), "source_lost", "unplugged"});
    writer->add_counter({instant_from_ns(6), "x", 1});
    writer->add_counter({instant_from_ns(7), "x", -2});
    ASSERT_TRUE(writer->close());
    EXPECT_EQ(writer->dropped(), 0u);

    const auto reader = SessionReader::open(dir / "a.fovea");
    ASSERT_TRUE(reader) << reader.error().message();
    EXPECT_TRUE(reader->finished());
    EXPECT_EQ(reader->meta().at("config"), "key = \"value\"\n");
    EXPECT_EQ(reader->info().device, recording.info.device);
    EXPECT_EQ(reader->info().nominal_rate_hz, 90.5);
    std::size_t i = 0;
    ASSERT_TRUE(reader->samples([&](const RecordedSample& r) {
        EXPECT_TRUE(same(r, recording.samples.at(i))) << i;
        ++i;
        return true;
    }));
    EXPECT_EQ(i, recording.samples.size());
    std::uint64_t n = 0;
    ASSERT_TRUE(reader->models([&](const MotionModel& m) {
        ++n;
        expect_same(m, odd_model(n, static_cast<std::uint8_t>(1 + n % 7)));
        return true;
    }));
    EXPECT_EQ(n, 40u);
    n = 0;
    ASSERT_TRUE(reader->frames([&](const SessionFrame& f) {
        ++n;
        expect_same(f, odd_frame(n, static_cast<std::uint32_t>(n % 5)));
        return true;
    }));
    EXPECT_EQ(n, 30u);
    const auto events = reader->events();
    ASSERT_TRUE(events);
    ASSERT_EQ(events->size(), 1u);
    EXPECT_EQ(events->front().text, "unplugged");
    const auto counters = reader->counters();
    ASSERT_TRUE(counters);
    bool found = false;
    for (const auto& c : *counters) found |= c.name == "x" && c.value == -2;
    EXPECT_TRUE(found);
}

TEST(SessionFile, KeepsTruthAndTargetsAndReadsSessionsFromBeforeThem) {
    const TempDir dir;
    Recording r;
    for (int i = 0; i < 5; ++i) {
        RecordedSample s;
        s.sample.exposed = s.sample.received = instant_from_ns(i * 1000);
        if (i != 2) s.truth_dir_head = Direction<HeadFrame>{0.6, -0.0, -0.8};
        r.samples.push_back(s);
    }
    r.targets = {{instant_from_ns(0), instant_from_ns(2000), {}}, {instant_from_ns(2000), instant_from_ns(4000), {0, 0.6, -0.8}}};
    ASSERT_TRUE(write_session(dir / "a.fovea", r));
    const auto back = load_session(dir / "a.fovea");
    ASSERT_TRUE(back) << back.error().message();
    ASSERT_EQ(back->samples.size(), 5u);
    for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(back->samples[i].truth_dir_head, r.samples[i].truth_dir_head) << i;
    EXPECT_EQ(back->targets, r.targets);
    EXPECT_TRUE(back->info.has_truth);

    tamper(dir / "a.fovea", "DROP TABLE truth; DROP TABLE targets");
    const auto old = load_session(dir / "a.fovea");
    ASSERT_TRUE(old) << old.error().message();
    EXPECT_EQ(old->samples.size(), 5u);
    EXPECT_FALSE(old->samples[0].truth_dir_head);
    EXPECT_TRUE(old->targets.empty());
}

TEST(SessionFile, ARowCallbackCanStop) {
    const TempDir dir;
    ASSERT_TRUE(write_session(dir / "a.fovea", odd_recording(100, 2)));
    auto writer = SessionWriter::create(dir / "b.fovea");
    ASSERT_TRUE(writer);
    for (std::uint64_t i = 1; i <= 9; ++i) writer->add_frame(odd_frame(i, 2));
    ASSERT_TRUE(writer->close());
    int seen = 0;
    ASSERT_TRUE(SessionReader::open(dir / "a.fovea")->samples([&](const auto&) { return ++seen < 10; }));
    EXPECT_EQ(seen, 10);
    seen = 0;
    ASSERT_TRUE(SessionReader::open(dir / "b.fovea")->frames([&](const auto&) { return ++seen < 3; }));
    EXPECT_EQ(seen, 3);
}

TEST(SessionFile, CsvAndBackIsExactBitForBit) {
    const TempDir dir;
    const Recording recording = odd_recording(2000, 3);
    ASSERT_TRUE(write_session(dir / "a.fovea", recording));
    const auto first = load_recording(dir / "a.fovea");
    ASSERT_TRUE(first) << first.error().message();
    ASSERT_TRUE(write_csv(dir / "b.csv", *first));
    const auto second = load_recording(dir / "b.csv");
    ASSERT_TRUE(second) << second.error().message();
    ASSERT_TRUE(write_session(dir / "c.fovea", *second));
    const auto third = load_recording(dir / "c.fovea");
    ASSERT_TRUE(third);
    ASSERT_EQ(third->samples.size(), recording.samples.size());
    for (std::size_t i = 0; i < recording.samples.size(); ++i)
        ASSERT_TRUE(same(third->samples[i], recording.samples[i])) << i;
    EXPECT_EQ(to_csv(*third), to_csv(*first));
}

TEST(SessionFile, FinishedIsOneFileThatOnlyItsOwnerReads) {
    const TempDir dir;
    ASSERT_TRUE(write_session(dir / "a.fovea", odd_recording(5000, 4)));
    EXPECT_EQ(count_files(dir.path()), 1u);
    EXPECT_EQ(std::filesystem::status(dir / "a.fovea").permissions() & std::filesystem::perms(0077),
              std::filesystem::perms::none);
    ASSERT_TRUE(load_session(dir / "a.fovea"));
    EXPECT_EQ(count_files(dir.path()), 1u) << "reading leaves nothing behind";
}

TEST(SessionFile, AKilledWriterLosesNothingThatWasCommitted) {
    const TempDir dir;
    int pipe_ends[2];
    ASSERT_EQ(::pipe(pipe_ends), 0);
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
        auto writer = SessionWriter::create(dir / "a.fovea");
        if (!writer) ::_exit(1);
        const Recording recording = odd_recording(3000, 5);
        for (const auto& r : recording.samples) writer->add_sample(r.sample, r.label);
        for (std::uint64_t i = 1; i <= 300; ++i) writer->add_frame(odd_frame(i, 2));
        if (!writer->flush()) ::_exit(2);
        if (::write(pipe_ends[1], "x", 1) != 1) ::_exit(3);
        for (std::uint64_t i = 301;; ++i) writer->add_frame(odd_frame(i, 2));  // killed in the midst of writing
    }
    char byte = 0;
    ASSERT_EQ(::read(pipe_ends[0], &byte, 1), 1);
    ::kill(child, SIGKILL);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status));
    ::close(pipe_ends[0]);
    ::close(pipe_ends[1]);
    ASSERT_TRUE(std::filesystem::exists((dir / "a.fovea").string() + "-wal"));

    const auto reader = SessionReader::open(dir / "a.fovea");
    ASSERT_TRUE(reader) << reader.error().message();
    EXPECT_FALSE(reader->finished());
    const Recording recording = odd_recording(3000, 5);
    std::size_t samples = 0;
    ASSERT_TRUE(reader->samples([&](const RecordedSample& r) {
        EXPECT_TRUE(same(r, recording.samples.at(samples)));
        ++samples;
        return true;
    }));
    EXPECT_EQ(samples, 3000u);
    std::uint64_t frames = 0;
    ASSERT_TRUE(reader->frames([&](const SessionFrame& f) {
        ++frames;
        expect_same(f, odd_frame(frames, 2));  // whole transactions, in order
        return true;
    }));
    EXPECT_GE(frames, 300u);
}

TEST(SessionFile, CommitsByItselfWithoutBeingAsked) {
    const TempDir dir;
    auto writer = SessionWriter::create(dir / "a.fovea");
    ASSERT_TRUE(writer);
    writer->add_frame(odd_frame(1, 1));
    int frames = 0;
    for (int tries = 0; frames == 0 && tries < 100'000; ++tries)  // the writer's own transactions end it
        ASSERT_TRUE(SessionReader::open(dir / "a.fovea")->frames([&](const auto&) { return ++frames > 0; }));
    EXPECT_EQ(frames, 1);
}

TEST(SessionFile, RefusesToOverwriteUnlessTold) {
    const TempDir dir;
    write_file(dir / "a.fovea", "precious");
    const auto refused = SessionWriter::create(dir / "a.fovea");
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().message(), HasSubstr("the file exists"));
    EXPECT_EQ(read_file(dir / "a.fovea"), "precious");
    EXPECT_TRUE(write_session(dir / "a.fovea", odd_recording(10, 6), true));
    EXPECT_TRUE(load_session(dir / "a.fovea"));
}

TEST(SessionFile, SaysWhyItCannotBeCreated) {
    const TempDir dir;
    const auto missing = SessionWriter::create(dir / "no/such/a.fovea");
    ASSERT_FALSE(missing);
    EXPECT_THAT(missing.error().message(), HasSubstr("create the directory first"));
    std::filesystem::create_directory(dir / "d");
    SessionWriterOptions overwrite;
    overwrite.overwrite = true;
    const auto directory = SessionWriter::create(dir / "d", overwrite);
    ASSERT_FALSE(directory);
    EXPECT_THAT(directory.error().message(), HasSubstr("not a regular file"));
    // /proc refuses new files to everybody, root included.
    const auto refused = SessionWriter::create("/proc/a.fovea");
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().message(), HasSubstr("/proc/a.fovea"));
}

TEST(SessionFile, AFullDiskIsAnErrorThatKeepsWhatIsThere) {
    const TempDir dir;
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
        ::signal(SIGXFSZ, SIG_IGN);
        auto writer = SessionWriter::create(dir / "a.fovea");
        if (!writer) ::_exit(1);
        for (std::uint64_t i = 1; i <= 50; ++i) writer->add_frame(odd_frame(i, 2));
        if (!writer->flush()) ::_exit(2);
        const struct rlimit limit = {128 * 1024, 128 * 1024};  // no file may grow beyond this
        if (::setrlimit(RLIMIT_FSIZE, &limit) != 0) ::_exit(3);
        for (std::uint64_t i = 51; i <= 20'000; ++i) writer->add_frame(odd_frame(i, 2));
        const auto closed = writer->close();
        if (closed) ::_exit(4);
        if (closed.error().way_out.find("space") == std::string::npos) ::_exit(5);
        ::_exit(writer->dropped() > 0 ? 0 : 6);
    }
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 0);
    const auto reader = SessionReader::open(dir / "a.fovea");
    ASSERT_TRUE(reader) << reader.error().message();
    std::uint64_t frames = 0;
    ASSERT_TRUE(reader->frames([&](const SessionFrame& f) {
        expect_same(f, odd_frame(++frames, 2));
        return true;
    }));
    EXPECT_GE(frames, 50u);
}

TEST(SessionFile, ANewerSchemaSaysUpdate) {
    const TempDir dir;
    ASSERT_TRUE(write_session(dir / "a.fovea", odd_recording(10, 7)));
    tamper(dir / "a.fovea", ("PRAGMA user_version=" + std::to_string(kSessionSchema + 1)).c_str());
    const auto opened = SessionReader::open(dir / "a.fovea");
    ASSERT_FALSE(opened);
    EXPECT_THAT(opened.error().message(), HasSubstr("newer Fovea (schema 3; this one reads up to 2)"));
    EXPECT_THAT(opened.error().way_out, HasSubstr("update Fovea"));
}

TEST(SessionFile, ASessionFromBeforeExtrapolationIsReadAsRenderedFrames) {
    const TempDir dir;
    {
        auto writer = SessionWriter::create(dir / "a.fovea");
        ASSERT_TRUE(writer);
        writer->add_frame(odd_frame(5, 2));   // extrapolated, and its views must still be found
        ASSERT_TRUE(writer->close());
    }
    tamper(dir / "a.fovea", "ALTER TABLE frames DROP COLUMN extrapolated; PRAGMA user_version=1");
    const auto reader = SessionReader::open(dir / "a.fovea");
    ASSERT_TRUE(reader) << reader.error().message();
    SessionFrame expected = odd_frame(5, 2);
    expected.timing.kind = FrameKind::rendered;
    std::size_t n = 0;
    ASSERT_TRUE(reader->frames([&](const SessionFrame& f) {
        expect_same(f, expected);
        return ++n < 10;
    }));
    EXPECT_EQ(n, 1u);
}

TEST(SessionFile, ATimeThatCannotBeIsAnErrorAndNotAnOverflow) {
    const TempDir dir;
    ASSERT_TRUE(write_session(dir / "a.fovea", odd_recording(10, 11)));
    tamper(dir / "a.fovea", "UPDATE samples SET exposed_ns = -9223372036854775808 WHERE n = 3");
    const auto r = load_recording(dir / "a.fovea");
    ASSERT_FALSE(r);
    EXPECT_THAT(r.error().message(), HasSubstr("sample 3"));
}

TEST(SessionFile, ForeignFilesAreRefused) {
    const TempDir dir;
    tamper(dir / "other.db", "CREATE TABLE t (a)");
    write_file(dir / "text", "hello");
    write_file(dir / "empty", "");
    for (const auto& path : {dir / "text", dir / "empty", std::filesystem::path("/proc/self/exe"), dir.path()}) {
        const auto opened = SessionReader::open(path);
        ASSERT_FALSE(opened) << path;
        EXPECT_FALSE(opened.error().way_out.empty());
    }
    const auto other = SessionReader::open(dir / "other.db");
    ASSERT_FALSE(other);
    EXPECT_THAT(other.error().message(), HasSubstr("not a Fovea session"));
    const auto missing = SessionReader::open(dir / "missing");
    ASSERT_FALSE(missing);
    EXPECT_THAT(missing.error().message(), HasSubstr("No such file"));
}

TEST(SessionFile, TornAtAnyLengthIsAnErrorAndNeverACrash) {
    const TempDir dir;
    ASSERT_TRUE(write_session(dir / "a.fovea", odd_recording(100, 8)));
    const std::string whole = read_file(dir / "a.fovea");
    for (std::size_t length = 0; length < whole.size(); length += length < 200 ? 1 : 509) {
        write_file(dir / "torn.fovea", std::string_view(whole).substr(0, length));
        EXPECT_FALSE(load_session(dir / "torn.fovea")) << length;
        EXPECT_FALSE(load_recording(dir / "torn.fovea")) << length;
    }
}

TEST(SessionFile, FlippedBytesNeverCrash) {
    const TempDir dir;
    auto writer = SessionWriter::create(dir / "a.fovea");
    ASSERT_TRUE(writer);
    for (const auto& r : odd_recording(30, 9).samples) writer->add_sample(r.sample, r.label);
    for (std::uint64_t i = 1; i <= 10; ++i) writer->add_model(odd_model(i, 7)), writer->add_frame(odd_frame(i, 4));
    ASSERT_TRUE(writer->close());
    const std::string whole = read_file(dir / "a.fovea");
    std::mt19937_64 rng(10);
    for (int round = 0; round < 300; ++round) {
        std::string bad = whole;
        for (int i = 0; i < 8; ++i) bad[rng() % bad.size()] = static_cast<char>(rng());
        write_file(dir / "bad.fovea", bad);
        const auto reader = SessionReader::open(dir / "bad.fovea");
        if (!reader) continue;
        (void)reader->samples([](const auto&) { return true; });
        (void)reader->models([](const auto&) { return true; });
        (void)reader->frames([](const SessionFrame& f) { return f.timing.view_count <= kMaxViews; });
        (void)reader->events();
        (void)reader->counters();
    }
}

TEST(SessionWriter, WhenTheQueueIsFullItDropsAndCounts) {
    const TempDir dir;
    SessionWriterOptions options;
    options.queue_rows = 1024;
    auto writer = SessionWriter::create(dir / "a.fovea", options);
    ASSERT_TRUE(writer);
    for (std::uint64_t i = 1; i <= 100'000; ++i) writer->add_frame(odd_frame(i, 1));
    ASSERT_TRUE(writer->close());
    std::uint64_t written = 0;
    ASSERT_TRUE(SessionReader::open(dir / "a.fovea")->frames([&](const auto&) { return ++written > 0; }));
    EXPECT_EQ(written + writer->dropped(), 100'000u);
    const auto counters = SessionReader::open(dir / "a.fovea")->counters();
    ASSERT_TRUE(counters);
    bool found = false;
    for (const auto& c : *counters)
        found |= c.name == "session.rows_dropped" && c.value == static_cast<std::int64_t>(writer->dropped());
    EXPECT_TRUE(found);
}
