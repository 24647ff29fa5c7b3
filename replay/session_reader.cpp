// The session file's reading side.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>

#include "replay/import/importer.hpp"
#include "replay/import/text_table.hpp"
#include "replay/output_file.hpp"
#include "replay/session_file.hpp"
#include "replay/session_schema.hpp"
#include "replay/sqlite.hpp"

namespace fovea::replay {
namespace {

constexpr std::string_view kSqliteMagic{"SQLite format 3\0", 16};
constexpr std::size_t kHeaderBytes = 100;  // of an SQLite file; offsets below: sqlite.org/fileformat.html, 1.3

std::uint32_t big_endian(std::string_view header, std::size_t offset) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(header[offset + i]);
    return value;
}

// What can be said before SQLite touches the file; its schema.
Result<int> check_header(const std::filesystem::path& path) {
    const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (file < 0)
        return fail_errno("cannot open the session", errno, path.string(), "check the path and the permissions");
    struct stat status {};
    char bytes[kHeaderBytes] = {};
    const bool regular = ::fstat(file, &status) == 0 && S_ISREG(status.st_mode);
    const ssize_t got = regular ? ::read(file, bytes, sizeof bytes) : 0;
    ::close(file);
    if (!regular) return fail("is not a regular file", path.string(), "name a session file");
    const std::string_view header(bytes, sizeof bytes);
    if (got < static_cast<ssize_t>(kHeaderBytes) || !header.starts_with(kSqliteMagic))
        return fail("this is not a session file", path.string(),
                    "name a .fovea file; `fovea convert` reads other recordings");
    if (big_endian(header, 68) != static_cast<std::uint32_t>(kSessionApplicationId))
        return fail("is an SQLite database, but not a Fovea session", path.string(), "name a .fovea file");
    const auto schema = static_cast<std::int32_t>(big_endian(header, 60));
    if (schema > kSessionSchema)
        return fail("was written by a newer Fovea (schema " + std::to_string(schema) + "; this one reads up to " +
                        std::to_string(kSessionSchema) + ")",
                    path.string(), "update Fovea, or export it to CSV with the Fovea that wrote it");
    if (schema < 1) return fail("has no schema version", path.string(), "the session is damaged: record again");
    const std::uint32_t page_code = static_cast<std::uint32_t>(big_endian(header, 16) >> 16);
    const std::int64_t page = page_code == 1 ? 65536 : page_code;
    std::error_code none;
    const bool has_log = std::filesystem::exists(path.string() + "-wal", none);
    if (!has_log && status.st_size < page * big_endian(header, 28))
        return fail("is torn: " + std::to_string(status.st_size) + " bytes of " +
                        std::to_string(page * big_endian(header, 28)),
                    path.string(), "copy the file again");
    return schema;
}

Eye eye_from(std::int64_t value) {
    return value >= 0 && value < static_cast<std::int64_t>(kEyeCount) ? static_cast<Eye>(value) : Eye::combined;
}

constexpr const char* kSampleColumns =
    "id, device_ns, exposed_ns, received_ns, exposed_estimated, combined_valid, combined_x, combined_y, combined_z, "
    "combined_openness, combined_pupil_mm, combined_confidence, left_valid, left_x, left_y, left_z, left_openness, "
    "left_pupil_mm, left_confidence, right_valid, right_x, right_y, right_z, right_openness, right_pupil_mm, "
    "right_confidence, head_valid, head_w, head_x, head_y, head_z, label";

}  // namespace

struct SessionReader::State {
    Database database;
    int schema;
    std::map<std::string, std::string> meta;
    bool has_truth = false, has_targets = false;  // older sessions lack these tables

    // Calls row(statement) for each row of `sql` until it returns false.
    template <class Row>
    Result<void> each(const std::string& sql, Row&& row) const {
        auto statement = Statement::prepare(database, sql);
        if (!statement) return std::unexpected(statement.error());
        while (true) {
            const Statement::Step step = statement->step();
            if (step == Statement::Step::failed) return database.error("cannot read the session");
            if (step == Statement::Step::done || !row(*statement)) return {};
        }
    }

