// Runs a sample of Arm's OpenGL ES SDK (tutorials Multiview and FoveatedRendering: four views, two wide and two narrow)
// without Android: a pbuffer in place of the window, the sample's own functions for its start and its frames, and then a look
// at what its four layers and the picture hold. Arm's code comes from a checkout (FOVEA_ARM_SDK, docs/layer.md) and is compiled
// as it is. usage: layer_arm_multiview|layer_arm_foveated [PICTURE.ppm]
//
// It ends with 1 at a GL error (Arm's own check) or where something is missing. Binary assets that the checkout lacks
// (FoveatedRendering: its room and textures) are replaced by a box with checkered walls.
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GLES3/gl3.h>
#include <jni.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

// The sample's own.
extern GLuint frameBufferTextureId, fboWidth, fboHeight;
#ifdef FOVEA_ARM_FOVEATED
extern std::string assetFolder;
bool setupGraphics(int width, int height);
extern "C" void Java_com_arm_malideveloper_openglessdk_foveatedrendering_NativeLibrary_step(JNIEnv*, jobject);
static constexpr int kWidth = 1280, kHeight = 640;
static constexpr double kRatio = 0.3;  // of the inset's field to the wide one's
static constexpr bool kMasked = true;
#else
extern "C" void Java_com_arm_malideveloper_openglessdk_multiview_NativeLibrary_init(JNIEnv*, jobject, jint, jint);
extern "C" void Java_com_arm_malideveloper_openglessdk_multiview_NativeLibrary_step(JNIEnv*, jobject);
static constexpr int kWidth = 1280, kHeight = 720;
static constexpr double kRatio = 0.5;
static constexpr bool kMasked = false;
#endif

namespace {

constexpr int kViews = 4;
namespace fs = std::filesystem;

[[noreturn]] void fail(const char* what) {
    std::fprintf(stderr, "%s\n", what);
    std::exit(1);
}

struct Image {
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgba;
    Image(int w, int h) : width(w), height(h), rgba(static_cast<std::size_t>(w) * static_cast<std::size_t>(h) * 4) {}
    [[nodiscard]] double at(int x, int y, int channel) const {
        x = (x + width) % width, y = (y + height) % height;  // the samples' textures repeat
        return rgba[(static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) * 4 + static_cast<std::size_t>(channel)];
    }
    // u, v in 0 to 1; bilinear.
    [[nodiscard]] double sample(double u, double v, int channel) const {
        const double x = u * width - 0.5, y = v * height - 0.5, x0 = std::floor(x), y0 = std::floor(y), fx = x - x0, fy = y - y0;
        const int i = static_cast<int>(x0), j = static_cast<int>(y0);
        return (at(i, j, channel) * (1 - fx) + at(i + 1, j, channel) * fx) * (1 - fy) + (at(i, j + 1, channel) * (1 - fx) + at(i + 1, j + 1, channel) * fx) * fy;
    }
    void read() { glReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data()); }
};

void open_pbuffer() {
    const EGLint wanted[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_ES3_BIT, EGL_RED_SIZE, 8, EGL_GREEN_SIZE, 8,
                             EGL_BLUE_SIZE, 8, EGL_ALPHA_SIZE, 8, EGL_DEPTH_SIZE, 24, EGL_NONE};
    const EGLint size[] = {EGL_WIDTH, kWidth, EGL_HEIGHT, kHeight, EGL_NONE}, version[] = {EGL_CONTEXT_CLIENT_VERSION, 3, EGL_NONE};
    const EGLDisplay display = eglGetPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, nullptr, nullptr);
    EGLConfig config = nullptr;
    EGLint count = 0;
    if (!eglInitialize(display, nullptr, nullptr) || !eglChooseConfig(display, wanted, &config, 1, &count) || count < 1) fail("no EGL config");
    const EGLContext context = eglCreateContext(display, config, EGL_NO_CONTEXT, version);
    const EGLSurface surface = eglCreatePbufferSurface(display, config, size);
    if (!eglMakeCurrent(display, surface, surface, context)) fail("no context");
}

#ifdef FOVEA_ARM_FOVEATED
void write(const fs::path& path, const std::string& bytes) { std::ofstream(path, std::ios::binary) << bytes; }

