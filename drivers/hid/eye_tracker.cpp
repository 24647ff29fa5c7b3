#include "drivers/hid/eye_tracker.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "drivers/hid/usages.hpp"

namespace fovea::drivers::hid {

namespace {

struct Point {
    double x = 0, y = 0, z = 0;
};

// A field and the line that takes its raw value to SI units, worked out once: unit exponents are powers of ten, and
// those are too dear for every sample. A field is null where the device has none; fields belong to the descriptor.
struct Axis {
    const Field* field = nullptr;
    double scale = 0, offset = 0;
    bool known = false;   // the line can be drawn: there is a unit, a quirk or a screen size
    // Where its bits lie in eight of the report's bytes, for fields that lie in such (nearly all); see Window.
    bool in_window = false, is_signed = false;
    unsigned up = 0, down = 0;   // shifts that take the bits to the top and then down to the bottom
    std::size_t first_byte = 0;
    std::int64_t low = 0, high = 0;   // raw values beyond these are "no value"
};

// Eight bytes of a payload of `bytes` that hold the whole field; nothing where there are none.
struct Window {
    std::size_t first_byte;
    unsigned shift;
};
std::optional<Window> window_of(const Field& f, std::size_t bytes) noexcept {
    const std::uint64_t end = std::uint64_t{f.bit_offset} + f.bit_size;
    if (std::endian::native != std::endian::little || f.bit_size == 0 || f.bit_size > 64 || bytes < 8 || end > bytes * 8) return std::nullopt;
    const std::size_t first = std::min<std::size_t>(f.bit_offset / 8, bytes - 8);
    const auto shift = static_cast<unsigned>(f.bit_offset - 8 * first);
    if (shift + f.bit_size > 64) return std::nullopt;
    return Window{first, shift};
}

// Three axes that form a point or a rotation.
struct Triple {
    Axis x, y, z;
    [[nodiscard]] bool complete() const noexcept { return x.known && y.known && z.known; }
};

// The value of a 64-bit or shorter counter, counted on over wraps.
class WrappingCounter {
public:
    explicit WrappingCounter(std::uint32_t bits = 64) noexcept : bits_{bits} {}
    std::int64_t extend(std::int64_t raw) noexcept {
        if (bits_ >= 64) return raw;
        const std::uint64_t mask = (std::uint64_t{1} << bits_) - 1;
        if (!started_) {
            total_ = static_cast<std::int64_t>(static_cast<std::uint64_t>(raw) & mask);
            started_ = true;
            return total_;
        }
        // The nearest value with these low bits: forward over a wrap, or a little back for a report out of order.
        const std::uint64_t forward = (static_cast<std::uint64_t>(raw) - static_cast<std::uint64_t>(total_)) & mask;
        const bool back = forward > mask / 2;
        total_ = static_cast<std::int64_t>(static_cast<std::uint64_t>(total_) + forward - (back ? mask + 1 : 0));
        return total_;
    }

private:
    std::uint32_t bits_;
    std::int64_t total_ = 0;
    bool started_ = false;
};

// Exact for whole-nanosecond units; nothing when the time does not fit 64 bits of nanoseconds.
std::int64_t whole_tick_ns(double unit_s) noexcept {
    const double unit_ns = unit_s * 1e9;
    const double whole = std::nearbyint(unit_ns);
    return whole >= 1 && whole <= 1e9 && std::abs(unit_ns - whole) < 1e-6 * whole ? static_cast<std::int64_t>(whole) : 0;
}
std::optional<DeviceTime> to_device_time(std::int64_t ticks, std::int64_t tick_ns, double unit_s) noexcept {
    if (tick_ns > 0) {
        std::int64_t ns = 0;
        if (__builtin_mul_overflow(ticks, tick_ns, &ns)) return std::nullopt;
        return DeviceTime{ns};
    }
    const double unit_ns = unit_s * 1e9;
    const long double ns = static_cast<long double>(ticks) * static_cast<long double>(unit_ns);
    if (!(std::abs(ns) < 9.2e18L)) return std::nullopt;
    return DeviceTime{static_cast<std::int64_t>(std::nearbyint(ns))};
}

Direction<HeadFrame> ray(Point from, Point to, bool& ok) noexcept {
    // The screen's y points down and z towards the user; HeadFrame's y up and its +z backwards, which is the same way.
    const Vec3<HeadFrame> v{to.x - from.x, from.y - to.y, to.z - from.z};
    const double squared = dot(v, v);
    ok = v.z < 0 && squared > 1e-280;
    if (ok && squared < 1e280) [[likely]] {   // as Direction::from(), where no square overflows
        const double n = std::sqrt(squared);
        return {v.x / n, v.y / n, v.z / n};
    }
    const auto d = ok ? Direction<HeadFrame>::from(v) : std::nullopt;
    ok = d.has_value() && d->z < 0;
    return ok ? *d : Direction<HeadFrame>{};
}

}  // namespace

struct EyeTracker::State {
    ReportDescriptor descriptor;
    Quirks quirks;
    ScreenSettings settings;
    Capabilities capabilities;
    std::vector<FeatureReport> features;

