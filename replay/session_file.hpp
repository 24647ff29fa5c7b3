// The session file: one SQLite database that holds all of a run. Schema: docs/session_file.md.
//
// What is committed survives a killed process (-9): rows reach the disk's write-ahead log every 100 ms. A finished
// session is ONE file without -wal and -shm beside it; an unfinished one is recovered when it is opened.
// Threads: SessionWriter's add functions may be called from any thread; they copy into a bounded queue that the
// writer's own thread empties. SessionReader: one thread at a time.
// Errors: a missing directory, no permission, a full disk, a file that exists; for reading: a foreign file, a torn
// one, a session of a newer schema.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/frame_timing.hpp"
#include "protocol/gaze_sample.hpp"
#include "protocol/motion_model.hpp"
#include "replay/recording.hpp"

namespace fovea::replay {

inline constexpr std::int32_t kSessionApplicationId = 0x466F7661;  // "Fova", in the SQLite header
inline constexpr int kSessionSchema = 2;                           // SQLite's user_version

// A frame as reported by one client of the daemon.
struct SessionFrame {
    std::uint64_t client = 0;  // number of the connection, from 1
    FrameTiming timing;
};

struct SessionEvent {
    Instant at;
    std::string kind;  // one word, e.g. "source_lost"
    std::string text;
};

struct SessionCounter {
    Instant at;
    std::string name;  // e.g. "recorder.samples_lost"
    std::int64_t value = 0;
};

struct SessionWriterOptions {
    bool overwrite = false;
    // When the queue is full (the disk stalls): wait for room, or count the row as dropped and go on.
    enum class WhenFull : std::uint8_t { wait, drop } when_full = WhenFull::drop;
    std::size_t queue_rows = 65'536;                       // [1024, 2^24]; one second at 1 MHz is 10^6
    Duration commit_every = std::chrono::milliseconds(100);
};

class SessionWriter {
public:
    [[nodiscard]] static Result<SessionWriter> create(const std::filesystem::path& path,
                                                      const SessionWriterOptions& options = {});
    SessionWriter(SessionWriter&&) noexcept;
    SessionWriter& operator=(SessionWriter&&) noexcept;
    ~SessionWriter();  // closes; an error at that point is lost: call close()

    void set_meta(std::string key, std::string value);  // e.g. "device", "source", "config"
    void set_info(const RecordingInfo& info);           // the meta keys that load_recording reads back
    // `truth_dir_head`: where the eye really looked, when that is known (a synthetic eye).
    void add_sample(const GazeSample& sample, Label label = Label::none, const std::optional<Direction<HeadFrame>>& truth_dir_head = {});
    void add_target(const TargetShown& target);  // what the person was asked to look at
    void add_model(const MotionModel& model);
    void add_frame(const SessionFrame& frame);
    void add_event(SessionEvent event);
    void add_counter(SessionCounter counter);

    // Rows that were lost because the queue was full (WhenFull::drop) or the disk failed.
    [[nodiscard]] std::uint64_t dropped() const noexcept;
    // The first error of the writer's thread (a full disk), or nothing. After it rows are dropped.
    [[nodiscard]] std::optional<Error> error() const;
    // Waits until everything added so far is committed. Returns the first error.
    [[nodiscard]] Result<void> flush();
    // Writes what is queued, folds the log into the file, and ends. Returns the first error. Idempotent.
    [[nodiscard]] Result<void> close();

private:
    struct State;
    explicit SessionWriter(std::unique_ptr<State> state) noexcept;
    std::unique_ptr<State> state_;
};

class SessionReader {
public:
    [[nodiscard]] static Result<SessionReader> open(const std::filesystem::path& path);
    SessionReader(SessionReader&&) noexcept;
    SessionReader& operator=(SessionReader&&) noexcept;
    ~SessionReader();

    [[nodiscard]] const std::map<std::string, std::string>& meta() const noexcept;
    [[nodiscard]] bool finished() const noexcept;  // false: the writer was killed, or is still writing
    [[nodiscard]] RecordingInfo info() const;

    // Each calls back once per row, in the order of recording; the callback returns false to stop.
    [[nodiscard]] Result<void> samples(const std::function<bool(const RecordedSample&)>& row) const;
    [[nodiscard]] Result<void> models(const std::function<bool(const MotionModel&)>& row) const;
    [[nodiscard]] Result<void> frames(const std::function<bool(const SessionFrame&)>& row) const;
    [[nodiscard]] Result<std::vector<TargetShown>> targets() const;
    [[nodiscard]] Result<std::vector<SessionEvent>> events() const;
    [[nodiscard]] Result<std::vector<SessionCounter>> counters() const;  // the last value of each name

private:
    struct State;
    explicit SessionReader(std::unique_ptr<State> state) noexcept;
    std::unique_ptr<State> state_;
};

// The raw samples of a session as a recording, and a recording as a session (exact both ways).
[[nodiscard]] Result<Recording> load_session(const std::filesystem::path& path);
[[nodiscard]] Result<void> write_session(const std::filesystem::path& path, const Recording& recording,
                                         bool overwrite = false);

}  // namespace fovea::replay
