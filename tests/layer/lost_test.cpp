// A context that is lost with the graphics card: its robustness calls answer through the layer, the layer touches nothing
// of it any more, and a new context works.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/layer/shell.hpp"

using namespace fovea::layer_test;

namespace {

Ran lose(const char* how, const std::string& errors = "/dev/null") {
    return shell(kLayer + "--stats --vendor " FOVEA_LOSING_DRIVER " -- " + kBin + "/layer_losing_program " + how, errors);
}

constexpr const char* kGoesOn = "touched 0\nstatus 0000, a pixel of the periphery 1\n";

}  // namespace

TEST(LostContext, TheResetStatusReachesTheProgramAndNothingIsTouchedAfterwards) {
    const std::string errors = temporary("lost");
    const Ran ran = lose("status", errors);
    EXPECT_EQ(ran.exit_code, 0);
    EXPECT_EQ(ran.out, std::string("status 8254\n") + kGoesOn);
    EXPECT_EQ(nlohmann::json::parse(file_text(errors))["contexts_lost"], 1);
    std::remove(errors.c_str());
}

TEST(LostContext, TheErrorOfALostContextReachesTheProgramOnce) {
    const Ran ran = lose("error");
    EXPECT_EQ(ran.exit_code, 0);
    EXPECT_EQ(ran.out, std::string("error 0507, then 0000\n") + kGoesOn);
}

TEST(LostContext, IsNoticedByTheLayerWhenTheProgramDoesNotAsk) {
    const Ran ran = lose("silent");
    EXPECT_EQ(ran.exit_code, 0);
    EXPECT_EQ(ran.out, kGoesOn);
}
