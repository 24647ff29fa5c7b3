#include "render/layer/auto_mode.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <mutex>
#include <numbers>
#include <string_view>

#include <fovea/fovea.h>
#include "render/density/fovea_size.hpp"
#include "render/layer/glsl_tokens.hpp"

namespace fovea::layer {
namespace {

constexpr const char* kNames[] = {"none", "gl_frag_coord", "texel_fetch", "no_source", "points", "lines", "blended_2d",
                                  "textured_2d", "full_screen_pass", "no_clear", "keeps_depth", "side_effects",
                                  "clears_only", "does_not_pay", "full_density", "cannot_match"};
static_assert(std::size(kNames) == static_cast<std::size_t>(FullRate::count));

std::vector<std::string> split(const std::string& text, char by) {
    std::vector<std::string> parts;
    std::size_t from = 0;
    while (from <= text.size()) {
        const std::size_t to = std::min(text.find(by, from), text.size());
        if (to > from) parts.push_back(text.substr(from, to - from));
        from = to + 1;
    }
    return parts;
}

std::optional<double> number(const std::string& text) {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
    return value;
}

// False: the value is out of range.
bool set_key(AutoSettings& s, const std::string& key, const std::string& value) {
    if (key == "except") {
        for (const std::string& name : split(value, ',')) {
            const auto reason = full_rate_by_name(name);
            if (!reason || *reason == FullRate::none || *reason >= FullRate::no_clear) return false;
            s.reasons &= ~(1u << static_cast<unsigned>(*reason));
        }
        return true;
    }
    const auto parts = split(value, ',');
    if (key == "focus") {
        const auto x = parts.size() == 2 ? number(parts[0]) : std::nullopt, y = parts.size() == 2 ? number(parts[1]) : std::nullopt;
        if (!x || !y || std::abs(*x) > 10 || std::abs(*y) > 10) return false;
        s.point.x_ndc = static_cast<float>(*x);
        s.point.y_ndc = static_cast<float>(*y);
        s.fixed = true;
        return true;
    }
    const auto v = number(value);
    if (!v || *v < 0 || *v > 1e6) return false;
    const auto f = static_cast<float>(*v);
    if (key == "gain_x") s.point.gain_x = f;
    else if (key == "gain_y") s.point.gain_y = f;
    else if (key == "area") s.point.fovea_area = f;
    else if (key == "fov_deg" && *v > 0 && *v < 180) s.fov_rad = *v * std::numbers::pi / 180;
    else if (key == "always") s.always = *v != 0;
    else if (key == "compare") s.compare = *v != 0;
    else if (key == "offscreen" && *v <= 1) s.offscreen_least = *v;
    else return false;
    return true;
}

}  // namespace

const char* full_rate_name(FullRate reason) noexcept { return kNames[static_cast<std::size_t>(reason)]; }

std::optional<FullRate> full_rate_by_name(const std::string& name) noexcept {
    const auto* found = std::find(std::begin(kNames), std::end(kNames), name);
    if (found == std::end(kNames)) return std::nullopt;
    return static_cast<FullRate>(found - std::begin(kNames));
}

std::optional<AutoSettings> parse_auto_settings(const std::string& text, std::string* error) {
    AutoSettings s;
    s.on = true;
    for (const std::string& part : split(text, ';')) {
        const std::size_t equals = part.find('=');
        if (equals == std::string::npos || !set_key(s, part.substr(0, equals), part.substr(equals + 1))) {
            if (error) *error = part;
            return std::nullopt;
        }
    }
    return s;
}

const AutoSettings& auto_settings() {
    static const AutoSettings settings = [] {
        const char* text = std::getenv("FOVEA_LAYER_AUTO");
        if (!text) return AutoSettings{};
        std::string wrong;
        if (auto read = parse_auto_settings(text, &wrong)) return *read;
        std::fprintf(stderr, "fovea layer: FOVEA_LAYER_AUTO: cannot read '%s'; the program runs without auto mode "
                             "(`fovea layer run --auto` writes this variable)\n", wrong.c_str());
        return AutoSettings{};
    }();
    return settings;
}

struct FocusSource::Report {
    fovea_view view;
    fovea_focal focal;
    fovea_latch_info latch;
    FocalPoint point;
    std::uint64_t frame = 0;
    bool latched = false;
};

FocusSource::~FocusSource() {
    fovea_disconnect(client_);
    delete report_;
}

Latched FocusSource::latch(int width, int height) {
    const AutoSettings& s = auto_settings();
    Latched latched{.points = {s.point}, .count = 1, .min_density = 0};
    if (s.fixed || (s.point.gain_x == 0 && s.point.gain_y == 0)) return latched;
    if (!tried_) {
        tried_ = true;
        fovea_connect_info info;
        FOVEA_INIT(&info);
        info.flags = FOVEA_CONNECT_WAIT;
        if (fovea_connect(&info, &client_) != FOVEA_OK)
            std::fprintf(stderr, "fovea layer: %s; the middle of the picture stays sharp\n", fovea_last_error(nullptr));
        report_ = new Report{};
    }
    if (!client_) return latched;
    const auto tan_x = static_cast<float>(std::tan(s.fov_rad / 2));
    const float tan_y = tan_x * static_cast<float>(height) / static_cast<float>(width);
    Report& r = *report_;
    FOVEA_INIT(&r.view);
    FOVEA_INIT(&r.focal);
    FOVEA_INIT(&r.latch);
    r.view.eye = FOVEA_EYE_COMBINED;
    r.view.tan_left = -tan_x, r.view.tan_right = tan_x, r.view.tan_up = tan_y, r.view.tan_down = -tan_y;
    r.view.head_from_view[0] = 1;
    if (fovea_latch(client_, fovea_now_ns() + interval_ns_, &r.view, 1, &r.focal, &r.latch) != FOVEA_OK) return latched;
    live_ = (r.latch.flags & FOVEA_LATCH_LIVE) != 0;
    // The uncertainty of the gaze widens the region of full density that the settings ask for.
    const float gain = std::max(s.point.gain_x, s.point.gain_y);
    const double base_ndc = std::sqrt(1.0 + static_cast<double>(s.point.fovea_area)) / static_cast<double>(gain);
    const density::FoveaSizeSettings size{.min_radius_rad = base_ndc / std::max(1e-6, static_cast<double>(r.focal.ndc_per_rad_x)),
                                          .gain = static_cast<double>(gain)};
    const FocalPoint sized = density::sized_focal_point(size, static_cast<double>(r.focal.x_ndc), static_cast<double>(r.focal.y_ndc),
                                                        static_cast<double>(r.focal.radius95_rad),
                                                        static_cast<double>(r.focal.ndc_per_rad_x), static_cast<double>(r.focal.ndc_per_rad_y));
    latched.points[0] = {sized.x_ndc, sized.y_ndc, s.point.gain_x, s.point.gain_y, std::max(s.point.fovea_area, sized.fovea_area)};
    r.point = latched.points[0];
    r.latched = true;
    return latched;
}

void FocusSource::frame_ended(std::uint64_t pixels_shaded, std::uint64_t pixels_full) {
    if (!client_) return;
    const std::int64_t now = fovea_now_ns();
    constexpr std::int64_t kLeast = 4'000'000, kMost = 100'000'000;  // 250 Hz to 10 Hz
    if (last_frame_ns_ != 0) interval_ns_ += (std::clamp(now - last_frame_ns_, kLeast, kMost) - interval_ns_) / 8;
    last_frame_ns_ = now;
    Report& r = *report_;
    if (!r.latched) return;
    r.latched = false;
    fovea_frame frame;
    FOVEA_INIT(&frame);
    frame.flags = FOVEA_FRAME_PHOTON_SIMULATED;
    frame.frame = ++r.frame;
    frame.submitted_ns = frame.gpu_done_ns = now;
    frame.photon_ns = std::max(now, r.latch.photon_ns);
    frame.pixels_shaded = pixels_shaded;
    frame.pixels_full = pixels_full;
    frame.view_count = 1;
    frame.views[0] = r.view;
    const float radius = std::sqrt(1.0f + std::max(0.0f, r.point.fovea_area));
    frame.foveas[0] = {r.point.x_ndc, r.point.y_ndc, r.point.gain_x > 0 ? radius / r.point.gain_x : 2.0f,
                       r.point.gain_y > 0 ? radius / r.point.gain_y : 2.0f};
    frame.latch = r.latch;
    (void)fovea_submit_frame(client_, &frame);  // a daemon that lags loses a report, not a frame
}

namespace {
struct Reports {
    std::mutex mutex;
    std::deque<ProgramReport> all;
};
Reports& reports() {
    static auto* instance = new Reports;  // exit handlers of the program may still draw
    return *instance;
}
}  // namespace

ProgramReport* new_program_report(std::string shader) {
    const std::lock_guard lock(reports().mutex);
    ProgramReport& r = reports().all.emplace_back();
    r.shader = std::move(shader);
    return &r;
}

std::string program_reports_json() {
    const std::lock_guard lock(reports().mutex);
    std::string out = "[";
    for (const ProgramReport& r : reports().all) {
        out += out.size() > 1 ? ",\n    " : "\n    ";
        std::string name;
        for (const char c : r.shader)
            if (c == '"' || c == '\\') name += std::string("\\") + c;
            else if (static_cast<unsigned char>(c) >= 32) name += c;
        out += "{\"shader\": \"" + name + "\", \"draws_foveated\": " + std::to_string(r.foveated.load()) + ", \"draws_full\": {";
        const char* comma = "";
        for (std::size_t i = 0; i < r.full.size(); ++i)
            if (const std::uint64_t n = r.full[i].load()) {
                out += std::string(comma) + "\"" + kNames[i] + "\": " + std::to_string(n);
                comma = ", ";
            }
        out += "}}";
    }
    return out + (out.size() > 1 ? "\n  ]" : "]");
}

SourceFacts source_facts(GLenum stage, const std::string& source) {
    SourceFacts facts;
    if (stage != GL_FRAGMENT_SHADER) return facts;
    facts.known = !source.empty();
    const auto tokens = tokenize(source);
    facts.frag_coord = reads_window_position(tokens);
    facts.texel_fetch = mentions(tokens, "texelFetch") || mentions(tokens, "texelFetchOffset");
    // The last thing a fragment shader does says most about it.
    for (std::size_t i = tokens.size(); i-- > 0;)
        if (tokens[i].is("gl_FragColor") || tokens[i].is("=")) {
            const std::size_t from = source.rfind('\n', tokens[i].begin), to = source.find('\n', tokens[i].begin);
            facts.shader = source.substr(from == std::string::npos ? 0 : from + 1, to == std::string::npos ? to : to - (from == std::string::npos ? 0 : from + 1));
            facts.shader.erase(0, facts.shader.find_first_not_of(" \t"));
            break;
        }
    if (facts.shader.size() > 60) facts.shader.resize(60);
    return facts;
}

SourceFacts read_source_facts(GLuint program) {
    GLint count = 0;
    gl.GetProgramiv(program, GL_ATTACHED_SHADERS, &count);
    std::vector<GLuint> shaders(static_cast<std::size_t>(std::max(count, 0)));
    if (count > 0) gl.GetAttachedShaders(program, count, nullptr, shaders.data());
    for (const GLuint shader : shaders) {
        GLint stage = 0, length = 0;
        gl.GetShaderiv(shader, GL_SHADER_TYPE, &stage);
        if (stage != GL_FRAGMENT_SHADER) continue;
        gl.GetShaderiv(shader, GL_SHADER_SOURCE_LENGTH, &length);
        std::string source(static_cast<std::size_t>(std::max(length, 1)), '\0');
        gl.GetShaderSource(shader, length, nullptr, source.data());
        source.resize(source.find('\0') == std::string::npos ? source.size() : source.find('\0'));
        return source_facts(GL_FRAGMENT_SHADER, source);
    }
    return {};
}

}  // namespace fovea::layer
