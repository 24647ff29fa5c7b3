#include "drivers/hid/report_descriptor.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <numbers>

namespace fovea::drivers::hid {

namespace {

// An item's data, both ways, because only the main item settles which is meant.
struct ItemValue {
    std::uint32_t as_unsigned = 0;
    std::int32_t as_signed = 0;
};

struct GlobalState {
    std::uint16_t usage_page = 0;
    ItemValue logical_min, logical_max, physical_min, physical_max;
    int unit_exponent = 0;
    std::uint32_t unit = 0, report_size = 0, report_count = 0;
    std::uint8_t report_id = 0;
};

struct UsageRange {
    std::uint32_t first = 0, last = 0;   // page in the high half when `has_page`
    bool has_page = false;
};

struct LocalState {
    std::vector<UsageRange> usages;      // bounded: each takes at least one byte of the descriptor
    std::optional<UsageRange> minimum;
    std::optional<UsageRange> maximum;
    bool in_delimiter = false, delimiter_has_usage = false;
};

enum ItemType : std::uint8_t { kMain = 0, kGlobal = 1, kLocal = 2 };

Usage resolve(std::uint32_t value, bool has_page, std::uint16_t page) noexcept {
    return has_page ? Usage{static_cast<std::uint16_t>(value >> 16), static_cast<std::uint16_t>(value)}
                    : Usage{page, static_cast<std::uint16_t>(value)};
}

class Parser {
public:
    explicit Parser(std::span<const std::uint8_t> bytes) : bytes_{bytes} {
        for (auto& kind : report_index_) kind.fill(-1);
    }

    Result<ReportDescriptor> run() {
        if (bytes_.empty()) return fail("the report descriptor is empty");
        if (bytes_.size() > kMaxDescriptorBytes)
            return fail("the report descriptor has " + std::to_string(bytes_.size()) + " bytes, more than the " +
                        std::to_string(kMaxDescriptorBytes) + " that Linux allows");
        while (at_ < bytes_.size())
            if (auto step = item(); !step) return std::unexpected(step.error());
        if (!open_.empty()) return wrong("the descriptor ends inside a collection");
        if (local_.in_delimiter) return wrong("the descriptor ends inside a delimiter");
        return std::move(out_);
    }

private:
    std::unexpected<Error> wrong(std::string what) const {
        return fail(std::move(what), "report descriptor, byte " + std::to_string(item_at_));
    }

    Result<void> item() {
        item_at_ = at_;
        const std::uint8_t prefix = bytes_[at_++];
        if (prefix == 0xFE) {  // a long item: size, tag, data; none is defined, so it is passed over
            if (bytes_.size() - at_ < 2) return wrong("a long item without its size");
            const std::size_t size = std::size_t{bytes_[at_]} + 2;
            if (bytes_.size() - at_ < size) return wrong("a long item that reaches past the end");
            at_ += size;
            return {};
        }
        const std::size_t size = (prefix & 3) == 3 ? 4 : prefix & 3u;
        if (bytes_.size() - at_ < size) return wrong("an item that reaches past the end");
        ItemValue value;
        for (std::size_t i = 0; i < size; ++i) value.as_unsigned |= std::uint32_t{bytes_[at_ + i]} << (8 * i);
        at_ += size;
        const unsigned unused_bits = size == 0 ? 0 : 32 - 8 * static_cast<unsigned>(size);
        value.as_signed = static_cast<std::int32_t>(value.as_unsigned << unused_bits) >> unused_bits;
        const std::uint8_t tag = prefix >> 4;
        switch ((prefix >> 2) & 3) {
            case kMain: return main_item(tag, value);
            case kGlobal: return global_item(tag, value);
            case kLocal: return local_item(tag, value, size == 4);
            default: return wrong("an item of the reserved type");
        }
    }

