// The session file's writing side: a queue, a thread, a transaction every 100 ms.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <charconv>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "replay/session_file.hpp"
#include "replay/session_schema.hpp"
#include "replay/sqlite.hpp"

namespace fovea::replay {
namespace {

std::string question_marks(int count) {
    std::string text = "(?";
    for (int i = 1; i < count; ++i) text += ",?";
    return text + ")";
}

// The statements of the writer's thread.
struct Inserts {
    Statement meta, sample, truth, target, model, frame, view, event, counter;

    static Result<Inserts> prepare(const Database& db) {
        auto meta = Statement::prepare(db, "INSERT OR REPLACE INTO meta VALUES " + question_marks(2));
        auto sample = Statement::prepare(db, "INSERT INTO samples VALUES (NULL," + question_marks(32).substr(1));
        auto truth = Statement::prepare(db, "INSERT INTO truth VALUES (last_insert_rowid(),?,?,?)");
        auto target = Statement::prepare(db, "INSERT INTO targets VALUES " + question_marks(5));
        auto model = Statement::prepare(db, "INSERT INTO focus VALUES " + question_marks(16));
        auto frame = Statement::prepare(db, "INSERT INTO frames VALUES " + question_marks(20));
        auto view = Statement::prepare(db, "INSERT INTO frame_views VALUES " + question_marks(15));
        auto event = Statement::prepare(db, "INSERT INTO events VALUES " + question_marks(3));
        auto counter = Statement::prepare(db, "INSERT INTO counters VALUES " + question_marks(3));
        for (auto* s : {&meta, &sample, &truth, &target, &model, &frame, &view, &event, &counter})
            if (!*s) return std::unexpected(s->error());
        return Inserts{std::move(*meta),  std::move(*sample), std::move(*truth), std::move(*target), std::move(*model),  std::move(*frame),
                       std::move(*view), std::move(*event),  std::move(*counter)};
    }
};

bool insert(Inserts& in, const RecordedSample& r) {
    const GazeSample& s = r.sample;
    Statement& q = in.sample;
    q.begin();
    q.put(s.id);
    q.put(s.device_time.ns);
    q.put(s.exposed);
    q.put(s.received);
    q.put(s.exposed_estimated);
    for (const EyeState& eye : s.eyes) {
        q.put(eye.valid);
        q.put(eye.gaze_dir_head.x), q.put(eye.gaze_dir_head.y), q.put(eye.gaze_dir_head.z);
        q.put(eye.openness), q.put(eye.pupil_mm), q.put(eye.confidence);
    }
    q.put(s.head.valid);
    const auto& w = s.head.world_from_head;
    q.put(w.w), q.put(w.x), q.put(w.y), q.put(w.z);
    q.put(static_cast<std::uint32_t>(r.label));
    const bool done = q.run();
    if (!done || !r.truth_dir_head) return done;
    Statement& truth = in.truth;
    truth.begin();
    truth.put(r.truth_dir_head->x), truth.put(r.truth_dir_head->y), truth.put(r.truth_dir_head->z);
    return truth.run();
}

bool insert(Inserts& in, const MotionModel& m, std::string& blob) {
    const EyeMotion& eye = m.eye(Eye::combined);
    Statement& q = in.model;
    q.begin();
    q.put(m.sequence);
    q.put(m.sample_id);
    q.put(m.exposed), q.put(m.received), q.put(m.filtered), q.put(m.published);
    q.put(m.exposed_estimated);
    q.put(static_cast<std::uint32_t>(eye.event));
    q.put(eye.reference);
    q.put(eye.gaze_dir_head.x), q.put(eye.gaze_dir_head.y), q.put(eye.gaze_dir_head.z);
    q.put(eye.velocity_rad_s.u), q.put(eye.velocity_rad_s.v);
    q.put(std::uint32_t{m.eyes_present});
    encode_eyes(m, blob);
    q.put_blob(blob);
    return q.run();
}

bool insert(Inserts& in, const SessionFrame& f, std::uint64_t n) {
    const FrameTiming& t = f.timing;
    const std::uint32_t views = std::min<std::uint32_t>(t.view_count, kMaxViews);
    Statement& q = in.frame;
    q.begin();
    q.put(n), q.put(f.client), q.put(t.frame), q.put(t.model_sequence), q.put(t.sample_id);
    for (const Instant i : {t.exposed, t.received, t.filtered, t.published, t.latched, t.submitted, t.gpu_done,
                            t.photon, t.predicted_photon})
        q.put(i);
    q.put(t.exposed_estimated), q.put(t.photon_simulated ? kPhotonSimulated : t.photon_estimated ? kPhotonEstimated : kPhotonMeasured);
    q.put(t.pixels_shaded), q.put(t.pixels_full), q.put(views), q.put(t.kind == FrameKind::extrapolated);
    bool ok = q.run();
    for (std::uint32_t i = 0; ok && i < views; ++i) {
        const ViewFovea& v = t.views[i];
        Statement& w = in.view;
        w.begin();
        w.put(n), w.put(i), w.put(static_cast<std::uint32_t>(v.eye));
        const auto& q4 = v.head_from_view;
        for (const double d : {v.fov.tan_left, v.fov.tan_right, v.fov.tan_up, v.fov.tan_down, q4.w, q4.x, q4.y, q4.z,
                               v.center_ndc.x, v.center_ndc.y, v.half_width_ndc, v.half_height_ndc})
            w.put(d);
        ok = w.run();
    }
    return ok;
}

// What waits to be written; one vector per table keeps the order within each.
struct Batch {
    std::vector<std::pair<std::string, std::string>> meta;
    std::vector<RecordedSample> samples;
    std::vector<TargetShown> targets;
    std::vector<MotionModel> models;
    std::vector<SessionFrame> frames;
    std::vector<SessionEvent> events;
    std::vector<SessionCounter> counters;