// A box around the camera in the layout of the SDK's .geom files, its tangents in a .geomtan, and plain textures.
void write_stand_ins(const fs::path& folder) {
    std::string geometry = "geom", positions, coordinates, normals, indices, tangents = "geomtan";
    const auto number = [](std::string& to, auto value) { to.append(reinterpret_cast<const char*>(&value), sizeof value); };
    const auto vector = [&](std::string& to, const std::array<float, 3>& v) { for (const float f : v) number(to, f); };
    std::uint32_t vertices = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
        for (const float side : {-1.0f, 1.0f}) {
            for (std::uint32_t corner = 0; corner < 4; ++corner) {
                const float a = corner & 1 ? 1.0f : -1.0f, b = corner & 2 ? 1.0f : -1.0f;
                std::array<float, 3> at{}, out{}, along{};
                at[axis] = 300 * side, at[(axis + 1) % 3] = 300 * a, at[(axis + 2) % 3] = 300 * b;
                out[axis] = -side, along[(axis + 1) % 3] = 1;
                vector(positions, at), vector(normals, out), vector(tangents, along), vector(coordinates, {2 * a, 2 * b, 0});
            }
            for (const std::uint32_t i : {0u, 1u, 2u, 2u, 1u, 3u}) number(indices, vertices + i);
            vertices += 4;
        }
    number(geometry, std::uint32_t{1 | 1 << 8 | 1 << 16});
    for (int i = 0; i < 16 + 6; ++i) number(geometry, 0.0f);  // a matrix and a bounding box that the sample does not use
    number(geometry, vertices);
    geometry += positions + coordinates + normals;
    number(geometry, std::uint32_t{12});
    write(folder / "room.geom", geometry + indices);
    write(folder / "room.geomtan", tangents);
    constexpr std::size_t kSize = 2048;
    for (const auto& [name, light, dark] : {std::tuple{"D", "\xf0\xe0\xc0", "\x60\x80\xa0"}, {"N", "\x80\x80\xff", "\x80\x80\xff"}, {"M", "\x40\xb0\x10", "\x40\xc0\x10"}, {"B", "\x80\x80\x80", "\x80\x80\x80"}}) {
        std::string texels;
        texels.reserve(kSize * kSize * 3);
        for (std::size_t y = 0; y < kSize; ++y)
            for (std::size_t x = 0; x < kSize; ++x) texels.append((x / 128 + y / 128) % 2 ? light : dark, 3);
        write(folder / ("T_Exterior_" + std::string(name) + ".raw"), texels);
    }
}

// What Android's package gives to the sample: the assets of the checkout, with stand-ins for those that it lacks.
fs::path unpack_assets() {
    std::string name = (fs::temp_directory_path() / "fovea_arm_XXXXXX").string();
    if (!mkdtemp(name.data())) fail("no temporary folder");
    const fs::path folder = name, assets = fs::path(FOVEA_ARM_SDK) / "samples/tutorials/FoveatedRendering/assets";
    bool all = true;
    for (const char* file : {"room.geom", "room.geomtan", "T_Exterior_D.raw", "T_Exterior_N.raw", "T_Exterior_M.raw", "T_Exterior_B.raw"}) all = all && fs::exists(assets / file);
    if (!all) write_stand_ins(folder);
    for (const auto& entry : fs::directory_iterator(assets))
        if (all || entry.path().extension() == ".vs" || entry.path().extension() == ".fs") fs::copy_file(entry.path(), folder / entry.path().filename(), fs::copy_options::overwrite_existing);
    std::printf("assets: %s\n", all ? "Arm's" : "Arm's shaders, a box for the room");
    return folder;
}
#endif

void start() {
#ifdef FOVEA_ARM_FOVEATED
    const fs::path folder = unpack_assets();
    assetFolder = folder.string() + "/";  // its init() names a folder of Android
    const bool started = setupGraphics(kWidth, kHeight);
    fs::remove_all(folder);
    if (!started) fail("the sample does not start");
#else
    Java_com_arm_malideveloper_openglessdk_multiview_NativeLibrary_init(nullptr, nullptr, kWidth, kHeight);
#endif
}

void step() {
#ifdef FOVEA_ARM_FOVEATED
    Java_com_arm_malideveloper_openglessdk_foveatedrendering_NativeLibrary_step(nullptr, nullptr);
#else
    Java_com_arm_malideveloper_openglessdk_multiview_NativeLibrary_step(nullptr, nullptr);
#endif
}