    [[nodiscard]] std::string get(const std::string& key) const {
        const auto it = meta.find(key);
        return it == meta.end() ? "" : it->second;
    }
};

SessionReader::SessionReader(std::unique_ptr<State> state) noexcept : state_(std::move(state)) {}
SessionReader::SessionReader(SessionReader&&) noexcept = default;
SessionReader& SessionReader::operator=(SessionReader&&) noexcept = default;
SessionReader::~SessionReader() = default;

Result<SessionReader> SessionReader::open(const std::filesystem::path& path) {
    const auto schema = check_header(path);
    if (!schema) return std::unexpected(schema.error());
    auto database = Database::open(path, false);
    if (!database) return std::unexpected(database.error());
    auto state = std::make_unique<State>(State{std::move(*database), *schema, {}, false, false});
    auto read = state->each("SELECT key, value FROM meta", [&](Statement& q) {
        std::string key = q.take_text();
        state->meta[std::move(key)] = q.take_text();
        return true;
    });
    if (read)
        read = state->each("SELECT name FROM sqlite_master WHERE type = 'table'", [&](Statement& q) {
            const std::string name = q.take_text();
            state->has_truth |= name == "truth";
            state->has_targets |= name == "targets";
            return true;
        });
    if (!read) return std::unexpected(read.error());
    return SessionReader(std::move(state));
}

const std::map<std::string, std::string>& SessionReader::meta() const noexcept { return state_->meta; }
bool SessionReader::finished() const noexcept { return state_->meta.contains("finished"); }

RecordingInfo SessionReader::info() const {
    RecordingInfo info{"session",
                       state_->get("device"),
                       state_->get("source"),
                       state_->get("licence"),
                       0,
                       state_->get("has_labels") == "1",
                       state_->get("has_head_pose") == "1",
                       state_->get("has_truth") == "1"};
    const std::string rate = state_->get("nominal_rate_hz");
    double value = 0;
    if (std::from_chars(rate.data(), rate.data() + rate.size(), value).ec == std::errc{} && value >= 0 && value < 1e7)
        info.nominal_rate_hz = value;
    return info;
}

Result<void> SessionReader::samples(const std::function<bool(const RecordedSample&)>& row) const {
    const std::string truth = state_->has_truth ? ", truth.x, truth.y, truth.z FROM samples LEFT JOIN truth USING (n)" : ", NULL, NULL, NULL FROM samples";
    return state_->each(std::string("SELECT ") + kSampleColumns + truth + " ORDER BY samples.n", [&](Statement& q) {
        RecordedSample r;
        GazeSample& s = r.sample;
        s.id = static_cast<std::uint64_t>(q.take_integer());
        s.device_time.ns = q.take_integer();
        s.exposed = q.take_instant();
        s.received = q.take_instant();
        s.exposed_estimated = q.take_flag();
        for (EyeState& eye : s.eyes) {
            eye.valid = q.take_flag();
            for (double* d : {&eye.gaze_dir_head.x, &eye.gaze_dir_head.y, &eye.gaze_dir_head.z, &eye.openness,
                              &eye.pupil_mm, &eye.confidence})
                *d = q.take_real();
        }
        s.head.valid = q.take_flag();
        auto& w = s.head.world_from_head;
        for (double* d : {&w.w, &w.x, &w.y, &w.z}) *d = q.take_real();
        const std::int64_t label = q.take_integer();
        if (label > 0 && label < kLabelCount) r.label = static_cast<Label>(label);
        Direction<HeadFrame> really;
        for (double* d : {&really.x, &really.y, &really.z}) *d = q.take_real();
        if (really.x == really.x) r.truth_dir_head = really;  // NULL is NaN
        return row(r);
    });
}

