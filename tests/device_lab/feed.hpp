// What the lab's emulated devices say: a real gaze recording, one sample after the other, and a log of what was sent.
#pragma once

#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "protocol/gaze_sample.hpp"

namespace fovea::lab {

// Command line options as --name value; unknown ones end the program with a message.
class Arguments {
public:
    Arguments(int argc, char** argv, std::vector<std::string> known);
    [[nodiscard]] std::string text(const std::string& name, const std::string& fallback) const;
    [[nodiscard]] long number(const std::string& name, long fallback) const;

private:
    std::vector<std::pair<std::string, std::string>> given_;
};

struct FeedSample {
    std::int64_t time_us = 0;          // of the recording, from one second on; the device's clock
    Direction<HeadFrame> dir;
    bool valid = false;
};

// The recording at `rate_hz`: the sample nearest to each tick, so that values are the recording's own, none in between.
// Starts again from the beginning (with time going on) after the last.
class Feed {
public:
    Feed(const std::string& recording, double rate_hz);
    [[nodiscard]] FeedSample at(std::uint64_t index) const;
    [[nodiscard]] std::int64_t period_ns() const { return period_ns_; }

private:
    std::vector<FeedSample> samples_;
    std::int64_t period_ns_;
};

// The log, as a fovea-gaze-csv: device time, when it was handed to the kernel, direction.
class TruthLog {
public:
    explicit TruthLog(const std::string& path, double rate_hz);
    ~TruthLog();
    void add(const FeedSample& sample, Instant sent);

private:
    std::FILE* file_ = nullptr;
};

// Sleeps until `t`, or until `fd` (-1: none) can be read; true when it can.
bool wait_until(Instant t, int fd);
[[noreturn]] void die(const std::string& what);

}  // namespace fovea::lab