    int tracker = -1;                  // the Eye Tracker application collection
    std::uint8_t gaze_report = 0, status_report = 0;
    bool has_status_report = false;
    Triple gaze, left_eye, right_eye, head, head_rotation;
    const Field *timestamp = nullptr, *status = nullptr, *present = nullptr;
    const Report *gaze_format = nullptr, *status_format = nullptr;
    WrappingCounter counter;
    double width_m = 0, height_m = 0;  // of the screen; 0: not known
    bool flips = false;                // a quirk turns an axis round
    std::int64_t tick_ns = 0;          // of the timestamp, where that is a whole number; else 0

    // The nearest enclosing collection's usage on the tracker's page that is one of the table's (0: none).
    [[nodiscard]] std::uint16_t enclosing(int collection, std::uint16_t first, std::uint16_t last) const noexcept {
        for (int c = collection; c >= 0; c = descriptor.collections[static_cast<std::size_t>(c)].parent) {
            const Usage u = descriptor.collections[static_cast<std::size_t>(c)].usage;
            if (u.page == kEyeTrackerPage && u.id >= first && u.id <= last) return u.id;
        }
        return 0;
    }

    [[nodiscard]] Triple* triple_for(std::uint16_t point) noexcept {
        switch (point) {
            case usage::kGazePoint: return &gaze;
            case usage::kLeftEyePosition: return &left_eye;
            case usage::kRightEyePosition: return &right_eye;
            case usage::kHeadPosition: return &head;
            case usage::kHeadDirection: return &head_rotation;
            default: return nullptr;
        }
    }

    void find_fields() {
        for (const Field& f : descriptor.fields) {
            if (f.constant || f.bit_size > 64 || !descriptor.within(f.collection, tracker)) continue;
            if (f.array && f.kind == ReportKind::input && present == nullptr)
                for (std::uint16_t point = usage::kGazePoint; point <= usage::kHeadPosition; ++point)
                    if (can_select(descriptor, f, {kEyeTrackerPage, point})) present = &f;
            if (f.array || f.usage.page != kEyeTrackerPage) continue;
            const std::uint16_t id = f.usage.id;
            if (f.kind == ReportKind::input) {
                if (id >= usage::kPositionX && id <= usage::kPositionZ) {
                    if (Triple* t = triple_for(enclosing(f.collection, usage::kGazePoint, usage::kHeadPosition))) {
                        const Field*& slot = id == usage::kPositionX   ? t->x.field
                                             : id == usage::kPositionY ? t->y.field
                                                                       : t->z.field;
                        if (slot == nullptr) slot = &f;
                    }
                } else if (id >= usage::kRotationX && id <= usage::kRotationZ) {
                    const Field*& slot = id == usage::kRotationX   ? head_rotation.x.field
                                         : id == usage::kRotationY ? head_rotation.y.field
                                                                   : head_rotation.z.field;
                    if (slot == nullptr) slot = &f;
                } else if (id == usage::kSensorTimestamp && timestamp == nullptr) {
                    timestamp = &f;
                } else if (id == usage::kConfigurationStatus && status == nullptr) {
                    status = &f;
                }
            }
        }
        // Parts that travel in another report than the gaze would mix two moments: they are not used.
        if (gaze.x.field == nullptr) return;
        const std::uint8_t id = gaze.x.field->report_id;
        const auto drop_foreign = [&](const Field*& f) {
            if (f != nullptr && f->report_id != id) f = nullptr;
        };
        for (Triple* t : {&gaze, &left_eye, &right_eye, &head, &head_rotation}) {
            drop_foreign(t->x.field);
            drop_foreign(t->y.field);
            drop_foreign(t->z.field);
        }
        drop_foreign(timestamp);
        drop_foreign(present);
        if (status != nullptr && status->report_id == id) has_status_report = false;
        else has_status_report = status != nullptr;
    }

