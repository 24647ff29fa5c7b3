#include "render/viewer/text.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace fovea::viewer {
namespace {
constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
constexpr double kCapitalPx = 21;   // height of a capital of this font at scale 1
const cv::Scalar kGround{14, 16, 22, 190}, kInk{235, 238, 245, 255};
}  // namespace

TextPicture draw_text(std::span<const std::string> lines, int line_px) {
    const int line = std::clamp(line_px, 8, 200), pad = line / 2;
    const double scale = line * 0.55 / kCapitalPx;
    const int stroke = std::max(1, line / 18);
    int width = 1;
    for (const std::string& s : lines) width = std::max(width, cv::getTextSize(s, kFont, scale, stroke, nullptr).width);
    cv::Mat image(static_cast<int>(lines.size()) * line + pad, width + 2 * pad, CV_8UC4, kGround);
    int y = pad / 2;
    for (const std::string& s : lines) {
        y += line;
        cv::putText(image, s, {pad, y - line / 4}, kFont, scale, kInk, stroke, cv::LINE_AA);
    }
    cv::flip(image, image, 0);
    return {image.cols, image.rows, {image.datastart, image.dataend}};
}

}  // namespace fovea::viewer