    Result<void> main_item(std::uint8_t tag, ItemValue value) {
        if (local_.in_delimiter) return wrong("a main item inside a delimiter");
        if (local_.minimum || local_.maximum) return wrong("a usage minimum without its maximum, or the reverse");
        Result<void> result;
        switch (tag) {
            case 0x8: result = fields(ReportKind::input, value.as_unsigned); break;
            case 0x9: result = fields(ReportKind::output, value.as_unsigned); break;
            case 0xB: result = fields(ReportKind::feature, value.as_unsigned); break;
            case 0xA: result = begin_collection(value.as_unsigned); break;
            case 0xC:
                if (open_.empty()) return wrong("an end of collection without a collection");
                open_.pop_back();
                break;
            default: break;  // reserved main items carry no meaning
        }
        local_ = {};
        return result;
    }

    Result<void> begin_collection(std::uint32_t type) {
        if (open_.size() >= kMaxCollectionDepth) return wrong("collections nested deeper than 32");
        if (out_.collections.size() >= kMaxCollections) return wrong("more than 256 collections");
        Collection c;
        c.type = static_cast<std::uint8_t>(type);
        c.parent = open_.empty() ? -1 : open_.back();
        if (!local_.usages.empty())
            c.usage = resolve(local_.usages[0].first, local_.usages[0].has_page, global_.usage_page);
        open_.push_back(static_cast<int>(out_.collections.size()));
        out_.collections.push_back(c);
        return {};
    }

    Result<std::uint32_t*> report_bits(ReportKind kind) {
        auto& index = report_index_[static_cast<std::size_t>(kind)][global_.report_id];
        if (index < 0) {
            if (out_.has_report_ids && global_.report_id == 0) return wrong("fields without a report id");
            index = static_cast<int>(out_.reports.size());
            out_.reports.push_back({kind, global_.report_id, 0});
        }
        return &out_.reports[static_cast<std::size_t>(index)].bits;
    }

    Result<void> fields(ReportKind kind, std::uint32_t flags) {
        if (global_.report_size > kMaxFieldBits)
            return wrong("a report size of " + std::to_string(global_.report_size) + " bits (at most 256)");
        auto bits = report_bits(kind);
        if (!bits) return std::unexpected(bits.error());
        const std::uint64_t length = std::uint64_t{global_.report_size} * global_.report_count;
        if (length + **bits > kMaxReportBits) return wrong("a report longer than 16384 bytes");
        if (length == 0) return {};

        Field f;
        f.kind = kind;
        f.report_id = global_.report_id;
        f.collection = open_.empty() ? -1 : open_.back();
        f.constant = flags & 1;
        f.array = !(flags & 2);
        f.relative = flags & 4;
        f.null_state = flags & 0x40;
        f.bit_size = global_.report_size;
        f.unit = global_.unit;
        f.unit_exponent = global_.unit_exponent;
        f.logical_min = global_.logical_min.as_signed;
        f.logical_max = f.logical_min < 0 ? std::int64_t{global_.logical_max.as_signed}
                                          : std::int64_t{global_.logical_max.as_unsigned};
        f.physical_min = global_.physical_min.as_signed;
        f.physical_max = f.physical_min < 0 ? std::int64_t{global_.physical_max.as_signed}
                                            : std::int64_t{global_.physical_max.as_unsigned};
        if (!f.constant && f.logical_min > f.logical_max)
            return wrong("a logical minimum of " + std::to_string(f.logical_min) + " above the maximum of " +
                         std::to_string(f.logical_max));
        const auto put = [&](std::uint32_t count) -> Result<void> {
            if (out_.fields.size() >= kMaxFields) return wrong("more than 1024 fields");
            f.count = count;
            f.bit_offset = **bits;
            **bits += count * f.bit_size;
            out_.fields.push_back(f);
            return {};
        };
        if (f.constant || f.array || local_.usages.empty()) {
            if (!local_.usages.empty()) {
                const UsageRange &first = local_.usages.front(), &last = local_.usages.back();
                f.usage = resolve(first.first, first.has_page, global_.usage_page);
                f.usage_last = resolve(last.last, last.has_page, global_.usage_page);
                if (f.array && !f.constant) {
                    f.first_span = static_cast<std::uint32_t>(out_.array_usages.size());
                    f.span_count = static_cast<std::uint32_t>(local_.usages.size());
                    for (const UsageRange& r : local_.usages)
                        out_.array_usages.push_back({resolve(r.first, r.has_page, global_.usage_page), static_cast<std::uint16_t>(r.last)});
                }
            }
            return put(global_.report_count);
        }
        // Variable: one usage per element in turn; the last usage serves all that are left over.
        std::uint32_t left = global_.report_count;
        for (std::size_t r = 0; r < local_.usages.size() && left > 0; ++r) {
            const UsageRange& range = local_.usages[r];
            const bool last_range = r + 1 == local_.usages.size();
            for (std::uint32_t u = range.first; left > 0; ++u) {
                const bool rest = last_range && u == range.last;
                f.usage = f.usage_last = resolve(u, range.has_page, global_.usage_page);
                const std::uint32_t count = rest ? left : 1;
                if (auto done = put(count); !done) return done;
                left -= count;
                if (u == range.last) break;
            }
        }
        return {};
    }

