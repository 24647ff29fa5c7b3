#include <epoxy/gl.h>
#include <gtest/gtest.h>
#include <png.h>

#include <filesystem>
#include <fstream>

#include "render/gl/png.hpp"
#include "tests/render/gl_fixture.hpp"

using namespace fovea;
using namespace fovea::test;

namespace {

using Context = GlTest;
using Objects = GlTest;

TEST_F(Context, OffersAtLeastEs31AndNamesItsRenderer) {
    const auto& info = context().info();
    EXPECT_TRUE(info.major > 3 || (info.major == 3 && info.minor >= 1));
    EXPECT_FALSE(info.renderer.empty());
    EXPECT_GE(info.max_texture_px, 2048);
}

TEST_F(Context, ASecondOneSharesObjectsAndLeavesTheFirstAlone) {
    const gl::Buffer buffer = gl::create_dynamic_buffer(16);
    {
        auto second = gl::Context::create(&context());
        ASSERT_TRUE(second.has_value()) << second.error().message();
        const std::uint32_t value = 7;
        gl::update_buffer(buffer, 0, std::as_bytes(std::span(&value, 1)));
        EXPECT_EQ(gl::pending_error(), "");
    }
    EXPECT_TRUE(context().make_current());
    EXPECT_TRUE(gl::RenderTarget::create({.width_px = 8, .height_px = 8}).has_value());
}

TEST_F(Objects, AShaderThatDoesNotCompileSaysWhichLine) {
    const auto p = gl::build_program("broken", "#version 310 es\nvoid main() { gl_Position = vec4(0); }",
                                     "#version 310 es\nprecision highp float;\nout vec4 c;\nvoid main() { c = nonsense; }");
    ASSERT_FALSE(p.has_value());
    EXPECT_NE(p.error().message().find("'broken'"), std::string::npos);
    EXPECT_NE(p.error().message().find("fragment"), std::string::npos);
    EXPECT_NE(p.error().message().find("nonsense"), std::string::npos);
    EXPECT_NE(p.error().message().find("4: void main"), std::string::npos);
}

TEST_F(Objects, ShadersThatDoNotFitEachOtherDoNotLink) {
    const auto p = gl::build_program("split", "#version 310 es\nout vec2 a;\nvoid main() { a = vec2(0); gl_Position = vec4(0); }",
                                     "#version 310 es\nprecision highp float;\nin vec3 a;\nout vec4 c;\nvoid main() { c = a.xyzz; }");
    EXPECT_FALSE(p.has_value());
}

TEST_F(Objects, AnImpossibleTargetIsAnErrorThatNamesTheLimit) {
    const auto t = gl::RenderTarget::create({.width_px = 1 << 20, .height_px = 4});
    ASSERT_FALSE(t.has_value());
    EXPECT_NE(t.error().way_out.find("1 to "), std::string::npos);
    EXPECT_FALSE(gl::RenderTarget::create({.width_px = 0, .height_px = 4}).has_value());
}

TEST_F(Objects, AFenceIsPassedAndTellsWhen) {
    SystemTime time;
    const Instant before = time.now();
    gl::Fence fence = gl::Fence::insert();
    const auto passed = fence.wait(time);
    ASSERT_TRUE(passed.has_value());
    EXPECT_GE(*passed, before);
    EXPECT_FALSE(gl::Fence().wait(time).has_value());
}

// A driver may find that an image is still being sampled, and not look on to see that it is being drawn to as well.
TEST_F(Objects, ReadingWaitsForAnImageThatIsSampledAndThenDrawnTo) {
    const std::string busy = "vec2 p = ndc; for (int i = 0; i < 200; ++i) p = fract(p * 1.31 + sin(p.yx * 3.0)); ";
    const QuadDraw sampling(busy + "color = texture(image, ndc * 0.5 + 0.5) + vec4(p * 1e-6, 0.0, 0.0);", {.more_outputs = "layout(binding = 0) uniform highp sampler2D image;\n"});
    const QuadDraw drawing(busy + "color = vec4(1.0, p * 1e-6, 1.0);"), other("color = vec4(0.0);");
    const Views a(128, 128), b(128, 128), c(8, 8);
    const auto full = *foveation::create_method("full", {});
    for (int i = 0; i < 5; ++i) {
        full->submit(other.list(), a.targets, a.focus);
        glActiveTexture(GL_TEXTURE0);
        glBindTexture(GL_TEXTURE_2D, a.owned[0].color_texture());
        full->submit(sampling.list(), b.targets, b.focus);
        glBindTexture(GL_TEXTURE_2D, 0);
        gl::flush();
        full->submit(drawing.list(), a.targets, a.focus);
        full->submit(other.list(), c.targets, c.focus);
        const Pixels got = read(a.targets[0]);
        for (std::size_t k = 0; k < got.size(); k += 4) ASSERT_EQ(got[k], 255) << "not yet drawn: pixel " << k / 4;
    }
}

TEST(Png, WritesWhatLibpngReadsBack) {
    const auto path = std::filesystem::path(testing::TempDir()) / "fovea_png_test.png";
    const std::vector<std::uint8_t> rgb{255, 0, 0, 0, 255, 0, 0, 0, 255, 9, 8, 7, 6, 5, 4, 3, 2, 1};
    ASSERT_TRUE(gl::write_png(path, {3, 2, rgb}).has_value());
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    ASSERT_NE(png_image_begin_read_from_file(&image, path.c_str()), 0);
    image.format = PNG_FORMAT_RGB;
    std::vector<std::uint8_t> back(PNG_IMAGE_SIZE(image));
    ASSERT_NE(png_image_finish_read(&image, nullptr, back.data(), 0, nullptr), 0);
    EXPECT_EQ(back, rgb);
    std::filesystem::remove(path);
}

TEST(Png, LeavesNothingBehindWhenItCannotWrite) {
    const std::vector<std::uint8_t> rgb(3);
    const auto missing = std::filesystem::path(testing::TempDir()) / "no_such_directory" / "a.png";
    const auto r = gl::write_png(missing, {1, 1, rgb});
    ASSERT_FALSE(r.has_value());
    EXPECT_NE(r.error().message().find("no_such_directory"), std::string::npos);
    // A directory in the place of the file: the finished image cannot be moved there.
    const auto taken = std::filesystem::path(testing::TempDir()) / "fovea_png_taken";
    std::filesystem::create_directories(taken / "inside");
    EXPECT_FALSE(gl::write_png(taken, {1, 1, rgb}).has_value());
    for (const auto& entry : std::filesystem::directory_iterator(testing::TempDir()))
        EXPECT_EQ(entry.path().string().find("fovea_png_taken.part"), std::string::npos);
    std::filesystem::remove_all(taken);
}

TEST_F(Objects, ACommandListLeavesOutWhatCannotBeSeen) {
    const QuadDraw quad(kPattern);
    gl::CommandList list;
    list.begin({}, {});
    gl::Draw d = quad.list().draws()[0];
    d.bounds[0] = {-1, -1, -0.5f, -0.5f};
    list.add(d);
    d.bounds[0] = {0.5f, 0.5f, 1, 1};
    list.add(d);
    d.bounds[0] = {0, 0, 0, 0};   // behind the view
    list.add(d);
    const Views v(16, 16);
    const gl::Box left{-1, -1, 0, 0}, nowhere{-0.4f, -0.4f, 0.4f, 0.4f};
    EXPECT_EQ(list.submit({}), 2u);
    EXPECT_EQ(list.submit({.only_in = {&left, 1}}), 1u);
    EXPECT_EQ(list.submit({.only_in = {&nowhere, 1}}), 0u);
    EXPECT_EQ(list.triangles(), 6u);
}

}  // namespace
