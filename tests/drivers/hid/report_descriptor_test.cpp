#include "drivers/hid/report_descriptor.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <random>

#include "drivers/hid/eye_tracker.hpp"
#include "tests/allocation/allocation_count.hpp"
#include "tests/drivers/hid/descriptor_shapes.hpp"

using namespace fovea;
using namespace fovea::drivers::hid;
using fovea::tests::DescriptorBuilder;

namespace {

std::string error_of(const std::vector<std::uint8_t>& bytes) {
    const auto r = parse_report_descriptor(bytes);
    return r ? "" : r.error().message();
}

DescriptorBuilder tracker() {
    DescriptorBuilder b;
    b.page(0x12).begin(0x01, 1);
    return b;
}

std::vector<std::uint8_t> from_hex(const std::string& path) {
    std::ifstream in(path);
    std::vector<std::uint8_t> bytes;
    for (std::string line; std::getline(in, line);) {
        if (line.empty() || line[0] == '#') continue;
        for (std::size_t i = 0; i + 1 < line.size(); i += 2)
            bytes.push_back(static_cast<std::uint8_t>(std::stoi(line.substr(i, 2), nullptr, 16)));
    }
    return bytes;
}

}  // namespace

TEST(ReportDescriptor, PlacesEachFieldAtItsBit) {
    const auto d = parse_report_descriptor(tests::shape("packed").descriptor).value();
    EXPECT_FALSE(d.has_report_ids);
    std::vector<std::uint32_t> offsets, sizes;
    for (const Field& f : d.fields) {
        offsets.push_back(f.bit_offset);
        sizes.push_back(f.bit_size);
    }
    EXPECT_EQ(offsets, (std::vector<std::uint32_t>{0, 3, 19, 46, 73, 90, 107, 124, 141, 158, 175}));
    EXPECT_EQ(sizes, (std::vector<std::uint32_t>{3, 16, 27, 27, 17, 17, 17, 17, 17, 17, 5}));
    EXPECT_EQ(d.find_report(ReportKind::input, 0)->bytes(), 23u);
    EXPECT_EQ(d.fields[1].unit_exponent, -3);
    EXPECT_EQ(d.fields[10].unit_exponent, -3) << "pop brings the globals back";
    EXPECT_TRUE(d.fields[4].null_state);
}

TEST(ReportDescriptor, CountsBitsPerReportIdAndKind) {
    const auto d = parse_report_descriptor(tests::shape("classic").descriptor).value();
    EXPECT_EQ(d.find_report(ReportKind::input, 0x10)->bytes(), 8u + 8 * 4 + 3 * 4);
    EXPECT_EQ(d.find_report(ReportKind::feature, 0x11)->bytes(), 21u);
    EXPECT_EQ(d.find_report(ReportKind::feature, 0x12)->bytes(), 12u);
    EXPECT_EQ(d.find_report(ReportKind::feature, 0x14)->bytes(), 1u);
    EXPECT_EQ(d.find_report(ReportKind::input, 0x11), nullptr);
}

TEST(ReportDescriptor, ReadsTheMaximumUnsignedUnlessTheMinimumIsNegative) {
    auto b = tracker();
    b << 0x15 << 0x00 << 0x25 << 0xFF;   // logical 0 to 255, in one byte each
    b.usage(0x21).size(8, 1).input();
    b << 0x15 << 0x81 << 0x25 << 0x7F;   // -127 to 127
    b.usage(0x22).size(8, 1).input().end();
    const auto d = parse_report_descriptor(b.bytes).value();
    EXPECT_EQ(d.fields[0].logical_max, 255);
    EXPECT_EQ(d.fields[1].logical_min, -127);
    const std::uint8_t report[] = {0xFE, 0xFE};
    EXPECT_EQ(raw_value(d.fields[0], report), 254);
    EXPECT_EQ(raw_value(d.fields[1], report), -2);
}

TEST(ReportDescriptor, TakesTheUsagePageInForceAtTheMainItem) {
    DescriptorBuilder b;
    b.page(0x0D).usage(0x01).page(0x12) << 0xA1 << 0x01;   // the page changes between usage and collection
    b << 0x0B << 0x21 << 0x00 << 0x12 << 0x00;             // a usage of four bytes brings its own page
    b.page(0x0D).logical(0, 1).size(8, 1).input().end();
    const auto d = parse_report_descriptor(b.bytes).value();
    EXPECT_EQ(d.collections[0].usage, (Usage{0x12, 0x01}));
    EXPECT_EQ(d.fields[0].usage, (Usage{0x12, 0x21}));
}

