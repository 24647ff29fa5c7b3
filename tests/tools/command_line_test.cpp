#include "command_line/checks.hpp"

#include <gtest/gtest.h>

#include <CLI/CLI.hpp>

namespace fovea::command_line {
namespace {

std::string complaint(const CLI::Validator& check, std::string text) { return check(text); }

TEST(CommandLine, ANumberIsWithinItsRangeOrNamed) {
    const CLI::Validator check = within(-0.5, 1e6);
    for (const char* text : {"-0.5", "0", "-0", "1e6", "1000000", "3.25"}) EXPECT_EQ(complaint(check, text), "") << text;
    for (const char* text : {"-0.50001", "1000001", "1e300", "-1e300"}) EXPECT_EQ(complaint(check, text), std::string("Value ") + text + " not in range -0.5 to 1e+06");
}

TEST(CommandLine, WhatIsNoFiniteNumberIsWithinNoRange) {
    const CLI::Validator all = within(-1e308, 1e308);
    for (const char* text : {"nan", "NaN", "-nan", "nan(1)", "inf", "-inf", "infinity", "1e999", "", " ", "one", "1x", "1,5"}) EXPECT_NE(complaint(all, text), "") << text;
}

TEST(CommandLine, AnEmptyNameIsNoFile) {
    EXPECT_EQ(complaint(file_name(), "gaze.csv"), "");
    EXPECT_NE(complaint(file_name(), ""), "");
}

}  // namespace
}  // namespace fovea::command_line
