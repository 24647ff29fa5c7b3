// Reads the real #includes of the tree and holds them against the design: who may include whom, and which third-party
// headers stay out of headers.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

namespace fs = std::filesystem;

namespace {

// The arrows of the design. A room is a folder; the longest name that fits is a file's room. A room may always include
// itself. Nothing else is allowed: a new folder needs a row here.
const std::map<std::string, std::vector<std::string>> kArrows = {
    {"command_line", {}},
    {"protocol", {}},
    {"protocol/include", {}},
    {"protocol/client", {"protocol", "protocol/include"}},
    {"drivers", {"protocol"}},
    {"replay", {"protocol", "drivers"}},
    {"daemon/pipeline", {"protocol"}},
    {"daemon/service", {"protocol", "drivers", "daemon/pipeline"}},
    {"render/threads", {}},
    {"render/density", {"protocol"}},
    {"render/gl", {"protocol"}},
    {"render/foveation", {"protocol", "render/density", "render/gl", "render/threads"}},
    {"render/quality", {"protocol", "render/density", "render/gl", "render/foveation"}},
    {"render/extrapolation", {"protocol", "render/gl", "render/threads"}},
    {"render/scene", {"protocol", "render/density", "render/gl"}},
    {"render/effects", {"protocol", "render/density", "render/gl", "render/foveation", "render/extrapolation", "render/scene"}},
    {"render/present", {"protocol", "render/gl"}},
    {"render/layer", {"protocol", "protocol/include", "render/density", "render/gl", "render/foveation", "render/extrapolation"}},
    // Wiring.
    {"render/viewer", {"protocol", "protocol/include", "render/density", "render/gl", "render/foveation",
                       "render/quality", "render/extrapolation", "render/scene", "render/effects", "render/present", "command_line"}},
    {"daemon/main.cpp", {"command_line", "protocol", "drivers", "replay", "daemon/pipeline", "daemon/service", "daemon/recording.hpp"}},
    {"daemon/recording.hpp", {"protocol", "drivers", "replay", "daemon/service"}},
    {"daemon/recording.cpp", {"protocol", "drivers", "replay", "daemon/service", "daemon/recording.hpp"}},
    {"tools", {"command_line", "protocol", "protocol/include", "drivers", "replay", "daemon/pipeline", "daemon/service",
               "render/density", "render/gl", "render/foveation", "render/extrapolation", "render/scene",
               "render/quality", "render/effects", "render/present", "render/viewer"}},
};

// Third-party headers that each room keeps inside its .cpp files. Only the wiring may show them in a header.
const char* const kHiddenHeaders[] = {"hidapi", "libusb", "opencv", "sqlite3", "boost/", "toml++", "spdlog",
                                      "CLI/",   "nlohmann", "linux/videodev", "tiny_gltf", "ft2build", "jpeglib"};
const char* const kWiring[] = {"tools", "render/viewer", "daemon/main.cpp"};

std::string room_of(const std::string& path) {
    std::string room;
    for (const auto& [name, arrows] : kArrows)
        if (path.starts_with(name) && (path.size() == name.size() || path[name.size()] == '/') && name.size() > room.size())
            room = name;
    return room;
}

// What is wrong with the includes of one file; empty: nothing.
std::vector<std::string> faults_of(const std::string& path, const std::string& text) {
    const std::string room = room_of(path);
    if (room.empty()) return {path + ": belongs to no room of the table in tests/architecture/includes_test.cpp"};
    std::vector<std::string> faults;
    static const std::regex include_line(R"(^[ \t]*#[ \t]*include[ \t]*[<"]([^>"]+)[>"])", std::regex::multiline);
    for (std::sregex_iterator it(text.begin(), text.end(), include_line), end; it != end; ++it) {
        const std::string header = (*it)[1];
        const bool in_header = path.ends_with(".hpp") || path.ends_with(".h");
        const bool wiring = std::ranges::find(kWiring, room) != std::end(kWiring);
        if (in_header && !wiring)
            for (const char* hidden : kHiddenHeaders)
                if (header.starts_with(hidden)) faults.push_back(path + ": shows <" + header + "> in a header");
        if (header.starts_with(".") || header.find("../") != std::string::npos)
            faults.push_back(path + ": names \"" + header + "\" by a relative path; write it from the root");
        const std::string target = header.starts_with("fovea/") ? "protocol/include" : room_of(header);
        if (target.empty() || target == room) {
            // A first folder of ours that is no room (daemon/x.hpp, utils/...), or tests: nobody includes those.
            for (const char* ours : {"tests/", "daemon/", "render/", "utils/", "common/"})
                if (target.empty() && header.starts_with(ours))
                    faults.push_back(path + ": includes \"" + header + "\", which is in no room");
            continue;
        }
        const auto& allowed = kArrows.at(room);
        if (std::ranges::find(allowed, target) == allowed.end())
            faults.push_back(path + ": " + room + " may not include " + target + " (\"" + header + "\")");
    }
    return faults;
}

std::string read(const fs::path& path) {
    std::ostringstream text;
    text << std::ifstream(path).rdbuf();
    return text.str();
}

std::vector<std::string> source_files() {
    const fs::path root = FOVEA_SOURCE_DIR;
    std::vector<std::string> files;
    for (const char* folder : {"command_line", "protocol", "drivers", "daemon", "render", "replay", "tools"})
        for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
            const std::string extension = entry.path().extension();
            if (entry.is_regular_file() && (extension == ".hpp" || extension == ".cpp" || extension == ".h" || extension == ".c"))
                files.push_back(fs::relative(entry.path(), root).string());
        }
    std::ranges::sort(files);
    return files;
}

}  // namespace

