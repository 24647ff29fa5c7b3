// What the tools' pages are put together from.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tools/axis_ticks.hpp"
#include "tools/html_text.hpp"

namespace fovea::tools {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

TEST(HtmlText, Base64IsThatOfRfc4648) {
    const std::pair<const char*, const char*> vectors[] = {{"", ""}, {"f", "Zg=="}, {"fo", "Zm8="}, {"foo", "Zm9v"}, {"foob", "Zm9vYg=="}, {"fooba", "Zm9vYmE="}, {"foobar", "Zm9vYmFy"}};
    for (const auto& [bytes, text] : vectors) EXPECT_EQ(base64(bytes), text);
    EXPECT_EQ(base64(std::string("\xff\xfe\0\x80", 4)), "//4AgA==");
}

TEST(HtmlText, NothingOfAForeignNameBecomesMarkup) {
    EXPECT_EQ(escaped("<b a='1' c=\"2\">&amp;"), "&lt;b a=&#39;1&#39; c=&quot;2&quot;&gt;&amp;amp;");
    EXPECT_EQ(escaped("Vergr\u00f6\u00dferung"), "Vergr\u00f6\u00dferung");
}

TEST(AxisTicks, AreRoundAndInside) {
    const auto near = [](double v) { return DoubleNear(v, 1e-9); };
    EXPECT_THAT(axis_ticks(0, 41.6, false), ElementsAre(near(0), near(10), near(20), near(30), near(40)));
    EXPECT_THAT(axis_ticks(-0.15, 0.35, false), ElementsAre(near(-0.1), near(0), near(0.1), near(0.2), near(0.3)));
    EXPECT_THAT(axis_ticks(0.76, 68.9, true), ElementsAre(near(1), near(2), near(5), near(10), near(20), near(50)));
    // Of many decades the powers of ten alone; of less than a decade the marks of a linear axis.
    EXPECT_THAT(axis_ticks(0.5, 2e6, true), ElementsAre(near(1), near(10), near(100), near(1e3), near(1e4), near(1e5), near(1e6)));
    EXPECT_THAT(axis_ticks(975, 2019, true), ElementsAre(near(1000), near(1250), near(1500), near(1750), near(2000)));
}

TEST(AxisTicks, ZeroHasNoSign) {
    for (const double v : axis_ticks(0, 1, false)) EXPECT_FALSE(std::signbit(v)) << v;
}

TEST(AxisTicks, AnAxisWithoutALengthHasNone) {
    EXPECT_THAT(axis_ticks(1, 1, false), IsEmpty());
    EXPECT_THAT(axis_ticks(std::nan(""), 1, true), IsEmpty());
    EXPECT_THAT(axis_ticks(0, INFINITY, false), IsEmpty());
    EXPECT_THAT(axis_ticks(-1, 1, true), SizeIs(testing::Ge(3u)));
}

}  // namespace
}  // namespace fovea::tools