TEST(ReportDescriptor, GivesLeftOverElementsTheLastUsage) {
    auto b = tracker();
    b.usage(0x21).usage(0x22).logical(0, 100).size(7, 5).input().end();
    const auto d = parse_report_descriptor(b.bytes).value();
    ASSERT_EQ(d.fields.size(), 2u);
    EXPECT_EQ(d.fields[1].count, 4u);
    EXPECT_EQ(d.fields[1].usage.id, 0x22);
    std::vector<std::uint8_t> payload(5, 0);
    ASSERT_TRUE(put_raw_value(d.fields[1], payload, 93, 3));
    EXPECT_EQ(raw_value(d.fields[1], payload, 3), 93);
    EXPECT_EQ(raw_value(d.fields[1], payload, 2), 0);
    EXPECT_EQ(raw_value(d.fields[1], payload, 4), std::nullopt);
    EXPECT_FALSE(put_raw_value(d.fields[1], payload, 128, 3));
}

TEST(ReportDescriptor, KeepsArraysAsOneFieldWithItsUsages) {
    auto b = tracker();
    b.usages(0x10, 0x14).logical(1, 5).size(4, 3).input(0).end();
    const auto d = parse_report_descriptor(b.bytes).value();
    ASSERT_EQ(d.fields.size(), 1u);
    EXPECT_TRUE(d.fields[0].array);
    EXPECT_EQ(d.fields[0].usage.id, 0x10);
    EXPECT_EQ(d.fields[0].usage_last.id, 0x14);
    EXPECT_EQ(d.fields[0].count, 3u);
}

TEST(ReportDescriptor, DecodesWhatAnArraySelects) {
    auto b = tracker();
    b.usages(0x24, 0x26).usage(0x30).usages(0x41, 0x42).logical(-1, 20).size(8, 4).input(0).end();
    const auto d = parse_report_descriptor(b.bytes).value();
    const Field& f = d.fields.at(0);
    const std::uint8_t payload[] = {0xFF, 2, 4, 19};
    EXPECT_EQ(selected_usage(d, f, payload, 0), (Usage{0x12, 0x24})) << "the logical minimum is the first";
    EXPECT_EQ(selected_usage(d, f, payload, 1), (Usage{0x12, 0x30})) << "usages need not be neighbours";
    EXPECT_EQ(selected_usage(d, f, payload, 2), (Usage{0x12, 0x42}));
    EXPECT_EQ(selected_usage(d, f, payload, 3), std::nullopt) << "beyond the last usage";
    EXPECT_EQ(selected_usage(d, f, payload, 4), std::nullopt);
    const std::uint8_t outside[] = {21, 0xFE, 0, 0};
    EXPECT_EQ(selected_usage(d, f, outside, 0), std::nullopt) << "outside the logical range: nothing is selected";
    EXPECT_EQ(selected_usage(d, f, outside, 1), std::nullopt);
    EXPECT_TRUE(can_select(d, f, {0x12, 0x25}) && can_select(d, f, {0x12, 0x41}));
    EXPECT_FALSE(can_select(d, f, {0x12, 0x27}) || can_select(d, f, {0x01, 0x25}));
}

TEST(ReportDescriptor, TakesThePreferredUsageOfADelimitedSetAndPassesOverLongItems) {
    auto b = tracker();
    b << 0xFE << 0x03 << 0x77 << 1 << 2 << 3;
    b << 0xA9 << 0x01;
    b.usage(0x21).usage(0x22) << 0xA9 << 0x00;
    b.usage(0x23).logical(0, 1).size(8, 2).input().end();
    const auto d = parse_report_descriptor(b.bytes).value();
    ASSERT_EQ(d.fields.size(), 2u);
    EXPECT_EQ(d.fields[0].usage.id, 0x21);
    EXPECT_EQ(d.fields[1].usage.id, 0x23);
}

TEST(ReportDescriptor, UnderstandsUnits) {
    EXPECT_NEAR(unit_meaning(0x11, -4).to_si, 1e-6, 1e-20);
    EXPECT_EQ(unit_meaning(0x11, -4).quantity, Quantity::length);
    EXPECT_NEAR(unit_meaning(0x13, 0).to_si, 0.0254, 1e-15);
    EXPECT_NEAR(unit_meaning(0x14, -2).to_si, 0.01 * 0.017453292519943295, 1e-15);
    EXPECT_EQ(unit_meaning(0x12, 0).quantity, Quantity::angle);
    EXPECT_EQ(unit_meaning(0x1001, -6).quantity, Quantity::time);
    EXPECT_EQ(unit_meaning(0xF001, 0).quantity, Quantity::frequency);
    EXPECT_EQ(unit_meaning(0x10011, 0).quantity, Quantity::other);   // temperature besides
    EXPECT_EQ(unit_meaning(0xE011, 0).quantity, Quantity::other);    // acceleration
    EXPECT_EQ(unit_meaning(0, 3).quantity, Quantity::none);
}