    // `screen_m`: what the whole logical range spans when the field names no unit (0: unknown).
    void draw_line(Axis& axis, Quantity quantity, double screen_m) const noexcept {
        axis.known = false;
        if (axis.field == nullptr) return;
        const Field& f = *axis.field;
        const UnitMeaning unit = unit_meaning(f.unit, f.unit_exponent);
        if (quantity == Quantity::length && quirks.length_unit_m) {
            axis.scale = *quirks.length_unit_m;
            axis.offset = 0;
        } else if (unit.quantity == quantity) {
            const bool bent = (f.physical_min != 0 || f.physical_max != 0) && f.logical_max > f.logical_min;
            axis.scale = (bent ? (static_cast<double>(f.physical_max) - static_cast<double>(f.physical_min)) /
                                     static_cast<double>(f.logical_max - f.logical_min)
                               : 1.0) * unit.to_si;
            axis.offset = bent ? static_cast<double>(f.physical_min) * unit.to_si - static_cast<double>(f.logical_min) * axis.scale : 0;
        } else if (screen_m > 0 && f.logical_max > f.logical_min) {
            axis.scale = screen_m / static_cast<double>(f.logical_max - f.logical_min);
            axis.offset = -static_cast<double>(f.logical_min) * axis.scale;
        } else {
            return;
        }
        axis.known = true;
        const auto window = gaze_format != nullptr ? window_of(f, gaze_format->bytes()) : std::nullopt;
        axis.in_window = window.has_value();
        if (!window) return;
        axis.first_byte = window->first_byte;
        axis.up = 64 - window->shift - f.bit_size;
        axis.down = 64 - f.bit_size;
        axis.is_signed = f.logical_min < 0;
        const bool any = quirks.ignore_logical_range || f.bit_size > 32 || (f.logical_min == 0 && f.logical_max == 0);
        axis.low = any ? std::numeric_limits<std::int64_t>::min() : f.logical_min;
        axis.high = any ? std::numeric_limits<std::int64_t>::max() : f.logical_max;
    }

    void draw_lines() noexcept {
        draw_line(gaze.x, Quantity::length, width_m);
        draw_line(gaze.y, Quantity::length, height_m);
        draw_line(gaze.z, Quantity::length, 0);
        for (Triple* t : {&left_eye, &right_eye, &head})
            for (Axis* a : {&t->x, &t->y, &t->z}) draw_line(*a, Quantity::length, 0);
        for (Axis* a : {&head_rotation.x, &head_rotation.y, &head_rotation.z}) draw_line(*a, Quantity::angle, 0);
    }

    // False where the device says "no value"; `zero` tells whether the raw value was 0.
    bool read(const Axis& axis, std::span<const std::uint8_t> payload, double& value, bool& zero) const noexcept {
        if (!axis.known) return false;
        if (axis.in_window) [[likely]] {
            std::uint64_t bits = 0;
            std::memcpy(&bits, payload.data() + axis.first_byte, 8);
            bits <<= axis.up;
            const std::int64_t here = axis.is_signed ? static_cast<std::int64_t>(bits) >> axis.down : static_cast<std::int64_t>(bits >> axis.down);
            if (here < axis.low || here > axis.high) return false;
            zero = here == 0;
            value = static_cast<double>(here) * axis.scale + axis.offset;
            return true;
        }
        const auto raw = raw_value(*axis.field, payload);
        if (!raw || (!quirks.ignore_logical_range && !in_logical_range(*axis.field, *raw))) return false;
        zero = *raw == 0;
        value = static_cast<double>(*raw) * axis.scale + axis.offset;
        return true;
    }

