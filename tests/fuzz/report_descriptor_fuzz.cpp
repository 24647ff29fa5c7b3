// Any bytes as a HID report descriptor: refused, or parsed within the limits that the header states.
#include "drivers/hid/report_descriptor.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace fovea::drivers::hid;
    const auto parsed = parse_report_descriptor({data, size});
    if (!parsed) {
        FOVEA_FUZZ_CHECK(!parsed.error().what.empty());
        return 0;
    }
    FOVEA_FUZZ_CHECK(parsed->fields.size() <= kMaxFields && parsed->collections.size() <= kMaxCollections);
    for (const Collection& c : parsed->collections) FOVEA_FUZZ_CHECK(c.parent < static_cast<int>(&c - parsed->collections.data()));
    std::uint8_t payload[64] = {0xA5, 0x5A, 0xFF};
    for (const Field& f : parsed->fields) {
        FOVEA_FUZZ_CHECK(f.bit_size >= 1 && f.bit_size <= kMaxFieldBits && f.count >= 1);
        FOVEA_FUZZ_CHECK(f.collection < static_cast<int>(parsed->collections.size()));
        const Report* r = parsed->find_report(f.kind, f.report_id);
        FOVEA_FUZZ_CHECK(r != nullptr && r->bits <= kMaxReportBits);
        FOVEA_FUZZ_CHECK(std::uint64_t{f.bit_offset} + std::uint64_t{f.bit_size} * f.count <= r->bits);
        for (const std::uint32_t element : {0u, f.count - 1, f.count})
            if (const auto raw = raw_value(f, payload, element)) {
                (void)physical_value(f, *raw);
                FOVEA_FUZZ_CHECK(put_raw_value(f, payload, *raw, element));
                FOVEA_FUZZ_CHECK(raw_value(f, payload, element) == raw);
            }
        (void)unit_meaning(f.unit, f.unit_exponent);
    }
    FOVEA_FUZZ_CHECK(describe(*parsed).size() < 4'000'000);
    return 0;
}