TEST(ReportDescriptor, SaysWhatIsWrongAndWhere) {
    const struct {
        std::vector<std::uint8_t> bytes;
        const char* says;
    } cases[] = {
        {{}, "is empty"},
        {std::vector<std::uint8_t>(4097, 0xC0), "more than the 4096"},
        {{0x05, 0x12, 0x09, 0x01, 0xA1, 0x01}, "ends inside a collection"},
        {{0xC0}, "byte 0: an end of collection without"},
        {{0x05, 0x12, 0x27, 0x01}, "byte 2: an item that reaches past the end"},
        {{0xFE, 0x10, 0x00}, "reaches past the end"},
        {{0xFE}, "a long item without its size"},
        {{0xB4}, "a pop without a push"},
        {std::vector<std::uint8_t>(17, 0xA4), "byte 16: more than 16 pushes"},
        {{0x0C}, "reserved type"},
        {{0x85, 0x00}, "a report id of 0"},
        {{0x86, 0x00, 0x01}, "a report id of 256"},
        {{0x75, 0x08, 0x95, 0x01, 0x81, 0x03, 0x85, 0x01}, "a report id after fields that have none"},
        {{0x76, 0x01, 0x01, 0x95, 0x01, 0x81, 0x03}, "a report size of 257"},
        {{0x75, 0xFF, 0x97, 0xFF, 0xFF, 0xFF, 0xFF, 0x81, 0x03}, "longer than 16384 bytes"},
        {{0x55, 0x40}, "a unit exponent of 64"},
        {{0x15, 0x05, 0x25, 0x01, 0x75, 0x08, 0x95, 0x01, 0x81, 0x02}, "minimum of 5 above the maximum of 1"},
        {{0x29, 0x05, 0x19, 0x07}, "a usage maximum below its minimum"},
        {{0x19, 0x05, 0x81, 0x02}, "a usage minimum without its maximum"},
        {{0xA9, 0x01, 0x81, 0x02}, "inside a delimiter"},
        {{0xA9, 0x00}, "delimiters that do not pair up"},
        {{0x19, 0x00, 0x2A, 0xFF, 0xFF, 0x75, 0x01, 0x96, 0xFF, 0xFF, 0x81, 0x02}, "more than 1024 fields"},
    };
    for (const auto& c : cases) EXPECT_THAT(error_of(c.bytes), testing::HasSubstr(c.says));
    auto deep = tracker();
    for (int i = 0; i < 40; ++i) deep.begin(0x10, 2);
    EXPECT_THAT(error_of(deep.bytes), testing::HasSubstr("nested deeper than 32"));
    DescriptorBuilder many;
    for (int i = 0; i < 300; ++i) many.begin(0x10, 2).end();
    EXPECT_THAT(error_of(many.bytes), testing::HasSubstr("more than 256 collections"));
}

TEST(ReportDescriptor, IsPrintedInWords) {
    const std::string text = describe(parse_report_descriptor(tests::shape("classic").descriptor).value());
    for (const char* part : {"Eye Tracker (application collection)", "input report 0x10, 52 bytes after the id",
                             "Sensor Timestamp", "1e-06 s each", "Left Eye Position (physical collection)",
                             "Position Z, -2000000 to 2000000, 1e-06 m each", "Device Mode Request", "Sampling Frequency"})
        EXPECT_THAT(text, testing::HasSubstr(part));
}

TEST(ReportDescriptor, OfTheLabsTrackerIsReadAsTheKernelShowedIt) {
    const auto bytes = from_hex(FOVEA_SOURCE_DIR "/tests/data/devices/minimal_tracker.hex");
    const auto d = parse_report_descriptor(bytes).value();
    EXPECT_EQ(d.find_report(ReportKind::input, 1)->bytes(), 16u);
    EXPECT_EQ(d.find_report(ReportKind::feature, 2)->bytes(), 8u);
}

