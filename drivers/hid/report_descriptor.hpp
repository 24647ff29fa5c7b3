// A HID report descriptor, parsed: which bits of which report mean what.
//
// Source: Device Class Definition for HID 1.11, sections 5 and 6.2.2. Where the text is open, as Linux 6.1 does it
// (drivers/hid/hid-core.c): a logical maximum is unsigned when the minimum is not negative, a unit exponent of 8 to 15
// is a negative nibble, a short usage takes the usage page in force at its main item.
// Input: the bytes as the kernel hands them out (hidraw: HIDIOCGRDESC, or the sysfs file report_descriptor).
// Output: fields in the order of the descriptor. Nothing about eye trackers is assumed here.
// Cost: linear in the bytes; memory is bounded by the k limits below whatever the bytes say.
// Threads: pure. Errors: a descriptor that breaks a rule or a limit, with the byte where it does.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocol/error.hpp"

namespace fovea::drivers::hid {

inline constexpr std::size_t kMaxDescriptorBytes = 4096;     // HID_MAX_DESCRIPTOR_SIZE of Linux
inline constexpr std::size_t kMaxFields = 1024;
inline constexpr std::size_t kMaxCollections = 256;
inline constexpr std::size_t kMaxCollectionDepth = 32;
inline constexpr std::size_t kMaxPushDepth = 16;
inline constexpr std::uint32_t kMaxFieldBits = 256;          // as Linux
inline constexpr std::uint32_t kMaxReportBits = 16384 * 8;   // HID_MAX_BUFFER_SIZE of Linux
inline constexpr int kMaxUnitExponent = 20;

enum class ReportKind : std::uint8_t { input = 0, output = 1, feature = 2 };
[[nodiscard]] const char* to_string(ReportKind kind) noexcept;

struct Usage {
    std::uint16_t page = 0, id = 0;
    bool operator==(const Usage&) const = default;
};

struct Collection {
    std::uint8_t type = 0;   // 0 physical, 1 application, 2 logical, 3 report, 4 named array, 5 usage switch, 6 modifier
    Usage usage;
    int parent = -1;         // index into ReportDescriptor::collections, -1 at the top
};

// So many usages in a row, for the arrays: `first` to `last` on one page.
struct UsageSpan {
    Usage first;
    std::uint16_t last = 0;
    bool operator==(const UsageSpan&) const = default;
};

// `count` elements of `bit_size` bits that share one usage (variable), or that each hold the index of one of the usages
// of `span_count` spans from ReportDescriptor::array_usages[first_span] on (array; `usage` and `usage_last` are its ends).
struct Field {
    ReportKind kind = ReportKind::input;
    std::uint8_t report_id = 0;     // 0: the descriptor has no report ids
    int collection = -1;            // the innermost
    Usage usage, usage_last;
    std::uint32_t first_span = 0, span_count = 0;
    bool constant = false, array = false, relative = false, null_state = false;
    std::uint32_t bit_offset = 0;   // from the first bit after the report id byte
    std::uint32_t bit_size = 0;     // 1 to kMaxFieldBits
    std::uint32_t count = 0;        // at least 1
    std::int64_t logical_min = 0, logical_max = 0;
    std::int64_t physical_min = 0, physical_max = 0;   // both 0: the same as the logical range
    int unit_exponent = 0;          // power of ten
    std::uint32_t unit = 0;         // nibbles: system, length, mass, time, ...
};

struct Report {
    ReportKind kind = ReportKind::input;
    std::uint8_t id = 0;
    std::uint32_t bits = 0;         // without the id byte
    [[nodiscard]] std::size_t bytes() const noexcept { return (bits + 7) / 8; }
};

struct ReportDescriptor {
    std::vector<Collection> collections;
    std::vector<Field> fields;
    std::vector<Report> reports;
    std::vector<UsageSpan> array_usages;   // at most kMaxDescriptorBytes: each took a byte of the descriptor
    bool has_report_ids = false;

    [[nodiscard]] const Report* find_report(ReportKind kind, std::uint8_t id) const noexcept;
    // True when `collection` is `ancestor` or lies within it.
    [[nodiscard]] bool within(int collection, int ancestor) const noexcept;
};

[[nodiscard]] Result<ReportDescriptor> parse_report_descriptor(std::span<const std::uint8_t> bytes);

// The raw value of one element, sign-extended when the logical minimum is negative. `payload` starts after the report
// id. Nothing when the payload ends before the element does or the element is wider than 64 bits.
[[nodiscard]] std::optional<std::int64_t> raw_value(const Field& field, std::span<const std::uint8_t> payload,
                                                    std::uint32_t element = 0) noexcept;
// False for a value that the field declares impossible (outside its logical range): the device says "no value" so.
// Fields without a range, and fields wider than 32 bits whose range the descriptor cannot spell, accept everything.
[[nodiscard]] bool in_logical_range(const Field& field, std::int64_t raw) noexcept;
// The usage that one element of an array selects: the logical minimum selects the array's first usage, and so on. Nothing
// where the value is outside the logical range (nothing is selected) or beyond the usages, and for other fields.
[[nodiscard]] std::optional<Usage> selected_usage(const ReportDescriptor& descriptor, const Field& field,
                                                  std::span<const std::uint8_t> payload, std::uint32_t element) noexcept;
// Whether the array can select `usage` at all.
[[nodiscard]] bool can_select(const ReportDescriptor& descriptor, const Field& field, Usage usage) noexcept;
// Puts a raw value in; the counterpart of raw_value(). False when it does not fit.
bool put_raw_value(const Field& field, std::span<std::uint8_t> payload, std::int64_t raw,
                   std::uint32_t element = 0) noexcept;

enum class Quantity : std::uint8_t { none, length, angle, time, frequency, other };
// What the unit measures, and the factor that takes a physical value to metres, radians, seconds or hertz.
struct UnitMeaning {
    Quantity quantity = Quantity::none;
    double to_si = 1;
};
[[nodiscard]] UnitMeaning unit_meaning(std::uint32_t unit, int unit_exponent) noexcept;
// Raw value to physical value, before the unit's factor.
[[nodiscard]] double physical_value(const Field& field, std::int64_t raw) noexcept;

// The descriptor in words, for `fovea devices --dump`.
[[nodiscard]] std::string describe(const ReportDescriptor& descriptor);

}  // namespace fovea::drivers::hid