    Result<void> global_item(std::uint8_t tag, ItemValue value) {
        switch (tag) {
            case 0x0: global_.usage_page = static_cast<std::uint16_t>(value.as_unsigned); break;
            case 0x1: global_.logical_min = value; break;
            case 0x2: global_.logical_max = value; break;
            case 0x3: global_.physical_min = value; break;
            case 0x4: global_.physical_max = value; break;
            case 0x5: {
                int e = value.as_signed;
                if (e >= 8 && e <= 15) e -= 16;
                if (e < -kMaxUnitExponent || e > kMaxUnitExponent)
                    return wrong("a unit exponent of " + std::to_string(e) + " (-20 to 20)");
                global_.unit_exponent = e;
                break;
            }
            case 0x6: global_.unit = value.as_unsigned; break;
            case 0x7: global_.report_size = value.as_unsigned; break;
            case 0x8:
                if (value.as_unsigned == 0 || value.as_unsigned > 255)
                    return wrong("a report id of " + std::to_string(value.as_unsigned) + " (1 to 255)");
                if (!out_.has_report_ids && !out_.reports.empty())
                    return wrong("a report id after fields that have none");
                out_.has_report_ids = true;
                global_.report_id = static_cast<std::uint8_t>(value.as_unsigned);
                break;
            case 0x9: global_.report_count = value.as_unsigned; break;
            case 0xA:
                if (pushed_.size() >= kMaxPushDepth) return wrong("more than 16 pushes");
                pushed_.push_back(global_);
                break;
            case 0xB:
                if (pushed_.empty()) return wrong("a pop without a push");
                global_ = pushed_.back();
                pushed_.pop_back();
                break;
            default: return wrong("a reserved global item");
        }
        return {};
    }

    Result<void> local_item(std::uint8_t tag, ItemValue value, bool has_page) {
        const UsageRange one{value.as_unsigned, value.as_unsigned, has_page};
        switch (tag) {
            case 0x0:
                if (local_.in_delimiter && local_.delimiter_has_usage) break;  // the alternatives after the preferred
                local_.delimiter_has_usage = true;
                local_.usages.push_back(one);
                break;
            case 0x1: local_.minimum = one; break;
            case 0x2: local_.maximum = one; break;
            case 0xA:
                if ((value.as_unsigned == 1) == local_.in_delimiter || value.as_unsigned > 1)
                    return wrong("delimiters that do not pair up");
                local_.in_delimiter = value.as_unsigned == 1;
                local_.delimiter_has_usage = false;
                break;
            default: break;  // designators and strings
        }
        if (local_.minimum && local_.maximum) {
            UsageRange range{local_.minimum->first, local_.maximum->first, local_.minimum->has_page};
            if (local_.maximum->has_page != range.has_page) {  // one of them names the page: it serves both
                const std::uint32_t page = (range.has_page ? range.first : range.last) & 0xFFFF0000u;
                range = {page | (range.first & 0xFFFFu), page | (range.last & 0xFFFFu), true};
            }
            local_.minimum.reset();
            local_.maximum.reset();
            if (range.last < range.first) return wrong("a usage maximum below its minimum");
            if (range.has_page && (range.first >> 16) != (range.last >> 16))
                return wrong("a usage range over two pages");
            local_.usages.push_back(range);
        }
        return {};
    }

