#include "tools/image_quality.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>
#include <opencv2/quality.hpp>

#include "protocol/error.hpp"

namespace fovea::tools {
namespace {

// OpenCV reads only; its interface knows no const.
cv::Mat picture(std::span<const std::uint8_t> bytes, int width, int height, int type) {
    FOVEA_REQUIRE(bytes.size() == static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * static_cast<std::size_t>(CV_MAT_CN(type)));
    return {height, width, type, const_cast<std::uint8_t*>(bytes.data())};
}

double to_psnr_db(double mean_square) {
    return mean_square > 0 ? std::min(kSamePicturePsnr_db, 10 * std::log10(255.0 * 255.0 / mean_square)) : kSamePicturePsnr_db;
}

double mean_of(const cv::Scalar& s) { return (s[0] + s[1] + s[2]) / 3; }

cv::Mat luma(const cv::Mat& rgba) {
    cv::Mat out;
    cv::cvtColor(rgba, out, cv::COLOR_RGBA2GRAY);
    return out;
}

cv::Mat colours(const cv::Mat& rgba) {
    cv::Mat out;
    cv::cvtColor(rgba, out, cv::COLOR_RGBA2RGB);
    return out;
}

}  // namespace

double psnr_db(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b) {
    const int pixels = static_cast<int>(a.size() / 4);
    cv::Mat map;
    return to_psnr_db(mean_of(cv::quality::QualityMSE::compute(colours(picture(a, pixels, 1, CV_8UC4)), colours(picture(b, pixels, 1, CV_8UC4)), map)));
}

double ssim(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b, int width, int height) {
    cv::Mat map;
    return cv::quality::QualitySSIM::compute(luma(picture(a, width, height, CV_8UC4)), luma(picture(b, width, height, CV_8UC4)), map)[0];
}

Similarity similarity(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b, int width, int height, std::span<const std::uint8_t> mask) {
    const cv::Mat where = picture(mask, width, height, CV_8UC1);
    if (cv::countNonZero(where) == 0) return {};
    const cv::Mat pa = picture(a, width, height, CV_8UC4), pb = picture(b, width, height, CV_8UC4);
    cv::Mat squares, structure;   // of every pixel
    static_cast<void>(cv::quality::QualityMSE::compute(colours(pa), colours(pb), squares));
    static_cast<void>(cv::quality::QualitySSIM::compute(luma(pa), luma(pb), structure));
    return {to_psnr_db(mean_of(cv::mean(squares, where))), cv::mean(structure, where)[0]};
}

}  // namespace fovea::tools