Result<void> SessionReader::models(const std::function<bool(const MotionModel&)>& row) const {
    bool torn = false;
    auto done = state_->each(
        "SELECT sequence, sample_id, exposed_ns, received_ns, filtered_ns, published_ns, exposed_estimated, "
        "eyes_present, eyes FROM focus ORDER BY rowid",
        [&](Statement& q) {
            MotionModel m;
            m.sequence = static_cast<std::uint64_t>(q.take_integer());
            m.sample_id = static_cast<std::uint64_t>(q.take_integer());
            for (Instant* t : {&m.exposed, &m.received, &m.filtered, &m.published}) *t = q.take_instant();
            m.exposed_estimated = q.take_flag();
            m.eyes_present = static_cast<std::uint8_t>(q.take_integer() & 7);
            torn = !decode_eyes(q.take_blob(), m);
            return !torn && row(m);
        });
    if (done && torn) return fail("a row of the table focus is damaged", state_->database.path().string(), "record again");
    return done;
}

Result<void> SessionReader::frames(const std::function<bool(const SessionFrame&)>& row) const {
    // One pass: a row per view, the columns of its frame repeated.
    std::optional<SessionFrame> frame;
    std::int64_t frame_n = 0;
    bool stopped = false;
    auto done = state_->each(
        std::string("SELECT n, client, frame, model_sequence, sample_id, exposed_ns, received_ns, filtered_ns, published_ns, "
        "latched_ns, submitted_ns, gpu_done_ns, photon_ns, predicted_photon_ns, exposed_estimated, photon_simulated, ") +
        "pixels_shaded, pixels_full, view_count, " + std::string(state_->schema < 2 ? "0" : "extrapolated") + ", view, eye, tan_left, tan_right, tan_up, tan_down, head_from_view_w, "
        "head_from_view_x, head_from_view_y, head_from_view_z, x_ndc, y_ndc, half_width_ndc, half_height_ndc "
        "FROM frames LEFT JOIN frame_views ON frame_n = n ORDER BY n, view",
        [&](Statement& q) {
            const std::int64_t n = q.take_integer();
            if (frame && n != frame_n && !row(*frame)) {
                stopped = true;
                return false;
            }
            if (!frame || n != frame_n) frame.emplace();
            frame_n = n;
            frame->client = static_cast<std::uint64_t>(q.take_integer());
            FrameTiming& t = frame->timing;
            for (std::uint64_t* u : {&t.frame, &t.model_sequence, &t.sample_id})
                *u = static_cast<std::uint64_t>(q.take_integer());
            for (Instant* i : {&t.exposed, &t.received, &t.filtered, &t.published, &t.latched, &t.submitted,
                               &t.gpu_done, &t.photon, &t.predicted_photon})
                *i = q.take_instant();
            t.exposed_estimated = q.take_flag();
            const std::int64_t photon = q.take_integer();   // kPhotonMeasured and so on
            t.photon_estimated = photon == kPhotonEstimated;
            t.photon_simulated = photon != kPhotonMeasured && !t.photon_estimated;
            t.pixels_shaded = static_cast<std::uint64_t>(q.take_integer());
            t.pixels_full = static_cast<std::uint64_t>(q.take_integer());
            const std::int64_t views = q.take_integer();
            t.view_count = views > 0 && views <= static_cast<std::int64_t>(kMaxViews) ? static_cast<std::uint32_t>(views) : 0;
            t.kind = q.take_flag() ? FrameKind::extrapolated : FrameKind::rendered;
            const std::int64_t view = q.take_integer();
            if (view < 0 || view >= static_cast<std::int64_t>(t.view_count)) return true;
            ViewFovea& v = t.views[static_cast<std::size_t>(view)];
            v.eye = eye_from(q.take_integer());
            auto& w = v.head_from_view;
            for (double* d : {&v.fov.tan_left, &v.fov.tan_right, &v.fov.tan_up, &v.fov.tan_down, &w.w, &w.x, &w.y,
                              &w.z, &v.center_ndc.x, &v.center_ndc.y, &v.half_width_ndc, &v.half_height_ndc})
                *d = q.take_real();
            return true;
        });
    if (done && frame && !stopped) (void)row(*frame);
    return done;
}

