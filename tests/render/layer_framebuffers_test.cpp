// Framebuffers with all their layers attached at once, foveated layer by layer.
#include "render/gl/layer_framebuffers.hpp"

#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include "tests/render/surfaces.hpp"

using namespace fovea;
using namespace fovea::test;

namespace {

constexpr int kSize = 96, kLayers = 3;

struct Layered {
    gl::Framebuffer framebuffer;
    gl::Texture color, depth;
};

class LayerFramebuffersTest : public GlTest {
protected:
    void SetUp() override {
        GlTest::SetUp();
        if (context().info().minor < 2) GTEST_SKIP() << context().info().version << " has no layered framebuffers";
    }
    static Layered make(GLenum target) {
        Layered l;
        GLuint name = 0;
        const auto texture = [&](GLenum format) {
            glGenTextures(1, &name);
            glBindTexture(target, name);
            if (target == GL_TEXTURE_CUBE_MAP) glTexStorage2D(target, 1, format, kSize, kSize);
            else glTexStorage3D(target, 1, format, kSize, kSize, kLayers);
            glTexParameteri(target, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
            glBindTexture(target, 0);
            return gl::Texture(name);
        };
        l.color = texture(GL_RGBA8);
        l.depth = texture(GL_DEPTH24_STENCIL8);
        glGenFramebuffers(1, &name);
        l.framebuffer = gl::Framebuffer(name);
        glBindFramebuffer(GL_FRAMEBUFFER, name);
        glFramebufferTexture(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, l.color.name(), 0);
        glFramebufferTexture(GL_FRAMEBUFFER, GL_DEPTH_STENCIL_ATTACHMENT, l.depth.name(), 0);
        EXPECT_EQ(glCheckFramebufferStatus(GL_FRAMEBUFFER), GLenum{GL_FRAMEBUFFER_COMPLETE});
        return l;
    }
};

TEST_F(LayerFramebuffersTest, EveryLayerIsSharpWhereItsOwnFocalPointIs) {
    const QuadDraw quad(kPattern);
    foveation::MethodSettings settings;
    settings.resolver = foveation::Resolver::gpu;   // the processor's cannot reach a cube's faces, and rounds otherwise
    for (const GLenum kind : {GLenum{GL_TEXTURE_2D_ARRAY}, GLenum{GL_TEXTURE_CUBE_MAP}}) {
        const Layered app = make(kind);
        const auto layers = gl::LayerFramebuffers::create(app.framebuffer.name());
        ASSERT_TRUE(layers.has_value()) << layers.error().message();
        ASSERT_EQ(layers->size(), kind == GL_TEXTURE_CUBE_MAP ? 6u : kLayers + 0u);
        std::vector<foveation::ViewTarget> targets;
        std::vector<foveation::ViewFocus> focus(3);
        for (std::size_t i = 0; i < 3; ++i) {
            targets.push_back({(*layers)[i], 0, 0, kSize, kSize});
            focus[i].points[0] = {-0.6f + 0.6f * static_cast<float>(i), 0.5f - 0.5f * static_cast<float>(i), 7, 7, 0};
            focus[i].count = 1;
        }
        auto m = *foveation::create_method("scaled_bins", settings);
        const auto ready = m->prepare(targets);
        ASSERT_TRUE(ready.has_value()) << ready.error().message();
        EXPECT_FALSE(m->submit(quad.list(), targets, focus).fell_back);
        for (std::size_t i = 0; i < 3; ++i) {
            const Surface alone = color_surface(kSize);
            auto one = make_method("scaled_bins", alone, settings);
            one->submit(quad.list(), {&alone.target, 1}, {&focus[i], 1});
            EXPECT_EQ(read(targets[i]), read(alone.target)) << "layer " << i << " is what a view alone would be";
        }
        // The app's own framebuffer holds the pictures: its first layer is read back.
        EXPECT_EQ(read({app.framebuffer.name(), 0, 0, kSize, kSize}), read(targets[0]));
    }
}

TEST_F(LayerFramebuffersTest, ALayeredFramebufferGivenAsOneViewIsRefusedWithTheWayOut) {
    const Layered app = make(GL_TEXTURE_2D_ARRAY);
    const foveation::ViewTarget all{app.framebuffer.name(), 0, 0, kSize, kSize};
    for (const char* method : {"scaled_bins", "inset_outset", "full"}) {
        const auto ready = (*foveation::create_method(method, {}))->prepare({&all, 1});
        ASSERT_FALSE(ready.has_value()) << method;
        EXPECT_NE(ready.error().message().find("LayerFramebuffers"), std::string::npos) << ready.error().message();
    }
    const Surface plain = color_surface(kSize);
    const auto none = gl::LayerFramebuffers::create(plain.target.framebuffer);
    ASSERT_FALSE(none.has_value());
    EXPECT_NE(none.error().message().find("with all its layers"), std::string::npos);
}

}  // namespace