    std::span<const std::uint8_t> bytes_;
    std::size_t at_ = 0, item_at_ = 0;
    GlobalState global_;
    std::vector<GlobalState> pushed_;
    LocalState local_;
    std::vector<int> open_;
    std::array<std::array<int, 256>, 3> report_index_{};
    ReportDescriptor out_;
};

}  // namespace

const Report* ReportDescriptor::find_report(ReportKind kind, std::uint8_t id) const noexcept {
    for (const Report& r : reports)
        if (r.kind == kind && r.id == id) return &r;
    return nullptr;
}

bool ReportDescriptor::within(int collection, int ancestor) const noexcept {
    for (int c = collection; c >= 0; c = collections[static_cast<std::size_t>(c)].parent)
        if (c == ancestor) return true;
    return false;
}

Result<ReportDescriptor> parse_report_descriptor(std::span<const std::uint8_t> bytes) { return Parser(bytes).run(); }

std::optional<std::int64_t> raw_value(const Field& field, std::span<const std::uint8_t> payload,
                                      std::uint32_t element) noexcept {
    if (field.bit_size == 0 || field.bit_size > 64 || element >= field.count) return std::nullopt;
    const std::uint64_t first = field.bit_offset + std::uint64_t{element} * field.bit_size;
    if (first + field.bit_size > std::uint64_t{payload.size()} * 8) return std::nullopt;
    std::uint64_t value = 0;
    const std::size_t from = static_cast<std::size_t>(first >> 3);
    const auto odd = static_cast<unsigned>(first & 7);
    std::uint32_t got = 0;
    if (std::endian::native == std::endian::little && from + 8 <= payload.size() && odd + field.bit_size <= 64) {
        std::memcpy(&value, payload.data() + from, 8);   // nearly every field: one load in place of a loop over its bytes
        value >>= odd;
        if (field.bit_size < 64) value &= (std::uint64_t{1} << field.bit_size) - 1;
        got = field.bit_size;
    }
    while (got < field.bit_size) {
        const std::uint64_t bit = first + got;
        const auto shift = static_cast<unsigned>(bit & 7);
        const std::uint32_t take = std::min(8 - shift, field.bit_size - got);
        const std::uint64_t part = (std::uint64_t{payload[bit >> 3]} >> shift) & ((1u << take) - 1u);
        value |= part << got;
        got += take;
    }
    if (field.logical_min < 0 && field.bit_size < 64 && (value >> (field.bit_size - 1)) != 0)
        value |= ~std::uint64_t{0} << field.bit_size;
    return static_cast<std::int64_t>(value);
}

bool put_raw_value(const Field& field, std::span<std::uint8_t> payload, std::int64_t raw,
                   std::uint32_t element) noexcept {
    if (field.bit_size == 0 || field.bit_size > 64 || element >= field.count) return false;
    const std::uint64_t first = field.bit_offset + std::uint64_t{element} * field.bit_size;
    if (first + field.bit_size > std::uint64_t{payload.size()} * 8) return false;
    if (field.bit_size < 64) {
        const bool is_signed = field.logical_min < 0;
        const std::uint64_t magnitudes = std::uint64_t{1} << (is_signed ? field.bit_size - 1 : field.bit_size);
        const auto high = static_cast<std::int64_t>(magnitudes - 1);
        if (raw > high || raw < (is_signed ? -high - 1 : 0)) return false;
    }
    const auto bits = static_cast<std::uint64_t>(raw);
    for (std::uint32_t i = 0; i < field.bit_size; ++i) {
        const std::uint64_t bit = first + i;
        const auto mask = static_cast<std::uint8_t>(1u << (bit & 7));
        if ((bits >> i) & 1)
            payload[bit >> 3] = static_cast<std::uint8_t>(payload[bit >> 3] | mask);
        else
            payload[bit >> 3] = static_cast<std::uint8_t>(payload[bit >> 3] & ~mask);
    }
    return true;
}

std::optional<Usage> selected_usage(const ReportDescriptor& descriptor, const Field& field,
                                    std::span<const std::uint8_t> payload, std::uint32_t element) noexcept {
    const auto raw = raw_value(field, payload, element);
    if (!field.array || !raw || *raw < field.logical_min || *raw > field.logical_max) return std::nullopt;
    auto index = static_cast<std::uint64_t>(*raw) - static_cast<std::uint64_t>(field.logical_min);
    for (std::uint32_t i = field.first_span; i < field.first_span + field.span_count; ++i) {
        const UsageSpan& s = descriptor.array_usages[i];
        const std::uint64_t count = s.last >= s.first.id ? std::uint64_t{s.last} - s.first.id + 1 : 0;
        if (index < count) return Usage{s.first.page, static_cast<std::uint16_t>(s.first.id + index)};
        index -= count;
    }
    return std::nullopt;
}

bool can_select(const ReportDescriptor& descriptor, const Field& field, Usage usage) noexcept {
    if (!field.array) return false;
    for (std::uint32_t i = field.first_span; i < field.first_span + field.span_count; ++i) {
        const UsageSpan& s = descriptor.array_usages[i];
        if (s.first.page == usage.page && usage.id >= s.first.id && usage.id <= s.last) return true;
    }
    return false;
}

bool in_logical_range(const Field& field, std::int64_t raw) noexcept {
    if (field.bit_size > 32 || (field.logical_min == 0 && field.logical_max == 0)) return true;
    return raw >= field.logical_min && raw <= field.logical_max;
}

UnitMeaning unit_meaning(std::uint32_t unit, int unit_exponent) noexcept {
    const double scale = std::pow(10.0, unit_exponent);
    const std::uint32_t system = unit & 0xF, length = (unit >> 4) & 0xF, time = (unit >> 12) & 0xF;
    const bool only_time = (unit & 0xFFFF0FF0u) == 0, only_length = (unit & 0xFFFFFF00u) == 0;
    if (unit == 0 || system == 0) return {Quantity::none, scale};
    if (only_time && time == 1) return {Quantity::time, scale};
    if (only_time && time == 0xF) return {Quantity::frequency, scale};
    if (only_length && length == 1) {
        switch (system) {
            case 1: return {Quantity::length, 0.01 * scale};     // centimetre
            case 2: return {Quantity::angle, scale};             // radian
            case 3: return {Quantity::length, 0.0254 * scale};   // inch
            case 4: return {Quantity::angle, std::numbers::pi / 180 * scale};
            default: break;
        }
    }
    return {Quantity::other, scale};
}

double physical_value(const Field& field, std::int64_t raw) noexcept {
    const auto value = static_cast<double>(raw);
    if (field.physical_min == 0 && field.physical_max == 0) return value;
    if (field.logical_max <= field.logical_min) return value;
    const auto low = static_cast<double>(field.logical_min), span = static_cast<double>(field.logical_max) - low;
    const auto out_low = static_cast<double>(field.physical_min);
    return out_low + (value - low) * (static_cast<double>(field.physical_max) - out_low) / span;
}

}  // namespace fovea::drivers::hid
