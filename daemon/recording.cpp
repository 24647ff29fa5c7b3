#include "daemon/recording.hpp"

#include <spdlog/spdlog.h>

#include <utility>

#include "protocol/signals_blocked.hpp"

namespace fovea {
namespace {

// The first of path, path-2, path-3 ... that does not exist.
std::filesystem::path free_path(const std::filesystem::path& wanted) {
    std::filesystem::path path = wanted;
    std::error_code ignored;
    for (int n = 2; std::filesystem::exists(path, ignored); ++n) {
        path = wanted;
        path.replace_filename(wanted.stem().string() + "-" + std::to_string(n) + wanted.extension().string());
    }
    return path;
}

}  // namespace

Result<void> Recording::source_changed(const service::SourceStatus& source, const service::Config& config, int samples_fd) {
    if (!wanted_.empty() && !recorder_) {
        if (auto ok = start(std::exchange(wanted_, {}), source.device, config, samples_fd, true); !ok) return ok;
    }
    if (recorder_) recorder_->add_event({MonotonicClock::now(), std::string("source_") + to_string(source.state), source.error.message()});
    return {};
}

void Recording::config_changed(const service::Config& config) {
    if (recorder_) recorder_->add_event({MonotonicClock::now(), "config", service::print_config(config)});
}

Result<std::string> Recording::begin(const std::string& path, const service::SourceStatus& source, const service::Config& config,
                                     int samples_fd) {
    if (recorder_) return fail("a recording is under way", path_.string(), "end it first (fovea admin end-recording)");
    if (auto ok = start(path, source.device, config, samples_fd, false); !ok) return std::unexpected(ok.error());
    return path_.string();
}

Result<service::RecorderStatus> Recording::end() {
    if (!recorder_) return fail("nothing is being recorded", {}, "begin with fovea admin record FILE");
    const Result<replay::RecorderStatus> s = recorder_->stop();
    const service::RecorderStatus last = status();
    recorder_.reset();
    if (!s) return std::unexpected(s.error());
    spdlog::info("session {}: {} samples, {} frames recorded", last.path, last.samples, last.frames);
    if (last.lost_samples + last.lost_frames > 0)
        spdlog::warn("the session lacks {} samples and {} frames that came too fast", last.lost_samples, last.lost_frames);
    if (last.dropped_rows > 0) spdlog::warn("the session lacks {} rows: the disk was too slow or full", last.dropped_rows);
    return last;
}

Result<void> Recording::finish() {
    if (!recorder_) return {};
    if (auto ended = end(); !ended) return std::unexpected(ended.error());
    return {};
}

service::RecorderStatus Recording::status() const {
    if (!recorder_) return {};
    const replay::RecorderStatus s = recorder_->status();
    const std::optional<Error> error = recorder_->error();
    return {path_.string(), s.samples, s.frames, s.samples_lost, s.frames_lost, s.rows_dropped, error ? error->message() : ""};
}

Result<void> Recording::start(const std::filesystem::path& path, const drivers::DeviceInfo& device, const service::Config& config,
                              int samples_fd, bool from_oldest) {
    Result<SamplesReader> ring = SamplesReader::map(samples_fd);
    if (!ring) return std::unexpected(ring.error());
    std::error_code none;
    // A number is added to the name of a file only; a path that ends in a slash has no name.
    if (!path.has_filename() || (std::filesystem::exists(path, none) && !std::filesystem::is_regular_file(path, none)))
        return fail("this is no session file that could be written", path.string(), "name a file that does not exist yet, e.g. session.fovea");
    const std::filesystem::path free = free_path(path);
    replay::RecorderOptions options;
    options.info.device = device.name;
    options.info.source = device.location;
    options.info.nominal_rate_hz = device.nominal_rate_hz;
    options.meta = {{"driver", device.driver}, {"fovea_version", FOVEA_VERSION}, {"config", service::print_config(config)}};
    options.from_oldest = from_oldest;
    const SignalsBlocked for_its_threads;
    Result<replay::Recorder> recorder = replay::Recorder::start(free, std::move(*ring), options);
    if (!recorder) return std::unexpected(recorder.error());
    recorder_.emplace(std::move(*recorder));
    path_ = free;
    spdlog::info("recording to {}", path_.string());
    return {};
}

}  // namespace fovea
