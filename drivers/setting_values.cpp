#include "drivers/setting_values.hpp"

#include <charconv>
#include <cmath>
#include <sstream>

namespace fovea::drivers {

const std::string* SettingValues::find(const char* key) const {
    const auto it = settings_.values.find(key);
    return it == settings_.values.end() ? nullptr : &it->second;
}

void SettingValues::fail_on(const char* key, const std::string& value, const std::string& legal) {
    if (failure_)
        failure_ = fail(std::string("source.") + key + " is '" + value + "'", settings_.where_is(key), "legal: " + legal);
}

std::string SettingValues::text(const char* key, const std::string& fallback) {
    const std::string* v = find(key);
    return v == nullptr ? fallback : *v;
}

double SettingValues::number(const char* key, double fallback, double least, double most) {
    const std::string* v = find(key);
    if (v == nullptr) return fallback;
    double value = 0;
    const auto [end, error] = std::from_chars(v->data(), v->data() + v->size(), value);
    if (error == std::errc{} && end == v->data() + v->size() && value >= least && value <= most) return value;
    std::ostringstream legal;
    legal << "a number from " << least << " to " << most;
    fail_on(key, *v, legal.str());
    return fallback;
}

std::int64_t SettingValues::integer(const char* key, std::int64_t fallback, std::int64_t least, std::int64_t most) {
    const std::string* v = find(key);
    if (v == nullptr) return fallback;
    const bool hex = v->starts_with("0x") || v->starts_with("0X");
    const char* begin = v->data() + (hex ? 2 : 0);
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(begin, v->data() + v->size(), value, hex ? 16 : 10);
    if (error == std::errc{} && end == v->data() + v->size() && value >= least && value <= most) return value;
    fail_on(key, *v, "an integer from " + std::to_string(least) + " to " + std::to_string(most));
    return fallback;
}

bool SettingValues::flag(const char* key, bool fallback) {
    const std::string* v = find(key);
    if (v == nullptr) return fallback;
    if (*v == "true") return true;
    if (*v == "false") return false;
    fail_on(key, *v, "true, false");
    return fallback;
}

std::string SettingValues::choice(const char* key, const std::string& fallback, const std::string& legal) {
    const std::string* v = find(key);
    if (v == nullptr) return fallback;
    std::istringstream words(legal);
    for (std::string word; words >> word;)
        if (word == *v) return *v;
    fail_on(key, *v, legal);
    return fallback;
}

}  // namespace fovea::drivers
