#include "drivers/camera/glint_finder.hpp"

#include <algorithm>
#include <cmath>

namespace fovea::drivers::camera {

std::size_t GlintFinder::root(std::size_t run) noexcept {
    while (runs_[run].patch != run) run = runs_[run].patch = runs_[runs_[run].patch].patch;
    return run;
}

std::span<const Glint> GlintFinder::find(const GreyImage& image, double level) {
    runs_.clear();
    found_.clear();
    const int least = static_cast<int>(std::ceil(std::clamp(level, 0.0, 256.0)));
    std::size_t above = 0, above_end = 0;   // the runs of the row before
    for (int y = 0; y < image.height; ++y) {
        const std::uint8_t* row = image.pixels + y * image.stride;
        const std::size_t begin = runs_.size();
        int brightest = 0;
        for (int x = 0; x < image.width; ++x) brightest = std::max<int>(brightest, row[x]);
        for (int x = 0; brightest >= least && x < image.width;) {
            if (row[x] < least) { ++x; continue; }
            const int from = x;
            while (x < image.width && row[x] >= least) ++x;
            const std::size_t here = runs_.size();
            runs_.push_back({y, from, x, here});
            while (above < above_end && runs_[above].to < from) ++above;   // ended before this one's corner
            for (std::size_t i = above; i < above_end && runs_[i].from <= x; ++i) {
                const std::size_t a = root(i), b = root(here);
                runs_[std::max(a, b)].patch = std::min(a, b);
            }
        }
        above = begin;
        above_end = runs_.size();
    }
    place_.resize(runs_.size());
    for (std::size_t i = 0; i < runs_.size(); ++i) {
        const std::size_t first = root(i);
        if (first == i) {
            place_[i] = found_.size();
            found_.push_back({});
        }
        Glint& g = found_[place_[first]];
        const Run& r = runs_[i];
        const double n = r.to - r.from;
        g.area_px += n;
        g.x += n * 0.5 * (r.from + r.to - 1);
        g.y += n * r.y;
    }
    for (Glint& g : found_) g.x /= g.area_px, g.y /= g.area_px;
    return found_;
}

}  // namespace fovea::drivers::camera