// Where the sample's second pass takes a point of an eye from: 0 the wide view, 1 the inset; -1: neither is exact there.
double share_of_inset(double distance2) {
#ifdef FOVEA_ARM_FOVEATED
    return distance2 > 0.28 ? 0 : distance2 < 0.22 ? 1 : -1;  // a ring of another colour between
#else
    const double t = std::clamp((distance2 - 0.04) / (0.25 - 0.04), 0.0, 1.0);
    return 1 - t * t * (3 - 2 * t);
#endif
}

}  // namespace

int main(int argc, char** argv) {
    // The fragment shader of the room adds to a variable that it never sets: Mesa leaves what was in the register otherwise.
    setenv("glsl_zero_init", "true", 1);
    open_pbuffer();
    start();
    step();
    Image picture(kWidth, kHeight);
    picture.read();
    std::vector<Image> views;
    GLuint reader = 0;
    glGenFramebuffers(1, &reader);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, reader);
    for (int view = 0; view < kViews; ++view) {
        Image& image = views.emplace_back(static_cast<int>(fboWidth), static_cast<int>(fboHeight));
        glFramebufferTextureLayer(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, frameBufferTextureId, 0, view);
        image.read();
        // The first frame is cleared to transparent black.
        long drawn = 0, between = 0;
        for (std::size_t i = 3; i < image.rgba.size(); i += 4) drawn += image.rgba[i] != 0, between += image.rgba[i] != 0 && image.rgba[i] != 255;
        std::printf("view %d: %.0f of 100 drawn, middle %d, corner %d, edges antialiased %d\n", view, 100.0 * static_cast<double>(drawn) / static_cast<double>(image.rgba.size() / 4),
                    image.at(image.width / 2, image.height / 2, 3) > 0, image.at(0, 0, 3) > 0, between > 0);
    }
    glBindFramebuffer(GL_READ_FRAMEBUFFER, 0);
    for (int eye = 0; eye < 2; ++eye) {
        const Image &wide = views[static_cast<std::size_t>(eye)], &inset = views[static_cast<std::size_t>(eye) + 2];
        double zoom = 0, worst = 0;
        long compared = 0, holes = 0;
        const int width = kWidth / 2;
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < width; ++x) {
                const double u = (x + 0.5) / width, v = (y + 0.5) / kHeight, inner_u = (u - 0.5) / kRatio + 0.5, inner_v = (v - 0.5) / kRatio + 0.5;
                const double share = share_of_inset((inner_u - 0.5) * (inner_u - 0.5) + (inner_v - 0.5) * (inner_v - 0.5));
                if (share < 0) continue;
                const double covered = share * (share > 0 ? inset.sample(inner_u, inner_v, 3) : 0) + (1 - share) * wide.sample(u, v, 3);
                holes += picture.at(eye * width + x, y, 3) == 0 && (kMasked || covered > 64);  // every point has a wall behind it, or a cube
                for (int c = 0; c < 3; ++c) {
                    const double there = share > 0 ? inset.sample(inner_u, inner_v, c) : 0, around = wide.sample(u, v, c);
                    worst = std::max(worst, std::abs(picture.at(eye * width + x, y, c) - (share * there + (1 - share) * around)));
                    // Where both views show the scene (no mask, no edge between), the inset is the wide view enlarged.
                    if (share == 1 && wide.sample(u, v, 3) == 255 && inset.sample(inner_u, inner_v, 3) == 255) zoom += std::abs(there - around), ++compared;
                }
            }
        std::printf("eye %d: %ld holes, put together of both within %d of 255", eye, holes, worst <= 3 ? 3 : static_cast<int>(std::ceil(worst)));
        if (compared > 1000) std::printf(", both views alike within %d of 255 on the mean", static_cast<int>(std::ceil(zoom / static_cast<double>(compared))));
        std::printf("\n");
    }
    for (int frame = 0; frame < 30; ++frame) step();
    Image later(kWidth, kHeight);
    later.read();
    std::printf("moves: %d, GL error %04x\n", later.rgba != picture.rgba, glGetError());
    if (argc > 1) {
        std::ofstream file(argv[1], std::ios::binary);
        file << "P6\n" << kWidth << " " << kHeight << "\n255\n";
        for (int y = kHeight - 1; y >= 0; --y)
            for (int x = 0; x < kWidth; ++x)
                for (int c = 0; c < 3; ++c) file.put(static_cast<char>(later.at(x, y, c)));
    }
    return 0;
}