TEST(Architecture, EveryIncludeFollowsAnArrowOfTheDesign) {
    const std::vector<std::string> files = source_files();
    EXPECT_GT(files.size(), 50u);   // the tree was found
    for (const std::string& file : files)
        for (const std::string& fault : faults_of(file, read(fs::path(FOVEA_SOURCE_DIR) / file))) ADD_FAILURE() << fault;
}

TEST(Architecture, HasNoDrawerForOddsAndEnds) {
    for (const auto& entry : fs::directory_iterator(FOVEA_SOURCE_DIR)) {
        if (!entry.is_directory() || entry.path().filename() == "build") continue;
        EXPECT_NE(entry.path().filename(), "utils");
        EXPECT_NE(entry.path().filename(), "common");
    }
    for (const std::string& file : source_files()) {
        EXPECT_EQ(file.find("utils/"), std::string::npos) << file;
        EXPECT_EQ(file.find("common/"), std::string::npos) << file;
    }
}

TEST(Architecture, TheCHeaderNeedsNothingButStdint) {
    const std::string header = read(fs::path(FOVEA_SOURCE_DIR) / "protocol/include/fovea/fovea.h");
    static const std::regex include_line(R"(^[ \t]*#[ \t]*include[ \t]*[<"]([^>"]+)[>"])", std::regex::multiline);
    for (std::sregex_iterator it(header.begin(), header.end(), include_line), end; it != end; ++it)
        EXPECT_EQ((*it)[1], "stdint.h");
}

TEST(ArchitectureCheck, SeesEachKindOfWrongInclude) {
    const auto faults = [](const char* path, const char* text) { return faults_of(path, text).size(); };
    EXPECT_EQ(faults("protocol/a.cpp", "#include <cmath>\n#include \"protocol/b.hpp\"\n"), 0u);
    EXPECT_EQ(faults("protocol/a.cpp", "#include <cmath>\n  #  include \"drivers/device.hpp\"\n"), 1u);
    EXPECT_EQ(faults("protocol/a.cpp", "#include \"protocol/client/client.hpp\"\n"), 1u);
    EXPECT_EQ(faults("render/gl/a.hpp", "#include \"daemon/pipeline/pipeline.hpp\"\n#include \"replay/recording.hpp\"\n"), 2u);
    EXPECT_EQ(faults("render/viewer/main.cpp", "#include \"drivers/device.hpp\"\n"), 1u);
    EXPECT_EQ(faults("render/viewer/main.cpp", "#include <fovea/fovea.h>\n#include \"render/gl/context.hpp\"\n"), 0u);
    EXPECT_EQ(faults("daemon/pipeline/a.cpp", "#include \"daemon/service/daemon.hpp\"\n"), 1u);
    EXPECT_EQ(faults("daemon/service/a.cpp", "#include \"replay/recording.hpp\"\n"), 1u);
    EXPECT_EQ(faults("daemon/main.cpp", "#include \"replay/recording.hpp\"\n"), 0u);
    EXPECT_EQ(faults("drivers/hid/a.hpp", "#include <hidapi/hidapi.h>\n"), 1u);
    EXPECT_EQ(faults("drivers/hid/a.cpp", "#include <hidapi/hidapi.h>\n"), 0u);
    EXPECT_EQ(faults("daemon/service/a.hpp", "#include <boost/asio.hpp>\n"), 1u);
    EXPECT_EQ(faults("tools/commands.hpp", "#include <CLI/CLI.hpp>\n"), 0u);
    EXPECT_EQ(faults("replay/a.cpp", "#include \"tests/protocol/tiny_daemon.hpp\"\n"), 1u);
    EXPECT_EQ(faults("replay/a.cpp", "#include \"../protocol/clock.hpp\"\n"), 1u);
    EXPECT_EQ(faults("attic/a.cpp", ""), 1u);
    EXPECT_EQ(faults("render/new_room/a.cpp", ""), 1u);
}
