// What fovead records: at most one session file at a time, from its start (--record) or between an administrator's
// `record` and `end_recording`.
//
// A session that was wanted from the start begins when the source is first known, so that it says what was recorded;
// the shared ring keeps what was published before. Nothing is ever overwritten: a number is added to the name.
// Threads: the service thread. Errors: those of the session file; a second recording while one is running.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "daemon/service/config.hpp"
#include "daemon/service/status.hpp"
#include "replay/recorder.hpp"

namespace fovea {

class Recording {
public:
    explicit Recording(std::string wanted) : wanted_{std::move(wanted)} {}

    // Begins the session that was wanted, if there is one, and writes the change into whatever is being recorded.
    Result<void> source_changed(const service::SourceStatus& source, const service::Config& config, int samples_fd);
    // A reload or a switch: the whole new config as an event; the session's meta data keeps the one that it began with.
    void config_changed(const service::Config& config);
    // From now on into `path`. Returns the file's real name.
    Result<std::string> begin(const std::string& path, const service::SourceStatus& source, const service::Config& config, int samples_fd);
    // Finishes the file; what was recorded.
    Result<service::RecorderStatus> end();
    // At the daemon's end: like end(), and no error where nothing is recorded.
    Result<void> finish();
    [[nodiscard]] service::RecorderStatus status() const;

private:
    Result<void> start(const std::filesystem::path& path, const drivers::DeviceInfo& device, const service::Config& config, int samples_fd,
                       bool from_oldest);

    std::string wanted_;   // emptied when it has begun
    std::filesystem::path path_;
    std::optional<replay::Recorder> recorder_;
};

}  // namespace fovea