    Point turned(Point p) const noexcept {
        if (!flips) [[likely]] return p;
        if (quirks.flip_x) p.x = width_m - p.x;
        if (quirks.flip_y) p.y = height_m - p.y;
        if (quirks.flip_z) p.z = -p.z;
        return p;
    }

    // False for a point that the report's list of what is there can name and does not.
    [[gnu::noinline]] bool named(std::uint16_t point, std::span<const std::uint8_t> payload) const noexcept {
        const Usage wanted{kEyeTrackerPage, point};
        if (!can_select(descriptor, *present, wanted)) return true;
        for (std::uint32_t i = 0; i < present->count; ++i)
            if (selected_usage(descriptor, *present, payload, i) == wanted) return true;
        return false;
    }

    bool listed(std::uint16_t point, std::span<const std::uint8_t> payload) const noexcept { return present == nullptr || named(point, payload); }

    // What a triple's fields say; a field that is not known or says nothing is not ok.
    struct Taken {
        std::array<double, 3> value{};
        std::array<bool, 3> ok{}, zero{};
    };
    void take(const Triple& t, std::span<const std::uint8_t> payload, Taken& taken) const noexcept {
        const std::array<const Axis*, 3> axes = {&t.x, &t.y, &t.z};
        for (std::size_t i = 0; i < 3; ++i) taken.ok[i] = read(*axes[i], payload, taken.value[i], taken.zero[i]);
    }
    // A position in space needs all three coordinates; (0, 0, 0) lies on the glass and means "not seen".
    [[nodiscard]] std::optional<Point> position(const Taken& t) const noexcept {
        if (!t.ok[0] || !t.ok[1] || !t.ok[2] || (t.zero[0] && t.zero[1] && t.zero[2])) return std::nullopt;
        return turned({t.value[0], t.value[1], t.value[2]});
    }
    [[gnu::noinline]] std::optional<Point> head_position(std::span<const std::uint8_t> payload) const noexcept {
        if (!listed(usage::kHeadPosition, payload)) return std::nullopt;
        Taken t;
        take(head, payload, t);
        return position(t);
    }

    [[gnu::noinline]] void decode_head(std::span<const std::uint8_t> payload, GazeSample& out) const noexcept {
        double ax = 0, ay = 0, az = 0;
        bool zero = false;
        if (!read(head_rotation.x, payload, ax, zero) || !read(head_rotation.y, payload, ay, zero) ||
            !read(head_rotation.z, payload, az, zero))
            return;
        // Device axes to ours: y and z change sign with the turn of the y axis about x (x right, y down, z to the user).
        const double hx = ax / 2, hy = -ay / 2, hz = -az / 2;
        const double cx = std::cos(hx), sx = std::sin(hx), cy = std::cos(hy), sy = std::sin(hy), cz = std::cos(hz),
                     sz = std::sin(hz);
        // Turns about x, then y, then z, all about fixed axes.
        out.head.world_from_head = {cz * cy * cx + sz * sy * sx, cz * cy * sx - sz * sy * cx,
                                    cz * sy * cx + sz * cy * sx, sz * cy * cx - cz * sy * sx};
        out.head.valid = true;
    }

