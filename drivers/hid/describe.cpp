// A report descriptor in words.
#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "drivers/hid/usages.hpp"

namespace fovea::drivers::hid {

namespace {

const char* collection_name(std::uint8_t type) noexcept {
    constexpr const char* kNames[] = {"physical", "application", "logical", "report", "named array", "usage switch",
                                      "usage modifier"};
    return type < std::size(kNames) ? kNames[type] : type >= 0x80 ? "vendor" : "reserved";
}

std::string unit_text(const Field& f) {
    if (f.unit == 0) return f.unit_exponent == 0 ? std::string{} : fmt::format(", no unit x 10^{}", f.unit_exponent);
    const UnitMeaning m = unit_meaning(f.unit, f.unit_exponent);
    switch (m.quantity) {
        case Quantity::length: return fmt::format(", {:g} m each", m.to_si);
        case Quantity::angle: return fmt::format(", {:g} rad each", m.to_si);
        case Quantity::time: return fmt::format(", {:g} s each", m.to_si);
        case Quantity::frequency: return fmt::format(", {:g} Hz each", m.to_si);
        default: return fmt::format(", unit 0x{:X} x 10^{}", f.unit, f.unit_exponent);
    }
}

std::string field_text(const Field& f) {
    std::string text = fmt::format("bit {:4}, {:2} bits", f.bit_offset, f.bit_size);
    if (f.count > 1) text += fmt::format(" x {}", f.count);
    text += ": ";
    if (f.constant) return text + "constant" + (f.usage == Usage{} ? "" : " (" + usage_name(f.usage) + ")");
    text += usage_name(f.usage);
    if (f.array) text += f.usage_last == f.usage ? ", as array" : " to " + usage_name(f.usage_last) + ", as array";
    text += fmt::format(", {} to {}", f.logical_min, f.logical_max);
    if (f.physical_min != 0 || f.physical_max != 0)
        text += fmt::format(" meaning {} to {}", f.physical_min, f.physical_max);
    text += unit_text(f);
    if (f.relative) text += ", relative";
    if (f.null_state) text += ", outside = no value";
    return text;
}

void add_collection(std::string& out, const ReportDescriptor& d, int index, int depth) {
    const std::string pad(static_cast<std::size_t>(std::max(depth, 0)) * 2, ' ');
    if (index >= 0) {
        const Collection& c = d.collections[static_cast<std::size_t>(index)];
        out += fmt::format("{}{} ({} collection)\n", pad, usage_name(c.usage), collection_name(c.type));
    }
    const std::string inner(static_cast<std::size_t>(depth + 1) * 2, ' ');
    int last_id = -1;
    ReportKind last_kind = ReportKind::output;
    for (const Field& f : d.fields) {
        if (f.collection != index) continue;
        if (f.report_id != last_id || f.kind != last_kind) {
            const Report* r = d.find_report(f.kind, f.report_id);
            out += d.has_report_ids ? fmt::format("{}{} report 0x{:02X}, {} bytes after the id\n", inner,
                                                  to_string(f.kind), f.report_id, r ? r->bytes() : 0)
                                    : fmt::format("{}{} report, {} bytes\n", inner, to_string(f.kind), r ? r->bytes() : 0);
            last_id = f.report_id;
            last_kind = f.kind;
        }
        out += inner + "  " + field_text(f) + "\n";
    }
    // Children stand behind their parents in the list, and nesting is at most kMaxCollectionDepth deep.
    for (int c = index + 1; c < static_cast<int>(d.collections.size()); ++c)
        if (d.collections[static_cast<std::size_t>(c)].parent == index) add_collection(out, d, c, depth + 1);
}

}  // namespace

const char* to_string(ReportKind kind) noexcept {
    switch (kind) {
        case ReportKind::input: return "input";
        case ReportKind::output: return "output";
        case ReportKind::feature: return "feature";
    }
    return "unknown";
}

std::string describe(const ReportDescriptor& descriptor) {
    std::string out;
    add_collection(out, descriptor, -1, -1);
    return out;
}

}  // namespace fovea::drivers::hid
