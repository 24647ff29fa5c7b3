// Whatever bytes an importer is given, it neither crashes nor gives out a sample that breaks the rules of GazeSample.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "replay/import/fovea_csv.hpp"
#include "replay/import/importer.hpp"
#include "replay/import/text_table.hpp"
#include "tests/replay/support.hpp"

using namespace fovea;
using namespace fovea::replay;
using namespace fovea::replay::testing;

namespace {

// The excerpts, and one small file of Fovea's own.
const std::vector<std::string>& corpus() {
    static const std::vector<std::string> files = [] {
        std::vector<std::string> all = {to_csv(odd_recording(20, 31)), to_csv(odd_recording(20, 32), {.degree_decimals = 3})};
        for (const auto& entry : std::filesystem::directory_iterator(source_path("tests/data/import")))
            if (entry.path().string().find("LICENSE") == std::string::npos) all.push_back(read_file(entry.path()));
        return all;
    }();
    return files;
}

void check(const Result<Recording>& recording, const Importer& importer) {
    if (!recording) {
        RC_ASSERT(!recording.error().what.empty());
        RC_ASSERT(!recording.error().way_out.empty());
        return;
    }
    for (const RecordedSample& r : recording->samples) {
        RC_ASSERT(std::abs(r.sample.device_time.ns) <= kMaxTime_ns);
        RC_ASSERT(static_cast<int>(r.label) < kLabelCount);
        for (const EyeState& eye : r.sample.eyes) {
            if (!eye.valid || std::string_view(importer.name) == "fovea_csv") continue;  // the CSV keeps what was recorded
            RC_ASSERT(std::abs(length(eye.gaze_dir_head.vec()) - 1) < 1e-6);
        }
    }
}

// Each importer is asked, whether it recognises the bytes or not: --from allows that.
void feed_all(const std::string& bytes) {
    for (const Importer& importer : importers()) {
        if (importer.opens_file) continue;
        (void)importer.recognise(std::string_view(bytes).substr(0, kPrefixSize));
        check(importer.read({"/nonexistent/x_gaze.csv", bytes}), importer);
    }
}

}  // namespace

RC_GTEST_PROP(Importers, NeverCrashOnGarbage, (const std::string& bytes)) { feed_all(bytes); }

RC_GTEST_PROP(Importers, NeverCrashOnDamagedFiles, ()) {
    std::string bytes = *rc::gen::elementOf(corpus());
    const auto edits = *rc::gen::inRange(1, 12);
    static const std::vector<std::string> nasty = {"nan", "-inf", "1e308", "9223372036854775807", "-9223372036854775808",
                                                   "\"", "\n", "\t", ",", ";", "\xff", "{}", "[]", "null", "1e-320",
                                                   "184467440737095516150", "-", ".", ""};
    for (int i = 0; i < edits && !bytes.empty(); ++i) {
        const auto at = *rc::gen::inRange<std::size_t>(0, bytes.size());
        switch (*rc::gen::inRange(0, 4)) {
            case 0: bytes[at] = static_cast<char>(*rc::gen::inRange(0, 256)); break;
            case 1: bytes.erase(at, *rc::gen::inRange<std::size_t>(1, 40)); break;
            case 2: bytes.insert(at, *rc::gen::elementOf(nasty)); break;
            default: bytes.replace(at, std::min<std::size_t>(8, bytes.size() - at), *rc::gen::elementOf(nasty)); break;
        }
    }
    feed_all(bytes);
}

RC_GTEST_PROP(Importers, NeverCrashOnTornFiles, ()) {
    const std::string& whole = *rc::gen::elementOf(corpus());
    feed_all(whole.substr(0, *rc::gen::inRange<std::size_t>(0, whole.size())));
}

RC_GTEST_PROP(FoveaCsv, ComesBackExactlyWhateverTheSamples, (unsigned seed)) {
    const Recording recording = odd_recording(40, seed);
    const std::string text = to_csv(recording);
    const auto back = read_fovea_csv({"x.csv", text});
    RC_ASSERT(back.has_value());
    RC_ASSERT(back->samples.size() == recording.samples.size());
    for (std::size_t i = 0; i < recording.samples.size(); ++i)
        RC_ASSERT(same(back->samples[i], recording.samples[i]));
    RC_ASSERT(to_csv(*back) == text);
}

RC_GTEST_PROP(DecimalTime, AgreesWithIntegerArithmetic, (std::int64_t value)) {
    value %= kMaxTime_ns;
    RC_ASSERT(decimal_to_ns(std::to_string(value), -9) == value);
    const std::int64_t whole = value / 1'000'000'000, part = std::abs(value % 1'000'000'000);
    std::string fraction = std::to_string(part);
    fraction.insert(0, 9 - fraction.size(), '0');
    const std::string text = (value < 0 ? "-" : "") + std::to_string(std::abs(whole)) + "." + fraction;
    RC_ASSERT(decimal_to_ns(text, 0) == value);
}
