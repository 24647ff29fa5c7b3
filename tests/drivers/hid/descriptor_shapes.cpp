#include "tests/drivers/hid/descriptor_shapes.hpp"

#include <cmath>
#include <cstdlib>

#include "drivers/hid/usages.hpp"

namespace fovea::tests {

using namespace fovea::drivers::hid;

namespace {

constexpr int kPhysical = 0, kApplication = 1, kLogical = 2;
constexpr std::uint32_t kCentimetre = 0x11, kInch = 0x13, kSecond = 0x1001, kHertz = 0xF001;

void features(DescriptorBuilder& b, int first_id, bool screen_in_device) {
    b.begin(0x11, kLogical).id(first_id);
    b.usage(0x100).logical(0, 3).unit(0, 0).size(8, 1).feature();
    b.usage(0x101).usage(0x102).usage(0x103).usage(0x104).usage(0x105);
    b.logical(0, 0x7FFFFFFF).unit(kCentimetre, -4).size(32, 5).feature().end();
    if (screen_in_device) {
        b.begin(0x12, kLogical).id(first_id + 1);
        b.usage(0x200).usage(0x201).logical(0, 65535).unit(0, 0).size(16, 2).feature();
        b.usage(0x204).usage(0x205).logical(0, 0x7FFFFFFF).unit(kCentimetre, -4).size(32, 2).feature().end();
    }
    b.begin(0x13, kLogical).id(first_id + 2);
    b.usage(0x301).logical(0, 4).unit(0, 0).size(8, 1).feature();
    b.usage(0x300).logical(0, 65535).unit(kHertz, 0).size(16, 1).feature().end();
    b.begin(0x14, kLogical).id(first_id + 3);
    b.usage(0x400).logical(0, 7).unit(0, 0).size(8, 1).feature().end();
}

void point(DescriptorBuilder& b, int usage_id, int axes, int bits) {
    b.begin(usage_id, kPhysical);
    b.usages(0x21, 0x20 + axes).size(bits, axes).input().end();
}

std::vector<std::uint8_t> classic() {
    DescriptorBuilder b;
    b.page(0x12).begin(0x01, kApplication);
    b.begin(0x10, kLogical).id(0x10);
    b.usage(0x20).logical(0, 0x7FFFFFFF).unit(kSecond, -6).size(64, 1).input();
    b.logical(-2'000'000, 2'000'000).unit(kCentimetre, -4);
    point(b, 0x24, 2, 32);
    point(b, 0x25, 3, 32);
    point(b, 0x26, 3, 32);
    b.begin(0x27, kPhysical).usages(0x21, 0x23).size(32, 3).input(3).end();   // head: constant, as the first devices
    b.end();
    features(b, 0x11, true);
    return b.end().bytes;
}

std::vector<std::uint8_t> packed() {
    DescriptorBuilder b;
    b.page(0x12).begin(0x01, kApplication).begin(0x10, kLogical);
    b.usage(0).logical(0, 1).size(3, 1).input(3);                     // padding: everything after it is off the byte grid
    b.usage(0x20).logical(0, 65535).unit(kSecond, -3).size(16, 1).input();
    b.push().logical(-4'000'000, 4'000'000).unit(kCentimetre, -3);    // 10 micrometres
    point(b, 0x24, 2, 27);
    b.begin(0x25, kPhysical).usage(0x21).usage(0x22).usage(0x23).logical(-60'000, 60'000).unit(kCentimetre, -2);
    b.size(17, 3).input(0x42).end();
    b.begin(0x26, kPhysical).usage(0x21).usage(0x22).usage(0x23).size(17, 3).input(0x42).end();
    b.pop().size(5, 1).input(3);
    return b.end().end().bytes;
}

std::vector<std::uint8_t> ratio() {
    DescriptorBuilder b;
    b.page(0x0D).begin(0x04, kApplication).id(9).usage(0x42).logical(0, 1).size(8, 1).input().end();   // a touch screen
    b.page(0x12).begin(0x01, kApplication).begin(0x10, kLogical).id(1);
    b.usage(0x20).logical(0, -1).unit(kSecond, -4).size(32, 1).input();
    b.logical(0, 65535).unit(0, 0);
    point(b, 0x24, 2, 16);
    b.logical(-32768, 32767).unit(kCentimetre, -2);
    point(b, 0x27, 3, 16);
    b.end();
    features(b, 2, true);
    return b.end().bytes;
}

std::vector<std::uint8_t> inches() {
    DescriptorBuilder b;
    b.page(0x12).begin(0x01, kApplication).begin(0x10, kLogical).id(0x20);
    b.size(8, 1).input(3);
    b.begin(0x24, kPhysical);
    b.logical(0, 20000).physical(0, 20).unit(kInch, 0).usages(0x21, 0x22).size(16, 2).input().end();
    b.size(8, 2).input(3).end();
    return b.end().bytes;
}

double step_si(const Field& f) {
    const UnitMeaning u = unit_meaning(f.unit, f.unit_exponent);
    return (physical_value(f, f.logical_min + 1) - physical_value(f, f.logical_min)) * u.to_si;
}

std::int64_t quantise(const Field& f, double si) {
    const UnitMeaning u = unit_meaning(f.unit, f.unit_exponent);
    if (u.quantity == Quantity::none) return std::llround(si * static_cast<double>(f.logical_max - f.logical_min));
    const double base = physical_value(f, f.logical_min) * u.to_si;
    return f.logical_min + std::llround((si - base) / step_si(f));
}

}  // namespace

DescriptorBuilder& DescriptorBuilder::item(std::uint8_t prefix, std::int64_t value, int size) {
    if (size == 0) size = value >= 0 && value <= 0xFF ? 1 : value >= 0 && value <= 0xFFFF ? 2 : 4;
    bytes.push_back(static_cast<std::uint8_t>(prefix | (size == 4 ? 3 : size)));
    for (int i = 0; i < size; ++i) bytes.push_back(static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >> (8 * i)));
    return *this;
}

