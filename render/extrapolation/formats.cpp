#include <bit>
#include <cstring>

#include "render/extrapolation/sources.hpp"

namespace fovea::render::extrapolation {

namespace {

float half_to_float(std::uint16_t h) noexcept {
    const std::uint32_t sign = static_cast<std::uint32_t>(h & 0x8000u) << 16, magnitude = h & 0x7fffu;
    // Exponent and fraction in place, then scaled by 2^112: subnormals come out right without a branch.
    const float scaled = std::bit_cast<float>(magnitude << 13) * 0x1p112f;
    const std::uint32_t special = magnitude >= 0x7c00u ? 0x7f800000u | (magnitude & 0x3ffu) << 13 : std::bit_cast<std::uint32_t>(scaled);
    return std::bit_cast<float>(sign | special);
}

// Round to nearest, ties to even. Exact, NaN payload included, for what came from half_to_float.
std::uint16_t float_to_half(float f) noexcept {
    const std::uint32_t bits = std::bit_cast<std::uint32_t>(f), sign = bits >> 16 & 0x8000u, magnitude = bits & 0x7fffffffu;
    if (magnitude > 0x7f800000u) {
        const std::uint32_t payload = magnitude >> 13 & 0x3ffu;
        return static_cast<std::uint16_t>(sign | 0x7c00u | (payload != 0 ? payload : 1u));
    }
    if (magnitude >= 0x477ff000u) return static_cast<std::uint16_t>(sign | 0x7c00u);   // from 65520 up
    if (magnitude < 0x38800000u) {   // subnormal: let the adder round
        const float sum = std::bit_cast<float>(magnitude) + 0.5f;
        return static_cast<std::uint16_t>(sign | (std::bit_cast<std::uint32_t>(sum) - std::bit_cast<std::uint32_t>(0.5f)));
    }
    const std::uint32_t odd = magnitude >> 13 & 1u;
    return static_cast<std::uint16_t>(sign | (magnitude - 0x38000000u + 0xfffu + odd) >> 13);
}

}  // namespace

const char* format_name(Format f) noexcept {
    constexpr const char* kNames[] = {"RGBA8", "RGB8", "R8", "RGBA16F", "RGB16F", "RGBA32F", "RGB32F"};
    return kNames[static_cast<int>(f)];
}

void unpack_row(const std::byte* row, Format format, int x0, int count, void* four_channels) noexcept {
    row += static_cast<std::ptrdiff_t>(x0) * bytes_per_pixel(format);
    auto* bytes = static_cast<std::uint8_t*>(four_channels);
    auto* floats = static_cast<float*>(four_channels);
    const auto* in = reinterpret_cast<const std::uint8_t*>(row);
    switch (format) {
        case Format::rgba8: std::memcpy(bytes, in, static_cast<std::size_t>(count) * 4); return;
        case Format::rgb8:
            for (int x = 0; x < count; ++x) {
                for (int c = 0; c < 3; ++c) bytes[4 * x + c] = in[3 * x + c];
                bytes[4 * x + 3] = 255;
            }
            return;
        case Format::r8:   // as grey, so that luma is the value
            for (int x = 0; x < count; ++x) {
                bytes[4 * x] = bytes[4 * x + 1] = bytes[4 * x + 2] = in[x];
                bytes[4 * x + 3] = 255;
            }
            return;
        case Format::rgba32f: std::memcpy(floats, in, static_cast<std::size_t>(count) * 16); return;
        case Format::rgb32f:
            for (int x = 0; x < count; ++x) {
                std::memcpy(floats + 4 * x, in + 12 * x, 12);
                floats[4 * x + 3] = 1;
            }
            return;
        case Format::rgba16f:
        case Format::rgb16f: {
            const int channels = channel_count(format);
            for (int x = 0; x < count; ++x) {
                floats[4 * x + 3] = 1;
                for (int c = 0; c < channels; ++c) {
                    std::uint16_t h;
                    std::memcpy(&h, in + 2 * (channels * x + c), 2);
                    floats[4 * x + c] = half_to_float(h);
                }
            }
            return;
        }
    }
}

void pack_row(const void* four_channels, Format format, int count, std::byte* out) noexcept {
    const auto* bytes = static_cast<const std::uint8_t*>(four_channels);
    const auto* floats = static_cast<const float*>(four_channels);
    auto* o = reinterpret_cast<std::uint8_t*>(out);
    const int channels = channel_count(format);
    switch (format) {
        case Format::rgba8: std::memcpy(o, bytes, static_cast<std::size_t>(count) * 4); return;
        case Format::rgba32f: std::memcpy(o, floats, static_cast<std::size_t>(count) * 16); return;
        case Format::rgb8:
        case Format::r8:
            for (int x = 0; x < count; ++x)
                for (int c = 0; c < channels; ++c) o[channels * x + c] = bytes[4 * x + c];
            return;
        case Format::rgb32f:
            for (int x = 0; x < count; ++x) std::memcpy(o + 12 * x, floats + 4 * x, 12);
            return;
        case Format::rgba16f:
        case Format::rgb16f:
            for (int x = 0; x < count; ++x)
                for (int c = 0; c < channels; ++c) {
                    const std::uint16_t h = float_to_half(floats[4 * x + c]);
                    std::memcpy(o + 2 * (channels * x + c), &h, 2);
                }
            return;
    }
}

}  // namespace fovea::render::extrapolation
