// docs/conformance.md names a test beside each sentence: here, that every name is a test's.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>

namespace fs = std::filesystem;

namespace {

std::string text_of(const fs::path& path) {
    std::ifstream in(path);
    std::stringstream text;
    text << in.rdbuf();
    return text.str();
}

// By suite, from the sources.
std::map<std::string, std::set<std::string>> tests_of_the_layer() {
    std::map<std::string, std::set<std::string>> tests;
    const std::regex test(R"(TEST(?:_F)?\((\w+), (\w+)\))");
    for (const auto& entry : fs::directory_iterator(fs::path(FOVEA_SOURCE_DIR) / "tests/layer")) {
        if (entry.path().extension() != ".cpp") continue;
        const std::string source = text_of(entry.path());
        for (std::sregex_iterator it(source.begin(), source.end(), test), end; it != end; ++it) tests[(*it)[1]].insert((*it)[2]);
    }
    return tests;
}

}  // namespace

TEST(Conformance, EveryTestThatThePageNamesExists) {
    const auto tests = tests_of_the_layer();
    ASSERT_GT(tests.size(), 10u);
    const std::string page = text_of(fs::path(FOVEA_SOURCE_DIR) / "docs/conformance.md");
    int rows = 0, named = 0;
    std::istringstream lines(page);
    const std::regex name(R"(`(?:(\w+)\.)?([A-Z]\w+|\*)`)");
    for (std::string line; std::getline(lines, line);) {
        if (!line.starts_with("| ")) continue;
        // The second cell; a bar inside backticks would be none of a table's.
        const std::size_t from = line.find(" | ");
        if (from == std::string::npos) continue;
        const std::size_t to = line.find(" |", from + 3);
        const std::string cell = line.substr(from + 3, to == std::string::npos ? to : to - from - 3);
        ++rows;
        for (std::sregex_iterator it(cell.begin(), cell.end(), name), end; it != end; ++it) {
            const std::string suite = (*it)[1], test = (*it)[2];
            ++named;
            const bool known = test == "*" ? tests.contains(suite)
                               : !suite.empty() ? tests.contains(suite) && tests.at(suite).contains(test)
                                                : std::any_of(tests.begin(), tests.end(), [&](const auto& s) { return s.second.contains(test); });
            EXPECT_TRUE(known) << (*it)[0] << " in: " << line;
        }
    }
    EXPECT_GT(rows, 60);
    EXPECT_GT(named, 80);
}

TEST(Conformance, EveryTestOfAnExtensionIsOnThePage) {
    const std::string page = text_of(fs::path(FOVEA_SOURCE_DIR) / "docs/conformance.md");
    const auto all = tests_of_the_layer();
    for (const char* suite : {"FramebufferFoveated", "TextureFoveated", "FrameExtrapolation", "FrameExtrapolationAmong", "Layers", "Views", "LostContext"}) {
        ASSERT_TRUE(all.contains(suite)) << suite;
        for (const std::string& test : all.at(suite)) EXPECT_NE(page.find(test), std::string::npos) << suite << '.' << test;
    }
}