const std::vector<Shape>& shapes() {
    static const std::vector<Shape> all = {
        {"classic", "64-bit microseconds, 32-bit micrometres, all feature reports", classic(), false},
        {"packed", "no report ids, odd bit offsets, a 16-bit millisecond counter", packed(), true},
        {"ratio", "gaze as a share of the screen, a touch screen beside the tracker", ratio(), false},
        {"inches", "physical ranges in inches, no timestamp, no eye positions", inches(), true},
    };
    return all;
}

const Shape& shape(const std::string& name) {
    for (const Shape& s : shapes())
        if (name == s.name) return s;
    std::abort();
}

std::vector<std::uint8_t> encode_tracking(const ReportDescriptor& d, const Truth& t) {
    const Field* gaze = nullptr;
    for (const Field& f : d.fields)
        if (f.collection >= 0 && d.collections[static_cast<std::size_t>(f.collection)].usage == Usage{0x12, 0x24}) gaze = &f;
    const Report* r = d.find_report(ReportKind::input, gaze->report_id);
    const std::size_t head = d.has_report_ids ? 1 : 0;
    std::vector<std::uint8_t> bytes(r->bytes() + head, 0);
    if (head != 0) bytes[0] = gaze->report_id;
    const std::span<std::uint8_t> payload(bytes.data() + head, bytes.size() - head);
    for (const Field& f : d.fields) {
        if (f.kind != ReportKind::input || f.report_id != gaze->report_id || f.constant) continue;
        if (f.usage.id == usage::kSensorTimestamp) {
            const double ticks = std::floor(t.time_s / unit_meaning(f.unit, f.unit_exponent).to_si + 0.5);
            auto raw = static_cast<std::uint64_t>(ticks);
            if (f.bit_size < 64) raw &= (std::uint64_t{1} << f.bit_size) - 1;
            put_raw_value(f, payload, static_cast<std::int64_t>(raw));
            continue;
        }
        if (f.usage.id < usage::kPositionX || f.usage.id > usage::kPositionZ) continue;
        const int axis = f.usage.id - usage::kPositionX;
        const std::uint16_t what = d.collections[static_cast<std::size_t>(f.collection)].usage.id;
        double value = 0;
        if (what == usage::kGazePoint) {
            value = axis == 0 ? t.gaze_x : axis == 1 ? t.gaze_y : 0;
            if (unit_meaning(f.unit, 0).quantity == Quantity::none) value /= axis == 0 ? kScreenWidth : kScreenHeight;
        } else if (what == usage::kLeftEyePosition) {
            value = t.left[axis];
        } else if (what == usage::kRightEyePosition) {
            value = t.right[axis];
        } else {
            value = (t.left[axis] + t.right[axis]) / 2;
        }
        put_raw_value(f, payload, !t.eyes_seen ? 0 : quantise(f, value));
    }
    return bytes;
}

std::vector<std::uint8_t> encode_feature(const ReportDescriptor& d, std::uint8_t id, double sampling_hz) {
    const Report* r = d.find_report(ReportKind::feature, id);
    if (r == nullptr) return {};
    std::vector<std::uint8_t> bytes(r->bytes() + 1, 0);
    bytes[0] = id;
    const std::span<std::uint8_t> payload(bytes.data() + 1, bytes.size() - 1);
    for (const Field& f : d.fields) {
        if (f.kind != ReportKind::feature || f.report_id != id) continue;
        switch (f.usage.id) {
            case usage::kTrackerQuality: put_raw_value(f, payload, 1); break;
            case usage::kMinDistance: put_raw_value(f, payload, quantise(f, 0.4)); break;
            case usage::kOptimumDistance: put_raw_value(f, payload, quantise(f, 0.65)); break;
            case usage::kMaxDistance: put_raw_value(f, payload, quantise(f, 0.9)); break;
            case usage::kMaxScreenWidth: put_raw_value(f, payload, quantise(f, 0.7)); break;
            case usage::kMaxScreenHeight: put_raw_value(f, payload, quantise(f, 0.4)); break;
            case usage::kScreenWidth: put_raw_value(f, payload, quantise(f, kScreenWidth)); break;
            case usage::kScreenHeight: put_raw_value(f, payload, quantise(f, kScreenHeight)); break;
            case usage::kSamplingFrequency: put_raw_value(f, payload, std::llround(sampling_hz)); break;
            case usage::kConfigurationStatus: put_raw_value(f, payload, 1); break;
            default: break;
        }
    }
    return bytes;
}

}  // namespace fovea::tests
