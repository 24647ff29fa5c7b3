#include "daemon/pipeline/uncertainty.hpp"

#include <array>
#include <numbers>

namespace fovea::pipeline {
namespace {

struct RowDegrees {
    std::array<float, kHorizons_ns.size()> r68, r95;
};
// Horizons:      0     10    20    30    40    50    60    70    85    100   125   150 ms
constexpr RowDegrees kFixation = {{.12f, .17f, .25f, .33f, .40f, .47f, .54f, .62f, .72f, .82f, .98f, 1.15f},
                                  {.6f, .9f, 1.4f, 2.0f, 2.6f, 3.3f, 4.0f, 4.6f, 5.6f, 6.5f, 8.0f, 9.5f}};
constexpr RowDegrees kSaccade = {{.6f, 1.7f, 3.0f, 4.2f, 5.0f, 5.8f, 6.3f, 6.8f, 7.4f, 8.0f, 8.6f, 9.2f},
                                 {1.8f, 5.3f, 9.1f, 11.9f, 14.6f, 17.2f, 18.4f, 19.4f, 20.5f, 21.5f, 22.5f, 23.5f}};
constexpr RowDegrees kBlind = {{1.5f, 1.5f, 1.6f, 1.7f, 1.8f, 1.9f, 2.0f, 2.2f, 2.5f, 2.8f, 3.3f, 3.8f},
                               {6.0f, 6.2f, 6.5f, 7.0f, 7.5f, 8.0f, 8.5f, 9.0f, 9.7f, 10.5f, 11.7f, 13.0f}};
constexpr double kDegree = std::numbers::pi / 180;

}  // namespace

Radii uncertainty(GazeEvent event, std::size_t horizon) noexcept {
    const RowDegrees& row = event == GazeEvent::saccade                                   ? kSaccade
                            : event == GazeEvent::blink || event == GazeEvent::lost ? kBlind
                                                                                          : kFixation;
    return {static_cast<double>(row.r68[horizon]) * kDegree, static_cast<double>(row.r95[horizon]) * kDegree};
}

}  // namespace fovea::pipeline
