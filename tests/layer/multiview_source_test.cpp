#include "render/layer/multiview_source.hpp"

#include <gtest/gtest.h>

using namespace fovea::layer;

namespace {

std::string rewritten(std::string_view source) {
    const auto result = rewrite_multiview(source);
    return result ? result->text : "(as it is)";
}

constexpr const char* kMacros = "#define fovea_OVR_multiview 1\n#define fovea_OVR_multiview2 1\n#line 2\n";

}  // namespace

TEST(MultiviewSource, LeavesOtherShadersAlone) {
    EXPECT_FALSE(rewrite_multiview("#version 300 es\nvoid main() {}\n"));
    EXPECT_FALSE(rewrite_multiview("#version 300 es\n// GL_OVR_multiview2\nvoid main() {}\n"));
    EXPECT_FALSE(rewrite_multiview("#extension GL_OVR_multiview : require\nvoid main() {}\n"));  // version 100
}

TEST(MultiviewSource, ViewIdBecomesAUniformAndLinesKeepTheirNumbers) {
    EXPECT_EQ(rewritten("#version 300 es\n#extension GL_OVR_multiview2 : require\nlayout(num_views = 2) in;\nint f() { return int(gl_ViewID_OVR); }\n"),
              "#version 300 es\n" + std::string(kMacros) + "\nuniform mediump uint fovea_ViewID;\n#line 3\n \nint f() { return int(fovea_ViewID); }\n");
}

TEST(MultiviewSource, NumViewsIsReadThroughMacrosCommentsAndContinuations) {
    const auto views = [](const char* body) {
        const auto r = rewrite_multiview(std::string("#version 310 es\n#extension GL_OVR_multiview : enable\n") + body);
        return r ? r->num_views : -1;
    };
    EXPECT_EQ(views("layout(num_views = 4) in;"), 4);
    EXPECT_EQ(views("layout /* a */ ( num_\\\nviews /* = 3 */ = 0x2u ) in ; // end"), 2);
    EXPECT_EQ(views("#define N 3\n#define VIEWS N\nlayout(num_views=VIEWS) in;"), 3);
    EXPECT_EQ(views("layout(location = 0) in vec4 a;"), 0);
    EXPECT_EQ(views("layout(num_views = 2) in; layout(num_views = 2) in;"), 2);
}

TEST(MultiviewSource, WhatTheExtensionForbidsBecomesAnErrorLine) {
    for (const char* body : {"layout(num_views = 0) in;", "layout(num_views = 17) in;", "layout(num_views = many) in;",
                             "layout(num_views = 2) in; layout(num_views = 3) in;", "#define A B\n#define B A\nlayout(num_views = A) in;"})
        EXPECT_NE(rewritten(std::string("#version 300 es\n#extension GL_OVR_multiview2 : enable\n") + body).find("#error"), std::string::npos) << body;
}

TEST(MultiviewSource, MacrosOfTheExtensionAreDefinedAndItsLineMayBeConditional) {
    const std::string text = rewritten("#version 300 es\n#ifdef GL_OVR_multiview2\n#extension GL_OVR_multiview2 : enable\n#else\n#error no\n#endif\n"
                                       "precision highp float;\nvec4 v = vec4(gl_ViewID_OVR);\n");
    EXPECT_NE(text.find("#ifdef fovea_OVR_multiview2\n\n#else"), std::string::npos) << text;
    EXPECT_NE(text.find("#endif\nuniform mediump uint fovea_ViewID;\n#line 7\nprecision"), std::string::npos) << text;
}

TEST(MultiviewSource, ADisabledExtensionTakesNoLayoutAway) {
    const auto r = rewrite_multiview("#version 300 es\n#extension GL_OVR_multiview2 : disable\nlayout(num_views = 2) in;\n");
    ASSERT_TRUE(r);
    EXPECT_EQ(r->num_views, 0);
    EXPECT_NE(r->text.find("num_views"), std::string::npos);  // the driver reports it
}

TEST(MultiviewSource, OtherQualifiersOfTheSameLayoutStay) {
    EXPECT_NE(rewritten("#version 320 es\n#extension GL_OVR_multiview2 : enable\nlayout(num_views = 2, other = 1) in;").find("layout(  other = 1) in;"), std::string::npos);
    EXPECT_NE(rewritten("#version 320 es\n#extension GL_OVR_multiview2 : enable\nlayout(other = 1, num_views = 2) in;").find("layout(other = 1 ) in;"), std::string::npos);
}
