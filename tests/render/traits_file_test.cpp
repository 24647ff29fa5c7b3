// What the probe found out, on disk: believed only if it is whole, ours, and this driver's.
#include "render/foveation/traits_file.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "tests/render/gl_fixture.hpp"

using namespace fovea;
using namespace fovea::foveation;
namespace fs = std::filesystem;

namespace {

const TraitsKey kKey{"llvmpipe (LLVM 15.0.6, 256 bits)", "OpenGL ES 3.2 Mesa 22.3.6", "0.1.0", 2};
constexpr TraitsNumbers kNumbers{0.024, 0.027, 0.1, 3.5};

struct Folder {
    Folder() { EXPECT_NE(::mkdtemp(name.data()), nullptr); }
    ~Folder() { fs::remove_all(path()); }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
    [[nodiscard]] fs::path path() const { return name; }
    std::string name = (fs::temp_directory_path() / "fovea-traits-XXXXXX").string();
};

std::string bytes_of(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}
void put(const fs::path& file, const std::string& bytes) { std::ofstream(file, std::ios::binary) << bytes; }

TEST(TraitsFile, ComesBackAsItWasWrittenFromAFolderMadeForTheUserAlone) {
    const Folder f;
    const fs::path folder = f.path() / "cache" / "fovea", file = traits_file(folder, kKey);
    EXPECT_FALSE(read_traits(file, kKey).numbers);
    EXPECT_EQ(read_traits(file, kKey).why_not, "") << "there is none: nothing to say";
    ASSERT_EQ(write_traits(file, kKey, kNumbers), "");
    const TraitsRead back = read_traits(file, kKey);
    ASSERT_TRUE(back.numbers) << back.why_not;
    EXPECT_EQ(*back.numbers, kNumbers);
    struct stat about{};
    ASSERT_EQ(::stat(folder.c_str(), &about), 0);
    EXPECT_EQ(about.st_mode & 0777, 0700u);
    EXPECT_EQ(std::distance(fs::directory_iterator(folder), {}), 1) << "nothing half written is left";
}

TEST(TraitsFile, OfAnotherDriverVersionOrProcessorCountIsNotBelieved) {
    const Folder f;
    const fs::path file = traits_file(f.path(), kKey);
    ASSERT_EQ(write_traits(file, kKey, kNumbers), "");
    std::array<TraitsKey, 4> others{kKey, kKey, kKey, kKey};
    others[0].renderer = "softpipe";
    others[1].gl_version = "OpenGL ES 3.2 Mesa 23.0.0";
    others[2].fovea_version = "0.2.0";
    others[3].processors = 4;
    for (const TraitsKey& other : others) {
        EXPECT_NE(traits_file(f.path(), other), file);
        const TraitsRead got = read_traits(file, other);   // as if it had been copied, or two names were the same
        EXPECT_FALSE(got.numbers) << other.text();
        EXPECT_NE(got.why_not.find("another driver"), std::string::npos) << got.why_not;
    }
}

TEST(TraitsFile, DamagedInAnyByteOrCutAnywhereIsNotBelieved) {
    const Folder f;
    const fs::path file = traits_file(f.path(), kKey);
    ASSERT_EQ(write_traits(file, kKey, kNumbers), "");
    const std::string whole = bytes_of(file);
    ASSERT_GT(whole.size(), 100u);
    for (std::size_t i = 0; i < whole.size(); ++i) {
        std::string bad = whole;
        bad[i] = static_cast<char>(bad[i] ^ 1);
        put(file, bad);
        const TraitsRead flipped = read_traits(file, kKey);
        EXPECT_FALSE(flipped.numbers) << "byte " << i;
        EXPECT_NE(flipped.why_not, "");
        put(file, whole.substr(0, i));
        EXPECT_FALSE(read_traits(file, kKey).numbers) << "cut at " << i;
    }
    put(file, whole + "x");
    EXPECT_FALSE(read_traits(file, kKey).numbers);
    put(file, std::string(1 << 20, 'x'));
    EXPECT_NE(read_traits(file, kKey).why_not.find("too long"), std::string::npos);
}

TEST(TraitsFile, NumbersThatCannotBeAreNotBelievedEvenWithARightSum) {
    const Folder f;
    const fs::path file = traits_file(f.path(), kKey);
    for (const double bad : {-1.0, static_cast<double>(INFINITY), static_cast<double>(NAN)}) {
        ASSERT_EQ(write_traits(file, kKey, {0.1, bad, 0.1, 2}), "");
        EXPECT_FALSE(read_traits(file, kKey).numbers) << bad;
    }
}

TEST(TraitsFile, LinksAndFoldersAreNotRead) {
    const Folder f;
    const fs::path file = traits_file(f.path(), kKey), real = f.path() / "real";
    ASSERT_EQ(write_traits(file, kKey, kNumbers), "");
    fs::rename(file, real);
    fs::create_symlink(real, file);
    EXPECT_FALSE(read_traits(file, kKey).numbers);
    EXPECT_NE(read_traits(file, kKey).why_not, "");
    fs::remove(file);
    fs::create_directory(file);
    EXPECT_FALSE(read_traits(file, kKey).numbers);
    EXPECT_NE(write_traits(file, kKey, kNumbers), "");
    EXPECT_NE(write_traits(real / "below a file" / "x", kKey, kNumbers), "");
}

// Each reader sees a whole file, whoever writes at the moment.
TEST(TraitsFile, IsReplacedInOneStep) {
    const Folder f;
    const fs::path file = traits_file(f.path(), kKey);
    ASSERT_EQ(write_traits(file, kKey, kNumbers), "");
    std::atomic<bool> stop{false};
    std::thread writer([&] {
        for (int i = 0; !stop.load(); ++i) EXPECT_EQ(write_traits(file, kKey, {0.1 * (i % 7), 0.1, 0.1, 12345.678}), "");
    });
    for (int i = 0; i < 300; ++i) {
        const TraitsRead got = read_traits(file, kKey);
        EXPECT_TRUE(got.numbers) << got.why_not;
    }
    stop.store(true);
    writer.join();
}

using DriverProbe = test::GlTest;

TEST_F(DriverProbe, IsRememberedOnDiskAndOnceMoreMeasuredWhereTheFileIsDamaged) {
    const Folder f;
    const fs::path folder = f.path() / "fovea";
    const DriverTraits first = find_driver_traits(folder);
    EXPECT_EQ(first.origin, "measured");
    if (!fs::exists(folder)) GTEST_SKIP() << "a finding is too close to keep: another program holds the processor";
    ASSERT_EQ(std::distance(fs::directory_iterator(folder), {}), 1);
    const fs::path file = fs::directory_iterator(folder)->path();
    const DriverTraits second = find_driver_traits(folder);
    EXPECT_EQ(second.origin, "remembered in " + file.string());
    EXPECT_EQ(second.stencil_cost, first.stencil_cost) << "to the last bit: nothing is measured twice";
    EXPECT_EQ(second.rate_map_ratio, first.rate_map_ratio);
    EXPECT_EQ(second.early_stencil, first.early_stencil);
    EXPECT_EQ(second.depth_mask, first.depth_mask);
    EXPECT_EQ(second.processor_resolve, first.processor_resolve);
    put(file, "nonsense");
    const DriverTraits third = find_driver_traits(folder);
    EXPECT_TRUE(third.origin.starts_with("measured; " + file.string() + " is damaged")) << third.origin;
    EXPECT_EQ(find_driver_traits({}).origin, "measured");
}

TEST(DriverProbeFolder, FollowsTheEnvironmentAndCanBeSwitchedOff) {
    const auto with = [](const char* own, const char* cache, const char* home) {
        const auto set = [](const char* name, const char* value) { value != nullptr ? ::setenv(name, value, 1) : ::unsetenv(name); };
        std::array<std::pair<const char*, std::optional<std::string>>, 3> before{{{"FOVEA_PROBE_CACHE", {}}, {"XDG_CACHE_HOME", {}}, {"HOME", {}}}};
        for (auto& [name, value] : before)
            if (const char* text = std::getenv(name)) value = text;
        set("FOVEA_PROBE_CACHE", own);
        set("XDG_CACHE_HOME", cache);
        set("HOME", home);
        const fs::path got = traits_folder();
        for (auto& [name, value] : before) set(name, value ? value->c_str() : nullptr);
        return got;
    };
    EXPECT_EQ(with(nullptr, nullptr, "/home/a"), "/home/a/.cache/fovea");
    EXPECT_EQ(with(nullptr, "/cache", "/home/a"), "/cache/fovea");
    EXPECT_EQ(with(nullptr, "relative", "/home/a"), "/home/a/.cache/fovea");
    EXPECT_EQ(with("/own", "/cache", "/home/a"), "/own");
    EXPECT_EQ(with("off", "/cache", "/home/a"), "");
    EXPECT_EQ(with(nullptr, nullptr, nullptr), "");
}

}  // namespace