    [[nodiscard]] std::size_t rows() const {
        return meta.size() + samples.size() + targets.size() + models.size() + frames.size() + events.size() + counters.size();
    }
    void clear() {  // keeps the memory
        meta.clear(), samples.clear(), targets.clear(), models.clear(), frames.clear(), events.clear(), counters.clear();
    }
};

// The empty file, so that errors come with errno. Gaze is biometric: only the owner may read it.
Result<void> create_file(const std::filesystem::path& path, bool overwrite) {
    struct stat status {};
    if (::lstat(path.c_str(), &status) == 0) {
        if (!S_ISREG(status.st_mode)) return fail("is not a regular file", path.string(), "choose another name");
        if (!overwrite) return fail("the file exists", path.string(), "choose another name, or allow overwriting");
        for (const char* suffix : {"", "-wal", "-shm", "-journal"})
            if (::unlink((path.string() + suffix).c_str()) != 0 && errno != ENOENT)
                return fail_errno("cannot replace the file", errno, path.string(), "choose another name");
    }
    const int file = ::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    if (file < 0)
        return fail_errno("cannot create the session file", errno, path.string(),
                          errno == ENOENT ? "create the directory first" : "choose a directory that is writable");
    ::close(file);
    return {};
}

}  // namespace

struct SessionWriter::State {
    std::filesystem::path path;
    SessionWriterOptions options;
    std::optional<Database> database;
    std::optional<Inserts> inserts;

    std::mutex mutex;  // guards all down to `closed`
    std::condition_variable work, progress;
    Batch waiting;
    std::uint64_t added = 0, settled = 0;  // rows taken in; rows committed or given up
    bool ending = false, hurry = false;
    std::optional<Error> first_error;
    bool closed = false;

    std::atomic<std::uint64_t> dropped{0};
    std::uint64_t frame_n = 0;
    std::string blob;
    std::thread thread;

    ~State() { (void)close(); }

    template <class Add>
    void add(Add&& push) {
        std::unique_lock lock(mutex);
        if (options.when_full == SessionWriterOptions::WhenFull::wait)
            progress.wait(lock, [&] { return waiting.rows() < options.queue_rows || ending; });
        if (ending || waiting.rows() >= options.queue_rows) {
            dropped.fetch_add(1, std::memory_order_relaxed);
            return;
        }
        push(waiting);
        ++added;
        if (waiting.rows() == options.queue_rows / 2) work.notify_one();
    }