Result<std::vector<TargetShown>> SessionReader::targets() const {
    std::vector<TargetShown> targets;
    if (!state_->has_targets) return targets;
    auto done = state_->each("SELECT start_ns, end_ns, x, y, z FROM targets ORDER BY rowid", [&](Statement& q) {
        TargetShown t;
        t.start = q.take_instant();
        t.end = q.take_instant();
        for (double* d : {&t.dir_head.x, &t.dir_head.y, &t.dir_head.z}) *d = q.take_real();
        targets.push_back(t);
        return true;
    });
    if (!done) return std::unexpected(done.error());
    return targets;
}

Result<std::vector<SessionEvent>> SessionReader::events() const {
    std::vector<SessionEvent> events;
    auto done = state_->each("SELECT at_ns, kind, text FROM events ORDER BY rowid", [&](Statement& q) {
        const Instant at = q.take_instant();
        std::string kind = q.take_text();
        events.push_back({at, std::move(kind), q.take_text()});
        return true;
    });
    if (!done) return std::unexpected(done.error());
    return events;
}

Result<std::vector<SessionCounter>> SessionReader::counters() const {
    std::map<std::string, SessionCounter> last;
    auto done = state_->each("SELECT at_ns, name, value FROM counters ORDER BY rowid", [&](Statement& q) {
        const Instant at = q.take_instant();
        std::string name = q.take_text();
        const std::int64_t value = q.take_integer();
        last[name] = {at, name, value};
        return true;
    });
    if (!done) return std::unexpected(done.error());
    std::vector<SessionCounter> counters;
    for (auto& [name, counter] : last) counters.push_back(std::move(counter));
    return counters;
}

Result<Recording> load_session(const std::filesystem::path& path) {
    auto reader = SessionReader::open(path);
    if (!reader) return std::unexpected(reader.error());
    Recording recording{reader->info(), {}};
    bool possible = true;
    auto read = reader->samples([&](const RecordedSample& r) {
        for (const std::int64_t t : {r.sample.device_time.ns, to_ns(r.sample.exposed), to_ns(r.sample.received)})
            possible &= t >= -kMaxTime_ns && t <= kMaxTime_ns;
        if (!possible) return false;
        recording.samples.push_back(r);
        recording.info.has_labels |= r.label != Label::none;
        recording.info.has_head_pose |= r.sample.head.valid;
        recording.info.has_truth |= r.truth_dir_head.has_value();
        return true;
    });
    if (!read) return std::unexpected(read.error());
    auto targets = reader->targets();
    if (!targets) return std::unexpected(targets.error());
    recording.targets = std::move(*targets);
    if (!possible)
        return fail("sample " + std::to_string(recording.samples.size() + 1) + " has a time beyond +-2^62 ns",
                    path.string(), "the session is damaged: record again");
    return recording;
}

// Written beside the target and renamed at the end: a file that is to be overwritten goes only when the new one is whole.
Result<void> write_session(const std::filesystem::path& path, const Recording& recording, bool overwrite) {
    std::error_code none;
    if (!overwrite && std::filesystem::exists(path, none))
        return fail("the file exists", path.string(), "choose another name, or allow overwriting");
    auto part = PartFile::beside(path.string());
    if (!part) return std::unexpected(part.error());
    SessionWriterOptions options;
    options.overwrite = true;
    options.when_full = SessionWriterOptions::WhenFull::wait;
    auto writer = SessionWriter::create(part->path(), options);
    if (!writer) return std::unexpected(part->told_of_file(writer.error()));
    writer->set_info(recording.info);
    for (const RecordedSample& r : recording.samples) writer->add_sample(r.sample, r.label, r.truth_dir_head);
    for (const TargetShown& t : recording.targets) writer->add_target(t);
    if (auto closed = writer->close(); !closed) return std::unexpected(part->told_of_file(closed.error()));
    return part->put_in_place();
}

bool recognise_session(std::string_view prefix) {
    return prefix.size() >= kHeaderBytes && prefix.starts_with(kSqliteMagic) &&
           big_endian(prefix, 68) == static_cast<std::uint32_t>(kSessionApplicationId);
}
Result<Recording> read_session(const ImportInput& input) { return load_session(input.path); }

}  // namespace fovea::replay