TEST(RawValue, IsWhatWasPutAtEveryBitOffsetAndWidth) {
    std::mt19937_64 rng(5);
    for (std::uint32_t bits = 1; bits <= 64; ++bits)
        for (std::uint32_t offset = 0; offset < 16; ++offset) {
            Field f;
            f.bit_offset = offset;
            f.bit_size = bits;
            f.count = 1;
            f.logical_min = rng() % 2 == 0 ? -1 : 0;
            std::vector<std::uint8_t> payload((offset + bits + 7) / 8, static_cast<std::uint8_t>(rng()));
            const auto before = payload;
            auto value = static_cast<std::int64_t>(rng());
            if (bits < 64) {
                const auto masked = static_cast<std::uint64_t>(value) & ((std::uint64_t{1} << bits) - 1);
                value = static_cast<std::int64_t>(masked);
                if (f.logical_min < 0 && (masked >> (bits - 1)) != 0)
                    value = static_cast<std::int64_t>(masked | ~std::uint64_t{0} << bits);
            }
            ASSERT_TRUE(put_raw_value(f, payload, value)) << bits;
            ASSERT_EQ(raw_value(f, payload), value) << bits << " bits at " << offset;
            for (std::uint32_t b = 0; b < offset; ++b)
                ASSERT_EQ((payload[b / 8] ^ before[b / 8]) >> (b % 8) & 1, 0) << "a neighbour's bit was changed";
            ASSERT_EQ(raw_value(f, std::span(payload).first(payload.size() - 1)), std::nullopt);
        }
}

// A third are plain noise, a third are made of legal items, a third are real descriptors with a few bytes changed.
TEST(ReportDescriptor, SurvivesAMillionRandomDescriptorsInBoundedMemory) {
    std::mt19937_64 rng(20240607);
    const auto& shapes = tests::shapes();
    std::vector<std::uint8_t> bytes, report;
    std::size_t parsed = 0, trackers = 0, most = 0;
    constexpr std::uint8_t kItems[] = {0x04, 0x08, 0x14, 0x18, 0x24, 0x28, 0x34, 0x44, 0x54, 0x64, 0x74, 0x80, 0x84,
                                       0x90, 0x94, 0xA0, 0xA4, 0xA8, 0xB0, 0xB4, 0xC0};
    for (int i = 0; i < 1'000'000; ++i) {
        bytes.clear();
        switch (i % 3) {
            case 0:
                for (std::size_t n = rng() % 64; n > 0; --n) bytes.push_back(static_cast<std::uint8_t>(rng()));
                break;
            case 1:
                for (std::size_t n = rng() % 40; n > 0; --n) {
                    const std::size_t size = rng() % 4;
                    bytes.push_back(static_cast<std::uint8_t>(kItems[rng() % std::size(kItems)] | size));
                    for (std::size_t k = size == 3 ? 4 : size; k > 0; --k)
                        bytes.push_back(rng() % 3 == 0 ? static_cast<std::uint8_t>(rng())
                                                       : static_cast<std::uint8_t>(rng() % 0x30));
                }
                break;
            default:
                bytes = shapes[rng() % shapes.size()].descriptor;
                for (std::size_t n = rng() % 4; n > 0; --n) bytes[rng() % bytes.size()] = static_cast<std::uint8_t>(rng());
                break;
        }
        const std::size_t before = test::allocated_bytes();
        const auto d = parse_report_descriptor(bytes);
        most = std::max(most, test::allocated_bytes() - before);
        if (!d) {
            ASSERT_FALSE(d.error().what.empty());
            continue;
        }
        ++parsed;
        ASSERT_LE(d->fields.size(), kMaxFields);
        if (i % 64 == 2) {
            ASSERT_LT(describe(*d).size(), 1u << 20);
        }
        auto t = EyeTracker::create(bytes);
        if (!t) continue;
        ++trackers;
        ASSERT_LE(t->max_input_bytes(), kMaxReportBits / 8 + 1);
        GazeSample s;
        bool has_time = false;
        for (std::size_t size : {t->max_input_bytes(), std::size_t{rng() % 80}}) {
            report.resize(size);
            for (auto& byte : report) byte = static_cast<std::uint8_t>(rng());
            if (!report.empty() && rng() % 2 == 0) report[0] = 0x10;
            if (t->decode(report, s, has_time) != Decoded::sample) continue;
            for (const EyeState& e : s.eyes)
                ASSERT_TRUE(std::abs(std::hypot(e.gaze_dir_head.x, e.gaze_dir_head.y, e.gaze_dir_head.z) - 1) < 1e-9);
        }
        for (const auto& f : t->features_to_read()) {
            report.assign(std::min<std::size_t>(f.bytes, 64), 0xFF);
            report[0] = f.id;
            t->take_feature(report);
        }
        (void)t->mode_request();
    }
    EXPECT_GT(parsed, 100'000u);
    EXPECT_GT(trackers, 50'000u);
    EXPECT_LT(most, 1u << 20) << "bytes allocated for one descriptor";
}
