#include "tools/extrapolation_methods.hpp"

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "render/extrapolation/extrapolation.hpp"
#include "render/extrapolation/gl_extrapolator.hpp"
#include "render/gl/context.hpp"

namespace fovea::tools {

namespace {

using namespace fovea::render::extrapolation;

ConstImage picture(const SceneFrame& f) {
    return {reinterpret_cast<const std::byte*>(f.rgba.data()), f.size_px, f.size_px, f.size_px * 4, Format::rgba8};
}
Image picture(std::vector<std::uint8_t>& rgba, int size_px) { return {reinterpret_cast<std::byte*>(rgba.data()), size_px, size_px, size_px * 4, Format::rgba8}; }

std::shared_ptr<Extrapolator> engine(Preset preset) {
    auto e = Extrapolator::create({.preset = preset, .threads = 1});
    FOVEA_REQUIRE(e.has_value());
    return std::make_shared<Extrapolator>(std::move(*e));
}

// One context and three textures for all backends.
struct Driver {
    explicit Driver(gl::Context c) : context(std::move(c)) {
        static_cast<void>(load(gl, gl::driver_function));
        gl.GenTextures(3, textures);
        gl.GenFramebuffers(1, &framebuffer);
    }
    ~Driver() {
        gl.DeleteTextures(3, textures);
        gl.DeleteFramebuffers(1, &framebuffer);
    }
    Driver(const Driver&) = delete;
    Driver& operator=(const Driver&) = delete;

    void upload(const ExtrapolationInput& in) {
        const int n = in.src2->size_px;
        if (n != size_px) {   // immutable: a compute shader may store to it
            gl.DeleteTextures(3, textures);
            gl.GenTextures(3, textures);
            for (const GLuint t : textures) {
                gl.BindTexture(GL_TEXTURE_2D, t);
                gl.TexStorage2D(GL_TEXTURE_2D, 1, GL_RGBA8, n, n);
            }
            size_px = n;
        }
        for (int i = 0; i < 2; ++i) {
            gl.BindTexture(GL_TEXTURE_2D, textures[i]);
            gl.TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, n, n, GL_RGBA, GL_UNSIGNED_BYTE, (i == 0 ? in.src1 : in.src2)->rgba.data());
        }
        gl.Finish();
    }
    void read(std::vector<std::uint8_t>& rgba) {
        gl.BindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
        gl.FramebufferTexture2D(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, textures[2], 0);
        gl.ReadPixels(0, 0, size_px, size_px, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data());
        gl.BindFramebuffer(GL_READ_FRAMEBUFFER, 0);
    }

