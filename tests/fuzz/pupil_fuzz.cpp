// Any picture: a pupil that is found has finite, plausible numbers.
//
// Input: preset, two bytes of size, radii, a byte that stretches the pixels, then pixels (repeated until the picture is
// full); or, with the stretch byte 0, a motion-JPEG frame.
#include <cmath>
#include <vector>

#include "drivers/camera/pupil_detector.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace fovea::drivers::camera;
    fovea::fuzz::Input in(data, size);
    PupilSettings settings;
    settings.preset = static_cast<PupilPreset>(in.take<std::uint8_t>() % 4);
    const int width = 24 + in.take<std::uint8_t>() % 48, height = 24 + in.take<std::uint8_t>() % 48;
    settings.min_radius_px = in.take<std::uint8_t>() / 4.0;
    settings.max_radius_px = in.take<std::uint8_t>() / 2.0;
    const auto stretch = in.take<std::uint8_t>();
    static GreyConverter converter;
    GreyImage image;
    std::vector<std::uint8_t> pixels;
    if (stretch == 0) {
        image = converter.convert(in.rest(), PixelFormat::mjpg, width, height, 0);
    } else if (!in.rest().empty()) {
        pixels.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
        for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = in.rest()[i / stretch % in.rest().size()];
        image = {pixels.data(), width, height, width};
    }
    PupilDetector detector(settings);
    const PupilResult r = detector.detect(image);
    if (!r.found) return 0;
    const PupilEllipse& e = r.ellipse;
    FOVEA_FUZZ_CHECK(std::isfinite(e.x) && std::isfinite(e.y) && std::isfinite(e.angle_rad));
    FOVEA_FUZZ_CHECK(e.a >= e.b && e.b > 0 && e.a < 400);
    FOVEA_FUZZ_CHECK(r.confidence >= 0 && r.confidence <= 1 && r.glint_count >= 0 && r.glint_count <= 2);
    return 0;
}