    bool insert_all(const Batch& batch) {
        for (const auto& [key, value] : batch.meta) {
            inserts->meta.begin();
            inserts->meta.put_text(key), inserts->meta.put_text(value);
            if (!inserts->meta.run()) return false;
        }
        for (const RecordedSample& row : batch.samples)
            if (!insert(*inserts, row)) return false;
        for (const TargetShown& row : batch.targets) {
            Statement& q = inserts->target;
            q.begin();
            q.put(row.start), q.put(row.end), q.put(row.dir_head.x), q.put(row.dir_head.y), q.put(row.dir_head.z);
            if (!q.run()) return false;
        }
        for (const MotionModel& row : batch.models)
            if (!insert(*inserts, row, blob)) return false;
        for (const SessionFrame& row : batch.frames)
            if (!insert(*inserts, row, ++frame_n)) return false;
        for (const SessionEvent& row : batch.events) {
            inserts->event.begin();
            inserts->event.put(row.at), inserts->event.put_text(row.kind), inserts->event.put_text(row.text);
            if (!inserts->event.run()) return false;
        }
        for (const SessionCounter& row : batch.counters) {
            inserts->counter.begin();
            inserts->counter.put(row.at), inserts->counter.put_text(row.name), inserts->counter.put(row.value);
            if (!inserts->counter.run()) return false;
        }
        return true;
    }

    void commit(const Batch& batch) {
        const std::uint64_t frame_n_before = frame_n;
        Result<void> done = database->execute("BEGIN");
        if (done && !insert_all(batch)) done = database->error("cannot write to the session");
        if (done) done = database->execute("COMMIT");
        if (done) return;
        (void)database->execute("ROLLBACK");  // fails when SQLite has rolled back by itself
        frame_n = frame_n_before;
        dropped.fetch_add(batch.rows(), std::memory_order_relaxed);
        const std::lock_guard lock(mutex);
        if (!first_error) first_error = done.error();
    }

    void run() {
        Batch batch;
        std::unique_lock lock(mutex);
        while (true) {
            work.wait_for(lock, options.commit_every,
                          [&] { return ending || hurry || waiting.rows() >= options.queue_rows / 2; });
            hurry = false;
            const bool last = ending;
            std::swap(batch, waiting);
            lock.unlock();
            if (batch.rows() > 0) commit(batch);
            lock.lock();
            settled += batch.rows();
            batch.clear();
            progress.notify_all();
            if (last && waiting.rows() == 0) return;
        }
    }

    Result<void> close() {
        {
            const std::lock_guard lock(mutex);
            if (closed) return outcome();
            closed = true;
            ending = true;
        }
        work.notify_all();
        progress.notify_all();
        if (thread.joinable()) thread.join();
        if (!inserts) return outcome();
        Batch batch;
        batch.meta.emplace_back("finished", "1");
        batch.counters.push_back({MonotonicClock::now(), "session.rows_dropped",
                                  static_cast<std::int64_t>(dropped.load(std::memory_order_relaxed))});
        commit(batch);
        inserts.reset();
        // Folds the log into the file and takes it away. Another process that reads just now keeps it: no loss.
        (void)database->execute("PRAGMA wal_checkpoint(TRUNCATE); PRAGMA journal_mode=DELETE");
        database.reset();
        return outcome();
    }

