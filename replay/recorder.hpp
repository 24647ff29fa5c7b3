// The recorder: a subscriber of the shared rings of samples and frames that writes everything into a session file.
//
// It runs its own thread, which empties the rings into the session writer's queue every 20 ms (the rings hold seconds),
// so neither the pipeline nor a slow disk ever waits for the other. What was overwritten before it came to it is
// counted, and the count is written into the session (counters recorder.samples_lost and recorder.frames_lost).
// Threads: start() and stop() from one thread; the other functions from any.
// Errors: those of SessionWriter.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "protocol/samples_region.hpp"
#include "replay/session_file.hpp"

namespace fovea::replay {

struct RecorderOptions {
    RecordingInfo info;                        // device, source, rate: known from the source
    std::map<std::string, std::string> meta;   // more keys for the table meta, e.g. {"config", "..."}
    bool overwrite = false;
    bool from_oldest = false;                  // also what the rings still hold from before start()
    Duration drain_every = std::chrono::milliseconds(20);
};

struct RecorderStatus {
    std::uint64_t samples = 0, frames = 0;            // taken from the rings
    std::uint64_t samples_lost = 0, frames_lost = 0;  // overwritten in the rings
    std::uint64_t rows_dropped = 0;                   // the disk was too slow or full
};

class Recorder {
public:
    // From here on everything that is published is recorded.
    [[nodiscard]] static Result<Recorder> start(const std::filesystem::path& path, SamplesReader source,
                                                const RecorderOptions& options);
    Recorder(Recorder&&) noexcept;
    Recorder& operator=(Recorder&&) noexcept;
    ~Recorder();  // stops; an error at that point is lost: call stop()

    void add_event(SessionEvent event);
    [[nodiscard]] RecorderStatus status() const noexcept;
    [[nodiscard]] std::optional<Error> error() const;  // the first error of writing, e.g. a full disk
    // Records what is in the rings, closes the file. Idempotent. Returns the first error.
    [[nodiscard]] Result<RecorderStatus> stop();

private:
    struct State;
    explicit Recorder(std::unique_ptr<State> state) noexcept;
    std::unique_ptr<State> state_;
};

}  // namespace fovea::replay