    void decode_gaze(std::span<const std::uint8_t> payload, GazeSample& out) const noexcept {
        for (EyeState& e : out.eyes) e = {};
        if (!listed(usage::kGazePoint, payload)) return;
        // In loops, so that the code for one field and for one ray is there once (EyeLine::update() says why).
        const std::array<const Triple*, 3> triples = {&gaze, &left_eye, &right_eye};
        std::array<Taken, 3> taken;
        for (std::size_t i = 0; i < 3; ++i) take(*triples[i], payload, taken[i]);
        const Taken& point = taken[0];
        if (!point.ok[0] || !point.ok[1] || (gaze.z.known && !point.ok[2])) return;
        const Point target = turned({point.value[0], point.value[1], point.value[2]});
        std::optional<Point> left, right;
        if (listed(usage::kLeftEyePosition, payload)) left = position(taken[1]);
        if (listed(usage::kRightEyePosition, payload)) right = position(taken[2]);
        const bool has_eyes = left_eye.x.field != nullptr || right_eye.x.field != nullptr;
        if (!left && !right && (has_eyes || (point.zero[0] && point.zero[1]))) return;

        Point origin;
        if (left && right)
            origin = {(left->x + right->x) / 2, (left->y + right->y) / 2, (left->z + right->z) / 2};
        else if (left || right)
            origin = left ? *left : *right;
        else
            origin = head_position(payload).value_or(Point{width_m / 2, height_m / 2, settings.viewing_distance_m});
        const std::array<const Point*, kEyeCount> from = {&origin, left ? &*left : nullptr, right ? &*right : nullptr};   // by Eye
        for (std::size_t i = 0; i < kEyeCount; ++i)
            if (from[i] != nullptr) out.eyes[i].gaze_dir_head = ray(*from[i], target, out.eyes[i].valid);
    }

    void set_screen() noexcept {
        const auto pick = [](double a, double b, const std::optional<double>& c, double d) {
            if (a > 0) return a;
            if (b > 0) return b;
            if (c && *c > 0) return *c;
            return d > 0 ? d : 0.0;
        };
        const Capabilities& k = capabilities;
        width_m = pick(settings.width_m, k.screen_width_m, quirks.screen_width_m, k.max_screen_width_m);
        height_m = pick(settings.height_m, k.screen_height_m, quirks.screen_height_m, k.max_screen_height_m);
        draw_lines();
    }

    // One field of a feature or status report, by its usage.
    [[gnu::noinline]] void take_field(const Field& f, std::span<const std::uint8_t> payload) noexcept {
        const auto raw = raw_value(f, payload);
        if (!raw || f.constant || f.array || f.usage.page != kEyeTrackerPage) return;
        const UnitMeaning unit = unit_meaning(f.unit, f.unit_exponent);
        const double length = physical_value(f, *raw) * (quirks.length_unit_m ? *quirks.length_unit_m : unit.to_si);
        const bool is_length = quirks.length_unit_m || unit.quantity == Quantity::length;
        Capabilities& k = capabilities;
        const auto put_length = [&](double& slot) {
            if (is_length && length > 0 && length < 1000) slot = length;
        };
        switch (f.usage.id) {
            case usage::kTrackerQuality: k.quality = static_cast<double>(*raw); break;
            case usage::kMinDistance: put_length(k.min_distance_m); break;
            case usage::kOptimumDistance: put_length(k.optimum_distance_m); break;
            case usage::kMaxDistance: put_length(k.max_distance_m); break;
            case usage::kMaxScreenWidth: put_length(k.max_screen_width_m); break;
            case usage::kMaxScreenHeight: put_length(k.max_screen_height_m); break;
            case usage::kScreenWidth: put_length(k.screen_width_m); break;
            case usage::kScreenHeight: put_length(k.screen_height_m); break;
            case usage::kSamplingFrequency: {
                const double hz = physical_value(f, *raw) * unit.to_si;
                if (hz > 0 && hz <= 100000) k.sampling_hz = hz;
                break;
            }
            case usage::kConfigurationStatus:
                k.status = *raw >= 1 && *raw <= 4 ? static_cast<ConfigurationStatus>(*raw) : ConfigurationStatus::unknown;
                break;
            default: break;
        }
    }

