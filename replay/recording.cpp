#include "replay/recording.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cmath>

#include "replay/import/importer.hpp"

namespace fovea::replay {
namespace {

// A recording of this size would be a day at 1 kHz; beyond it the file is something else.
constexpr std::size_t kMaxBytes = std::size_t{4} << 30;

constexpr std::int64_t kMaxStep_ns = 10'000'000'000;  // slower than 0.1 Hz is no rate

constexpr const char* kLabelNames[kLabelCount] = {"none", "fixation", "saccade", "post_saccadic", "pursuit", "blink"};

class File {
public:
    explicit File(int descriptor) : descriptor_(descriptor) {}
    ~File() {
        if (descriptor_ >= 0) ::close(descriptor_);
    }
    File(const File&) = delete;
    File& operator=(const File&) = delete;
    [[nodiscard]] int get() const { return descriptor_; }

private:
    int descriptor_;
};

// Up to `limit` bytes.
Result<std::string> read_file(const std::filesystem::path& path, std::size_t limit) {
    const File file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    if (file.get() < 0)
        return fail_errno("cannot open the recording", errno, path.string(), "check the path and the permissions");
    struct stat status {};
    if (::fstat(file.get(), &status) != 0) return fail_errno("cannot examine the file", errno, path.string());
    if (S_ISDIR(status.st_mode))
        return fail("is a directory", path.string(), "name a recording file; `fovea convert --list` says which kinds");
    if (!S_ISREG(status.st_mode)) return fail("is not a regular file", path.string(), "name a recording file");
    if (status.st_size == 0) return fail("the file is empty", path.string(), "copy the recording again from its origin");
    std::string content(std::min(limit, static_cast<std::size_t>(status.st_size)), '\0');
    std::size_t got = 0;
    while (got < content.size()) {
        const ssize_t n = ::read(file.get(), content.data() + got, content.size() - got);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) return fail_errno("cannot read the recording", errno, path.string(), "check the disk");
        if (n == 0) break;
        got += static_cast<std::size_t>(n);
    }
    content.resize(got);
    return content;
}

bool is_gzip(std::string_view content) { return content.starts_with("\x1f\x8b"); }

// Unpacks up to `limit` bytes of a gzip file (one member after another). A torn file is an error unless a prefix only
// was asked for.
Result<std::string> gunzip(const std::filesystem::path& path, std::string_view packed, std::size_t limit,
                           bool prefix_only) {
    z_stream z{};
    if (inflateInit2(&z, 16 + MAX_WBITS) != Z_OK) return fail("zlib does not start", path.string(), "free some memory");
    std::string out;
    std::string chunk(256 * 1024, '\0');
    int code = Z_OK;
    while (out.size() < limit) {
        if (z.avail_in == 0 && !packed.empty()) {
            const std::size_t n = std::min<std::size_t>(packed.size(), 1u << 30);
            z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
            z.avail_in = static_cast<uInt>(n);
            packed.remove_prefix(n);
        }
        z.next_out = reinterpret_cast<Bytef*>(chunk.data());
        z.avail_out = static_cast<uInt>(chunk.size());
        code = inflate(&z, Z_NO_FLUSH);
        out.append(chunk, 0, chunk.size() - z.avail_out);
        if (code == Z_STREAM_END) {
            if (z.avail_in == 0 && packed.empty()) break;
            code = inflateReset(&z);
        }
        if (code != Z_OK) break;
    }
    inflateEnd(&z);
    if (prefix_only) return out;
    if (out.size() >= limit)
        return fail("unpacks to more than " + std::to_string(limit >> 30) + " GiB", path.string(), "cut the recording");
    if (code != Z_STREAM_END)
        return fail("the gzip data are torn or damaged after " + std::to_string(out.size()) + " unpacked bytes",
                    path.string(), "copy the file again");
    return out;
}

std::string format_list() {
    std::string list;
    for (const Importer& i : importers()) list += (list.empty() ? "" : ", ") + std::string(i.name);
    return list;
}

Result<Recording> load(const std::filesystem::path& path, const Importer* importer) {
    auto prefix = read_file(path, kPrefixSize);
    if (!prefix) return std::unexpected(prefix.error());
    const bool packed = is_gzip(*prefix);
    if (packed) prefix = gunzip(path, *prefix, kPrefixSize, true);
    if (!prefix) return std::unexpected(prefix.error());
    for (const Importer& candidate : importers())
        if (!importer && candidate.recognise(*prefix)) importer = &candidate;
    if (!importer)
        return fail("the format is not known", path.string(),
                    "known: " + format_list() + "; `fovea convert --list` explains them");

    std::string content;
    if (!importer->opens_file) {
        auto whole = read_file(path, kMaxBytes + 1);
        if (whole && whole->size() > kMaxBytes) return fail("is larger than 4 GiB", path.string(), "cut the recording");
        if (whole && packed) whole = gunzip(path, *whole, kMaxBytes, false);
        if (!whole) return std::unexpected(whole.error());
        content = std::move(*whole);
    }
    auto recording = importer->read({path, content});
    if (recording && recording->samples.empty())
        return fail("the recording holds no samples", path.string(), "record again, or name another file");
    return recording;
}

}  // namespace