    Result<void> outcome() {
        if (first_error) return std::unexpected(*first_error);
        return {};
    }
};

SessionWriter::SessionWriter(std::unique_ptr<State> state) noexcept : state_(std::move(state)) {}
SessionWriter::SessionWriter(SessionWriter&&) noexcept = default;
SessionWriter& SessionWriter::operator=(SessionWriter&&) noexcept = default;
SessionWriter::~SessionWriter() = default;

Result<SessionWriter> SessionWriter::create(const std::filesystem::path& path, const SessionWriterOptions& options) {
    FOVEA_REQUIRE(options.queue_rows >= 1024 && options.queue_rows <= (1u << 24));
    if (auto created = create_file(path, options.overwrite); !created) return std::unexpected(created.error());
    auto state = std::make_unique<State>();
    state->path = path;
    state->options = options;
    const auto give_up = [&](const Error& error) {
        state->inserts.reset();
        state->database.reset();
        for (const char* suffix : {"", "-wal", "-shm", "-journal"}) ::unlink((path.string() + suffix).c_str());
        return std::unexpected(error);
    };
    auto database = Database::open(path, true);
    if (!database) return give_up(database.error());
    state->database = std::move(*database);
    // The tables go straight into the file, before the log is switched on: even a session that is killed in its first
    // 100 ms says what it is. NORMAL: a commit survives the process (-9); a power cut may take the last ones, no more.
    const std::string setup = "PRAGMA application_id=" + std::to_string(kSessionApplicationId) +
                              "; BEGIN; PRAGMA user_version=" + std::to_string(kSessionSchema) + ";" + kSessionTables +
                              "COMMIT; PRAGMA journal_mode=WAL; PRAGMA synchronous=NORMAL";
    if (auto done = state->database->execute(setup.c_str()); !done) return give_up(done.error());
    auto inserts = Inserts::prepare(*state->database);
    if (!inserts) return give_up(inserts.error());
    state->inserts = std::move(*inserts);
    state->thread = std::thread([s = state.get()] { s->run(); });
    SessionWriter writer(std::move(state));
    writer.set_meta("fovea_version", FOVEA_VERSION);
    return writer;
}

void SessionWriter::set_meta(std::string key, std::string value) {
    state_->add([&](Batch& b) { b.meta.emplace_back(std::move(key), std::move(value)); });
}

void SessionWriter::set_info(const RecordingInfo& info) {
    char rate[64];
    const auto [end, ec] = std::to_chars(rate, rate + sizeof rate, info.nominal_rate_hz);
    set_meta("device", info.device);
    set_meta("source", info.source);
    set_meta("licence", info.licence);
    set_meta("nominal_rate_hz", std::string(rate, end));
    set_meta("has_labels", info.has_labels ? "1" : "0");
    set_meta("has_head_pose", info.has_head_pose ? "1" : "0");
    if (info.has_truth) set_meta("has_truth", "1");
}

void SessionWriter::add_sample(const GazeSample& sample, Label label, const std::optional<Direction<HeadFrame>>& truth_dir_head) {
    state_->add([&](Batch& b) { b.samples.push_back({sample, label, truth_dir_head}); });
}
void SessionWriter::add_target(const TargetShown& target) {
    state_->add([&](Batch& b) { b.targets.push_back(target); });
}
void SessionWriter::add_model(const MotionModel& model) {
    state_->add([&](Batch& b) { b.models.push_back(model); });
}
void SessionWriter::add_frame(const SessionFrame& frame) {
    state_->add([&](Batch& b) { b.frames.push_back(frame); });
}
void SessionWriter::add_event(SessionEvent event) {
    state_->add([&](Batch& b) { b.events.push_back(std::move(event)); });
}
void SessionWriter::add_counter(SessionCounter counter) {
    state_->add([&](Batch& b) { b.counters.push_back(std::move(counter)); });
}

std::uint64_t SessionWriter::dropped() const noexcept { return state_->dropped.load(std::memory_order_relaxed); }

std::optional<Error> SessionWriter::error() const {
    const std::lock_guard lock(state_->mutex);
    return state_->first_error;
}

Result<void> SessionWriter::flush() {
    std::unique_lock lock(state_->mutex);
    const std::uint64_t target = state_->added;
    state_->hurry = true;
    state_->work.notify_one();
    state_->progress.wait(lock, [&] { return state_->settled >= target || state_->closed; });
    return state_->outcome();
}

Result<void> SessionWriter::close() { return state_->close(); }

}  // namespace fovea::replay
