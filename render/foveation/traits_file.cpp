#include "render/foveation/traits_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <string_view>

namespace fovea::foveation {
namespace {

constexpr std::string_view kTitle = "fovea driver traits 1\n";
constexpr std::size_t kLongest = 4096;   // bytes; a real one has some 300

constexpr std::array<std::pair<std::string_view, double TraitsNumbers::*>, 4> kNumbers{{
    {"stencil_cost", &TraitsNumbers::stencil_cost},
    {"depth_cost", &TraitsNumbers::depth_cost},
    {"resolve_ratio", &TraitsNumbers::resolve_ratio},
    {"rate_map_ratio", &TraitsNumbers::rate_map_ratio},
}};

std::string fnv1a(std::string_view text) {
    std::uint64_t h = 0xcbf29ce484222325u;
    for (const char c : text) h = (h ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
    std::array<char, 17> hex{};
    std::snprintf(hex.data(), hex.size(), "%016llx", static_cast<unsigned long long>(h));
    return hex.data();
}

// Takes `head` off the front; false if it is not there.
bool take(std::string_view& text, std::string_view head) {
    if (!text.starts_with(head)) return false;
    text.remove_prefix(head.size());
    return true;
}

struct File {
    explicit File(int opened) noexcept : fd(opened) {}
    ~File() {
        if (fd >= 0) ::close(fd);
    }
    File(const File&) = delete;
    File& operator=(const File&) = delete;
    int fd;
};

std::string bytes_of(const TraitsKey& key, const TraitsNumbers& n) {
    std::string text(kTitle);
    text += "driver " + key.text() + "\n";
    for (const auto& [name, member] : kNumbers) {
        std::array<char, 32> digits{};
        const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), n.*member).ptr;
        text += std::string(name) + " " + std::string(digits.data(), end) + "\n";
    }
    return text + "sum " + fnv1a(text) + "\n";
}

}  // namespace

std::string TraitsKey::text() const {
    std::string line = renderer + ", " + gl_version + ", fovea " + fovea_version + ", " + std::to_string(processors) + " processors";
    for (char& c : line)
        if (static_cast<unsigned char>(c) < ' ') c = ' ';
    if (line.size() > kLongest / 4) line.resize(kLongest / 4);
    return line;
}

std::filesystem::path traits_file(const std::filesystem::path& folder, const TraitsKey& key) { return folder / ("driver-" + fnv1a(key.text())); }

TraitsRead read_traits(const std::filesystem::path& path, const TraitsKey& key) {
    const auto not_believed = [&](const char* why) { return TraitsRead{std::nullopt, path.string() + " " + why}; };
    const File file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
    if (file.fd < 0) return errno == ENOENT ? TraitsRead{} : TraitsRead{std::nullopt, path.string() + ": " + std::strerror(errno)};
    struct stat about{};
    if (::fstat(file.fd, &about) != 0 || !S_ISREG(about.st_mode)) return not_believed("is not a regular file");
    if (about.st_uid != ::geteuid()) return not_believed("belongs to another user");
    std::string bytes(kLongest + 1, '\0');
    std::size_t size = 0;
    for (ssize_t n = 1; n > 0 && size < bytes.size(); size += static_cast<std::size_t>(n)) {
        n = ::read(file.fd, bytes.data() + size, bytes.size() - size);
        if (n < 0) return not_believed("cannot be read");
    }
    bytes.resize(size);
    if (size > kLongest) return not_believed("is too long");
    std::string_view rest = bytes;
    if (!take(rest, kTitle)) return not_believed("is damaged, or of another version");
    constexpr std::size_t kSum = 4 + 16 + 1;   // "sum " hex newline
    if (rest.size() < kSum || !bytes.ends_with("\n")) return not_believed("is damaged: its end is missing");
    const std::string_view summed(bytes.data(), bytes.size() - kSum);
    if (bytes.substr(summed.size()) != "sum " + fnv1a(summed) + "\n") return not_believed("is damaged: its sum is wrong");
    rest.remove_suffix(kSum);
    if (!take(rest, "driver ") || !take(rest, key.text()) || !take(rest, "\n")) return not_believed("is of another driver, version or number of processors");
    TraitsNumbers n;
    for (const auto& [name, member] : kNumbers) {
        if (!take(rest, name) || !take(rest, " ")) return not_believed("lacks a number");
        const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), n.*member);
        if (error != std::errc{} || !std::isfinite(n.*member) || n.*member < 0) return not_believed("has a number that cannot be");
        rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
        if (!take(rest, "\n")) return not_believed("has a number that cannot be");
    }
    if (!rest.empty()) return not_believed("has more in it than it should");
    return {n, {}};
}

std::string write_traits(const std::filesystem::path& path, const TraitsKey& key, const TraitsNumbers& numbers) {
    const auto failed = [&](const std::string& what) { return what + ": " + std::strerror(errno); };
    std::error_code error;
    const std::filesystem::path folder = path.parent_path();
    if (!std::filesystem::exists(folder, error)) {
        std::filesystem::create_directories(folder.parent_path(), error);
        if (::mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST) return failed(folder.string());
    }
    std::string beside = path.string() + ".XXXXXX";
    const std::string bytes = bytes_of(key, numbers);
    {
        const File file(::mkostemp(beside.data(), O_CLOEXEC));
        if (file.fd < 0) return failed(folder.string());
        if (::write(file.fd, bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size())) {
            const std::string what = failed(beside);
            ::unlink(beside.c_str());
            return what;
        }
    }
    if (::rename(beside.c_str(), path.c_str()) == 0) return {};
    const std::string what = failed(path.string());
    ::unlink(beside.c_str());
    return what;
}

}  // namespace fovea::foveation