    gl::Context context;
    GlFunctions gl;
    GLuint textures[3] = {}, framebuffer = 0;
    int size_px = 0;
};

// Those that work here, `balanced` like the rows without a driver; none without a driver.
void add_backends(std::vector<ExtrapolationMethod>& methods) {
    auto context = gl::Context::create();
    if (!context) return;
    const auto driver = std::make_shared<Driver>(*std::move(context));
    for (const Backend b : {Backend::processor, Backend::compute, Backend::fragment}) {
        auto made = GlExtrapolator::create(gl::driver_function, {.preset = Preset::balanced, .threads = 1, .backend = b});
        if (!made) continue;
        const auto call = std::make_shared<GlExtrapolator>(std::move(*made));
        ExtrapolationMethod m{std::string("gl ") + backend_name(b), false, {}, {}, {}};
        m.before = [driver](const ExtrapolationInput& in) { driver->upload(in); };
        m.run = [driver, call](const ExtrapolationInput& in, std::vector<std::uint8_t>&) {
            static_cast<void>(call->extrapolate(driver->textures[0], driver->textures[1], driver->textures[2], in.factor));
            driver->gl.Finish();
        };
        m.after = [driver](std::vector<std::uint8_t>& rgba) { driver->read(rgba); };
        methods.push_back(std::move(m));
    }
}

void reproject(const ExtrapolationInput& in, std::vector<std::uint8_t>& rgba) {
    const int n = in.src2->size_px;
    const CameraTurn t = in.scene->turn(1 + static_cast<double>(in.factor), 1);
    const cv::Mat source(n, n, CV_8UC4, const_cast<std::uint8_t*>(in.src2->rgba.data()));
    // A pixel's direction at the output's time, seen at src2's time: a homography.
    const double f = n / 2.0, c = n / 2.0 - 0.5;
    const cv::Matx33d from_pixel(1 / f, 0, -c / f, 0, -1 / f, c / f, 0, 0, -1), to_pixel(-f, 0, c, 0, f, c, 0, 0, 1);
    const cv::Matx33d m(t.m[0][0], t.m[0][1], t.m[0][2], t.m[1][0], t.m[1][1], t.m[1][2], t.m[2][0], t.m[2][1], t.m[2][2]);
    cv::Mat out(n, n, CV_8UC4, rgba.data());
    cv::warpPerspective(source, out, to_pixel * m * from_pixel, out.size(), cv::INTER_CUBIC | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
}

// Optical flow from src2 back to src1, handed to the engine as known motion of `cell_px` cells.
struct FlowBaseline {
    FlowBaseline(std::function<void(const cv::Mat&, const cv::Mat&, cv::Mat&)> f, int cell) : flow(std::move(f)), cell_px(cell) {}
    std::function<void(const cv::Mat& from, const cv::Mat& to, cv::Mat& flow)> flow;
    int cell_px;
    std::shared_ptr<Extrapolator> warp = engine(Preset::balanced);
    cv::Mat grey1, grey2, motion;
    std::vector<float> cells;

    void operator()(const ExtrapolationInput& in, std::vector<std::uint8_t>& rgba) {
        const int n = in.src2->size_px, w = (n + cell_px - 1) / cell_px;
        cv::cvtColor(cv::Mat(n, n, CV_8UC4, const_cast<std::uint8_t*>(in.src1->rgba.data())), grey1, cv::COLOR_RGBA2GRAY);
        cv::cvtColor(cv::Mat(n, n, CV_8UC4, const_cast<std::uint8_t*>(in.src2->rgba.data())), grey2, cv::COLOR_RGBA2GRAY);
        motion.release();   // DIS would start from what it holds
        flow(grey2, grey1, motion);
        cells.resize(static_cast<std::size_t>(2 * w * w));
        for (int y = 0; y < w; ++y)
            for (int x = 0; x < w; ++x) {
                const auto& m = motion.at<cv::Vec2f>(std::min(y * cell_px + cell_px / 2, n - 1), std::min(x * cell_px + cell_px / 2, n - 1));
                cells[static_cast<std::size_t>(2 * (y * w + x))] = -m[0];
                cells[static_cast<std::size_t>(2 * (y * w + x) + 1)] = -m[1];
            }
        const KnownMotion known{cells.data(), nullptr, w, w};
        (void)warp->extrapolate(picture(*in.src1), picture(*in.src2), picture(rgba, n), in.factor, {.motion = &known});
    }
};

}  // namespace

std::vector<ExtrapolationMethod> extrapolation_methods() {
    cv::setNumThreads(1);
    std::vector<ExtrapolationMethod> methods;
    methods.push_back({"hold", true, [](const ExtrapolationInput& in, std::vector<std::uint8_t>& out) { out = in.src2->rgba; }, {}, {}});
    methods.push_back({"reprojection", true, reproject, {}, {}});
    for (const auto& [name, preset, cell] : {std::tuple{"dis-ultrafast", 0, 4}, std::tuple{"dis-fast", 1, 4}, std::tuple{"dis-medium", 2, 2}}) {
        auto dis = cv::DISOpticalFlow::create(preset);
        FlowBaseline b{[dis](const cv::Mat& from, const cv::Mat& to, cv::Mat& flow) { dis->calc(from, to, flow); }, cell};
        methods.push_back({name, true, b, {}, {}});
    }
    methods.push_back({"farneback", true, FlowBaseline{[](const cv::Mat& from, const cv::Mat& to, cv::Mat& flow) { cv::calcOpticalFlowFarneback(from, to, flow, 0.5, 5, 15, 3, 5, 1.2, 0); }, 4}, {}, {}});
    for (const Preset p : kPresets)
        methods.push_back({preset_name(p), false, [e = engine(p)](const ExtrapolationInput& in, std::vector<std::uint8_t>& out) {
                               (void)e->extrapolate(picture(*in.src1), picture(*in.src2), picture(out, in.src2->size_px), in.factor);
                           }, {}, {}});
    methods.push_back({"balanced+gaze", false, [e = engine(Preset::balanced)](const ExtrapolationInput& in, std::vector<std::uint8_t>& out) {
                           const auto n = static_cast<float>(in.src2->size_px);
                           const Gaze gaze{n / 2, n / 2, n / 16, 3 * n / 16};   // of 90 degrees: 7 and 21 around the centre
                           (void)e->extrapolate(picture(*in.src1), picture(*in.src2), picture(out, in.src2->size_px), in.factor, {.gaze = &gaze});
                       }, {}, {}});
    methods.push_back({"known-motion", false, [e = engine(Preset::balanced)](const ExtrapolationInput& in, std::vector<std::uint8_t>& out) {
                           const KnownMotion known{in.src2->motion_px.data(), in.src2->depth.data(), in.src2->size_px, in.src2->size_px};
                           (void)e->extrapolate(picture(*in.src1), picture(*in.src2), picture(out, in.src2->size_px), in.factor, {.motion = &known});
                       }, {}, {}});
    methods.push_back({"known-ahead", false, [e = engine(Preset::balanced)](const ExtrapolationInput& in, std::vector<std::uint8_t>& out) {
                           const KnownMotion known{in.src2->motion_px.data(), in.src2->depth.data(), in.src2->size_px, in.src2->size_px, in.src2->ahead_px.data()};
                           (void)e->extrapolate(picture(*in.src1), picture(*in.src2), picture(out, in.src2->size_px), in.factor, {.motion = &known});
                       }, {}, {}});
    add_backends(methods);
    return methods;
}

}  // namespace fovea::tools