    [[gnu::noinline]] void take_report(ReportKind kind, std::uint8_t id, std::span<const std::uint8_t> payload) noexcept {
        for (const Field& f : descriptor.fields)
            if (f.kind == kind && f.report_id == id && descriptor.within(f.collection, tracker)) take_field(f, payload);
    }
};

const char* to_string(ConfigurationStatus status) noexcept {
    switch (status) {
        case ConfigurationStatus::unknown: return "not told";
        case ConfigurationStatus::ready: return "ready";
        case ConfigurationStatus::configuring: return "configuring";
        case ConfigurationStatus::screen_setup_needed: return "screen setup needed";
        case ConfigurationStatus::user_calibration_needed: return "user calibration needed";
    }
    return "not told";
}

Result<EyeTracker> EyeTracker::create(std::span<const std::uint8_t> report_descriptor, const Quirks& quirks,
                                      const ScreenSettings& screen) {
    auto parsed = parse_report_descriptor(report_descriptor);
    if (!parsed) return std::unexpected(parsed.error());
    auto s = std::make_unique<State>();
    s->descriptor = std::move(*parsed);
    s->quirks = quirks;
    s->flips = quirks.flip_x || quirks.flip_y || quirks.flip_z;
    s->settings = screen;
    const ReportDescriptor& d = s->descriptor;
    for (std::size_t c = 0; c < d.collections.size() && s->tracker < 0; ++c)
        if (d.collections[c].usage == Usage{kEyeTrackerPage, usage::kEyeTracker} && d.collections[c].type == 1)
            s->tracker = static_cast<int>(c);
    if (s->tracker < 0)
        return fail("the report descriptor has no Eye Tracker collection (usage page 0x12, usage 0x01)", {},
                    "`fovea devices --dump` prints it in words");
    s->find_fields();
    if (s->gaze.x.field == nullptr || s->gaze.y.field == nullptr)
        return fail("the eye tracker's reports carry no gaze point (usage 0x12:0x24 with positions X and Y)", {},
                    "`fovea devices --dump` prints its report descriptor in words");

    s->gaze_report = s->gaze.x.field->report_id;
    s->gaze_format = d.find_report(ReportKind::input, s->gaze_report);
    if (s->has_status_report) {
        s->status_report = s->status->report_id;
        s->status_format = d.find_report(ReportKind::input, s->status_report);
    }
    Capabilities& k = s->capabilities;
    k.gaze = true;
    k.eye_positions = s->left_eye.x.field != nullptr || s->right_eye.x.field != nullptr;
    k.head_position = s->head.x.field != nullptr;
    k.head_rotation = s->head_rotation.x.field != nullptr;
    if (quirks.sampling_hz) k.sampling_hz = *quirks.sampling_hz;
    if (s->timestamp != nullptr) {
        const Field& t = *s->timestamp;
        const UnitMeaning unit = unit_meaning(t.unit, t.unit_exponent);
        k.timestamp = true;
        k.timestamp_unit_s = quirks.timestamp_unit_s ? *quirks.timestamp_unit_s : unit.to_si;
        if (!quirks.timestamp_unit_s && unit.quantity != Quantity::time) {
            k.timestamp_unit_s = 1e-6;
            k.timestamp_unit_assumed = true;
        }
        s->tick_ns = whole_tick_ns(k.timestamp_unit_s);
        s->counter = WrappingCounter(t.bit_size);
    }
    for (const Report& r : d.reports) {
        if (r.kind != ReportKind::feature || quirks.no_features) continue;
        for (const Field& f : d.fields)
            if (f.kind == r.kind && f.report_id == r.id && !f.constant && f.usage.page == kEyeTrackerPage &&
                f.usage.id >= usage::kTrackerQuality && f.usage.id < usage::kModeRequest &&
                d.within(f.collection, s->tracker)) {
                s->features.push_back({r.id, r.bytes() + 1});
                break;
            }
    }
    s->set_screen();
    return EyeTracker(std::move(s));
}

EyeTracker::EyeTracker(std::unique_ptr<State> state) noexcept : state_{std::move(state)} {}
EyeTracker::EyeTracker(EyeTracker&&) noexcept = default;
EyeTracker& EyeTracker::operator=(EyeTracker&&) noexcept = default;
EyeTracker::~EyeTracker() = default;

const std::vector<EyeTracker::FeatureReport>& EyeTracker::features_to_read() const noexcept { return state_->features; }
const Capabilities& EyeTracker::capabilities() const noexcept { return state_->capabilities; }
const ReportDescriptor& EyeTracker::descriptor() const noexcept { return state_->descriptor; }

std::size_t EyeTracker::max_input_bytes() const noexcept {
    std::size_t most = 0;
    for (const Report& r : state_->descriptor.reports)
        if (r.kind == ReportKind::input) most = std::max(most, r.bytes());
    return most + (state_->descriptor.has_report_ids ? 1 : 0);
}

void EyeTracker::take_feature(std::span<const std::uint8_t> report) noexcept {
    if (report.empty()) return;
    state_->take_report(ReportKind::feature, report[0], report.subspan(1));
    state_->set_screen();
}

Result<void> EyeTracker::check_geometry() const {
    const State& s = *state_;
    if (s.width_m > 0 && s.height_m > 0) return {};
    const bool metric = s.quirks.length_unit_m ||
                        unit_meaning(s.gaze.x.field->unit, s.gaze.x.field->unit_exponent).quantity == Quantity::length;
    if (!metric)
        return fail("the gaze point has no unit of length and the device tells no screen size", {},
                    "set screen_width_m and screen_height_m under [source]");
    if (!s.capabilities.eye_positions && !s.capabilities.head_position)
        return fail("the device tells neither where the eyes are nor how large the screen is", {},
                    "set screen_width_m and screen_height_m (and viewing_distance_m) under [source]");
    return {};
}

std::vector<std::uint8_t> EyeTracker::mode_request() const {
    const State& s = *state_;
    if (!s.quirks.start_report.empty()) return s.quirks.start_report;
    if (s.quirks.no_features) return {};
    for (const Field& f : s.descriptor.fields) {
        if (f.kind != ReportKind::feature || f.constant || f.usage != Usage{kEyeTrackerPage, usage::kModeRequest}) continue;
        if (!s.descriptor.within(f.collection, s.tracker)) continue;
        const Report* r = s.descriptor.find_report(f.kind, f.report_id);
        std::vector<std::uint8_t> bytes(1 + (r ? r->bytes() : 0), 0);
        bytes[0] = f.report_id;
        const std::span<std::uint8_t> payload(bytes.data() + 1, bytes.size() - 1);
        // One field with a bit per mode, or as many one-bit fields: gaze, eye position, head position.
        if (f.bit_size >= 3) {
            if (!put_raw_value(f, payload, 7)) return {};
        } else {
            for (std::uint32_t i = 0; i < f.count && i < 3; ++i) put_raw_value(f, payload, 1, i);
        }
        return bytes;
    }
    return {};
}

void EyeTracker::rehearse(std::span<const std::uint8_t> report, GazeSample& scratch) noexcept {
    const WrappingCounter counter = state_->counter;
    const Capabilities capabilities = state_->capabilities;   // a report may hold the status
    bool has_device_time = false;
    static_cast<void>(decode(report, scratch, has_device_time));
    state_->counter = counter;
    state_->capabilities = capabilities;
}

// One piece of code, as EyeLine::update() is.
[[gnu::flatten]] Decoded EyeTracker::decode(std::span<const std::uint8_t> report, GazeSample& out, bool& has_device_time) noexcept {
    State& s = *state_;
    has_device_time = false;
    std::uint8_t id = 0;
    auto payload = report;
    if (s.descriptor.has_report_ids) {
        if (report.empty()) return Decoded::malformed;
        id = report[0];
        payload = report.subspan(1);
    }
    if (s.has_status_report && id == s.status_report && id != s.gaze_report) {
        if (payload.size() != s.status_format->bytes()) return Decoded::malformed;
        s.take_report(ReportKind::input, id, payload);
        return Decoded::status;
    }
    if (id != s.gaze_report) return Decoded::foreign;
    if (payload.size() != s.gaze_format->bytes()) return Decoded::malformed;
    s.decode_gaze(payload, out);
    out.head = {};
    if (s.head_rotation.complete()) s.decode_head(payload, out);
    if (s.timestamp != nullptr)
        if (const auto raw = raw_value(*s.timestamp, payload))
            if (const auto t = to_device_time(s.counter.extend(*raw), s.tick_ns, s.capabilities.timestamp_unit_s)) {
                out.device_time = *t;
                has_device_time = true;
            }
    if (s.status != nullptr && !s.has_status_report) s.take_field(*s.status, payload);
    return Decoded::sample;
}

}  // namespace fovea::drivers::hid
