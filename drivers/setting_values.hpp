// Typed values from a driver's settings, with range checks; used by each driver's create().
//
// Errors: a value that is no number or out of range, with file, line and the legal range.
// Threads: pure.
#pragma once

#include <cstdint>
#include <string>

#include "drivers/device.hpp"

namespace fovea::drivers {

// Reads keys one by one and keeps the first error; ask for it with failure() when all are read.
class SettingValues {
public:
    explicit SettingValues(const DeviceSettings& settings) : settings_{settings} {}

    [[nodiscard]] std::string text(const char* key, const std::string& fallback);
    // [least, most]
    [[nodiscard]] double number(const char* key, double fallback, double least, double most);
    // Decimal, or hexadecimal after 0x; [least, most]
    [[nodiscard]] std::int64_t integer(const char* key, std::int64_t fallback, std::int64_t least, std::int64_t most);
    [[nodiscard]] bool flag(const char* key, bool fallback);
    // One of the words of `legal`, which are separated by spaces.
    [[nodiscard]] std::string choice(const char* key, const std::string& fallback, const std::string& legal);

    [[nodiscard]] Result<void> failure() const { return failure_; }

private:
    [[nodiscard]] const std::string* find(const char* key) const;
    void fail_on(const char* key, const std::string& value, const std::string& legal);

    const DeviceSettings& settings_;
    Result<void> failure_;
};

}  // namespace fovea::drivers