const char* to_string(Label label) noexcept {
    const auto i = static_cast<std::size_t>(label);
    return i < kLabelCount ? kLabelNames[i] : "unknown";
}

std::optional<Label> label_from(std::string_view text) noexcept {
    for (std::size_t i = 0; i < kLabelCount; ++i)
        if (text == kLabelNames[i]) return static_cast<Label>(i);
    return std::nullopt;
}

Result<std::string> read_recording_file(const std::filesystem::path& path) { return read_file(path, kMaxBytes); }

Result<Recording> load_recording(const std::filesystem::path& path) { return load(path, nullptr); }

Result<Recording> load_recording_as(const std::filesystem::path& path, std::string_view name) {
    for (const Importer& importer : importers())
        if (importer.name == name) return load(path, &importer);
    return fail("there is no format '" + std::string(name) + "'", path.string(), "known: " + format_list());
}

void trim(Recording& recording, Duration start, Duration duration) {
    if (recording.samples.empty()) return;
    const Instant first = recording.samples.front().sample.exposed;
    std::erase_if(recording.samples, [&](const RecordedSample& r) {
        const Duration since = r.sample.exposed - first;
        return since < start || (duration >= Duration::zero() && since - start >= duration);
    });
}

double measured_rate_hz(const Recording& recording) {
    std::vector<std::int64_t> steps;
    steps.reserve(recording.samples.size());
    for (std::size_t i = 1; i < recording.samples.size(); ++i) {
        const std::int64_t step =
            (recording.samples[i].sample.exposed - recording.samples[i - 1].sample.exposed).count();
        if (step > 0) steps.push_back(step);
    }
    if (steps.empty()) return 0;
    // The mean of all steps that are no gaps: 8 and 9 ms steps of a millisecond clock are 120 Hz, and steps of 4 and 8 ms
    // (Pupil Invisible) 200 Hz, neither of which the median finds.
    std::nth_element(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2), steps.end());
    const std::int64_t gap = 3 * std::min(steps[steps.size() / 2], kMaxStep_ns);
    double sum = 0, count = 0;
    for (const std::int64_t step : steps)
        if (step < gap) sum += static_cast<double>(step), ++count;
    if (count == 0) return 0;
    const double rate = 1e9 * count / sum;
    for (const double usual : {25., 30., 50., 60., 72., 75., 90., 100., 120., 144., 200., 240., 250., 300., 500., 600.,
                               1000., 1200., 2000.})
        if (std::abs(rate / usual - 1) < 0.03) return usual;
    return std::round(rate * 10) / 10;
}

}  // namespace fovea::replay
