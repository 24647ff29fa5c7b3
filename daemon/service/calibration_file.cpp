#include "daemon/service/calibration_file.hpp"

#include <algorithm>
#include <fstream>
#include <sstream>

#include <fmt/format.h>

#include <toml++/toml.h>

namespace fovea::service {
namespace {

constexpr std::array<const char*, kEyeCount> kNames = {"combined", "left", "right"};
constexpr const char* kWayOut = "calibrate again with `fovea calibrate`, or leave pipeline.calibration empty";

}  // namespace

Result<EyeCalibrations> parse_calibrations(const std::string& text, const std::string& where) {
    toml::table root;
    try {
        root = toml::parse(text);
    } catch (const toml::parse_error& e) {
        return fail(fmt::format("this is no calibration file: {}", e.description()), fmt::format("{}:{}:{}", where, e.source().begin.line, e.source().begin.column), kWayOut);
    }
    const toml::table* eyes = root["calibration"].as_table();
    if (eyes == nullptr || eyes->empty()) return fail("there is no calibration in the file", where, kWayOut);
    EyeCalibrations found;
    for (const auto& [key, node] : *eyes) {
        const std::string name{key.str()};
        const auto which = std::find(kNames.begin(), kNames.end(), name);
        if (which == kNames.end())
            return fail(fmt::format("there is no eye '{}'", name), fmt::format("{}:{}:{}", where, key.source().begin.line, key.source().begin.column), "legal: combined, left, right");
        auto calibration = pipeline::Calibration::from_toml(text, name, where);
        if (!calibration) return std::unexpected(calibration.error());
        found[static_cast<std::size_t>(which - kNames.begin())] = *calibration;
    }
    return found;
}

Result<EyeCalibrations> load_calibrations(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    std::error_code none;
    if (!in || std::filesystem::is_directory(file, none)) return fail("cannot read the calibration", file.string(), kWayOut);
    std::ostringstream text;
    text << in.rdbuf();
    return parse_calibrations(text.str(), file.string());
}

Result<pipeline::Pipeline> create_pipeline(const pipeline::PipelineSettings& settings, const std::string& file) {
    auto made = pipeline::Pipeline::create(settings);
    if (!made || file.empty()) return made;
    const auto eyes = load_calibrations(file);
    if (!eyes) return std::unexpected(eyes.error());
    for (std::size_t i = 0; i < kEyeCount; ++i)
        if ((*eyes)[i]) made->set_calibration(static_cast<Eye>(i), *(*eyes)[i]);
    return made;
}

}  // namespace fovea::service
