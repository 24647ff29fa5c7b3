#include "render/layer/glsl_tokens.hpp"

#include <gtest/gtest.h>

using namespace fovea::layer;

namespace {

std::string words(std::string_view source) {
    std::string all;
    for (const Token& t : tokenize(source)) all += (all.empty() ? "" : " ") + (t.kind == Token::Kind::directive ? "<" + t.text + ">" : t.text);
    return all;
}

}  // namespace

TEST(GlslTokens, WordsNumbersAndSymbolsHaveTheirPlaces) {
    const std::string source = "a_1 = .5e-3 + 0x1Fu;";
    const auto tokens = tokenize(source);
    ASSERT_EQ(words(source), "a_1 = .5e-3 + 0x1Fu ;");
    for (const Token& t : tokens) EXPECT_EQ(source.substr(t.begin, t.end - t.begin), t.text);
    EXPECT_EQ(tokens[2].kind, Token::Kind::number);
    EXPECT_EQ(words("0xE+1"), "0xE + 1");  // no exponent in a hexadecimal number
    EXPECT_EQ(words("v.xyz*2."), "v . xyz * 2.");
}

TEST(GlslTokens, CommentsAreNoTokens) {
    EXPECT_EQ(words("a /* gl_FragCoord // */ b // gl_FragCoord\nc"), "a b c");
    EXPECT_EQ(words("a/**/b"), "a b");
    EXPECT_EQ(words("a /* never ends"), "a");
    EXPECT_EQ(words("a / b /*/ c */ d"), "a / b d");
}

TEST(GlslTokens, LineContinuationsJoinFromVersion300On) {
    EXPECT_EQ(words("#version 300 es\ngl_Frag\\\nCoord // one \\\n two\nx"), "<version> gl_FragCoord x");
    EXPECT_EQ(words("#version 300 es\r\ngl_Frag\\\r\nCoord"), "<version> gl_FragCoord");
    EXPECT_EQ(words("#version 100\na // comment \\\nb"), "<version> a b");  // version 100 has none
    const std::string source = "#version 300 es\nab\\\ncd;";
    const auto tokens = tokenize(source);
    EXPECT_EQ(source.substr(tokens[1].begin, tokens[1].end - tokens[1].begin), "ab\\\ncd");
}

TEST(GlslTokens, PreprocessorLinesAreOneTokenEach) {
    const auto tokens = tokenize("  # /* c */ extension GL_OVR_multiview2 : require // why\n#define A(x) \\\n x\nint a; # b");
    ASSERT_GE(tokens.size(), 1u);
    EXPECT_TRUE(tokens[0].is_directive("extension"));
    ASSERT_EQ(tokens[0].parts.size(), 3u);
    EXPECT_TRUE(tokens[0].parts[2].is("require"));
    EXPECT_EQ(words("int a; # b"), "int a ; # b");  // only where a line begins
    EXPECT_EQ(words("/* c */ #if 0\n#endif"), "<if> <endif>");
    EXPECT_EQ(words("#\nx"), "<> x");
}

TEST(GlslTokens, AMacroMentionsWhatItBringsIn) {
    EXPECT_TRUE(mentions(tokenize("#define P gl_FragCoord\nvoid main() {}"), "gl_FragCoord"));
    EXPECT_FALSE(mentions(tokenize("// gl_FragCoord\nfloat gl_FragCoords;"), "gl_FragCoord"));
}

TEST(GlslTokens, VersionIsReadFromItsLine) {
    EXPECT_EQ(glsl_version(tokenize("// hello\n#version 310 es\n")), 310);
    EXPECT_EQ(glsl_version(tokenize("void main() {}")), 100);
    EXPECT_EQ(glsl_version(tokenize("#version\n")), 100);
}

TEST(GlslTokens, AnyBytesEnd) {
    for (unsigned seed = 1; seed < 400; ++seed) {
        std::string source;
        unsigned state = seed * 2654435761u;
        for (int i = 0; i < 200; ++i) {
            state = state * 1664525u + 1013904223u;
            source += "\\\n\r/*# 0x.e+aA_;\"\xff"[state >> 24 & 15];
        }
        std::size_t last = 0;
        for (const Token& t : tokenize(source)) {
            EXPECT_GE(t.begin, last);
            EXPECT_GT(t.end, t.begin);
            EXPECT_LE(t.end, source.size());
            last = t.end;
        }
    }
}

TEST(GlslTokens, DepthOfAPixelIsNotItsPlaceInTheWindow) {
    const auto reads = [](const char* source) { return fovea::layer::reads_window_position(fovea::layer::tokenize(source)); };
    EXPECT_FALSE(reads("float fog = gl_FragCoord.z / gl_FragCoord . w;"));
    EXPECT_FALSE(reads("vec2 d = gl_FragCoord.pq + gl_FragCoord.ba; // gl_FragCoord.xy"));
    EXPECT_TRUE(reads("vec2 at = gl_FragCoord.xy;"));
    EXPECT_TRUE(reads("float a = gl_FragCoord.zy.x;"));
    EXPECT_TRUE(reads("float depth = gl_FragCoord.z; vec4 at = gl_FragCoord;"));
    EXPECT_TRUE(reads("float depth = gl_FragCoord[2];"));
    EXPECT_TRUE(reads("vec4 at = gl_FragCoord"));
    EXPECT_TRUE(reads("#define AT gl_FragCoord.st\nvec2 at = AT;"));
    EXPECT_FALSE(reads("#define DEPTH gl_FragCoord.z\nfloat depth = DEPTH;"));
    EXPECT_TRUE(reads("#define PLACE gl_FragCoord\nvec2 at = PLACE.xy;"));
}
