#include "drivers/usb/psvr2_packet.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace fovea::drivers::usb {

namespace {

static_assert(std::endian::native == std::endian::little, "the packet is read in place");

template <class T>
T at(std::span<const std::uint8_t> bytes, std::size_t offset) noexcept {
    T value;
    std::memcpy(&value, bytes.data() + offset, sizeof value);
    return value;
}

bool flag(std::span<const std::uint8_t> bytes, std::size_t offset) noexcept { return at<std::uint32_t>(bytes, offset) != 0; }

// A direction that is not of unit length within 10 % is no direction of this device: it does not count as valid.
void read_direction(std::span<const std::uint8_t> bytes, std::size_t valid_at, std::size_t dir_at, EyeState& eye) noexcept {
    eye.valid = false;
    eye.gaze_dir_head = {};
    if (!flag(bytes, valid_at)) return;
    const double x = at<float>(bytes, dir_at), y = at<float>(bytes, dir_at + 4), z = at<float>(bytes, dir_at + 8);
    const double n = std::hypot(x, y, z);
    if (!(n > 0.9 && n < 1.1)) return;
    if (const auto d = Direction<HeadFrame>::from({-x, y, -z})) {
        eye.gaze_dir_head = *d;
        eye.valid = true;
    }
}

void read_eye(std::span<const std::uint8_t> eye_bytes, EyeState& eye) noexcept {
    read_direction(eye_bytes, psvr2::kDirValid, psvr2::kDir, eye);
    eye.pupil_mm = kUnknown;
    if (flag(eye_bytes, psvr2::kPupilValid)) {
        const double mm = at<float>(eye_bytes, psvr2::kPupilMm);
        if (mm > 0 && mm < 20) eye.pupil_mm = mm;
    }
    eye.openness = kUnknown;
    if (flag(eye_bytes, psvr2::kBlinkValid)) eye.openness = flag(eye_bytes, psvr2::kBlink) ? 0.0 : 1.0;
    eye.confidence = kUnknown;
}

bool has_magic(std::span<const std::uint8_t> b) noexcept {
    return b.size() >= 2 && b[0] == 'G' && (b[1] == 'S' || b[1] == 'C' || b[1] == 'R');
}

}  // namespace

Psvr2Packet decode_psvr2(std::span<const std::uint8_t> packet, GazeSample& out, std::uint32_t& frame) noexcept {
    if (!has_magic(packet)) return Psvr2Packet::malformed;
    if (packet[1] != 'S') return Psvr2Packet::other;
    if (packet.size() != kPsvr2PacketBytes) return Psvr2Packet::malformed;
    std::int64_t ns = 0;
    if (__builtin_mul_overflow(at<std::int64_t>(packet, psvr2::kTimestamp), std::int64_t{1000}, &ns))
        return Psvr2Packet::malformed;
    out.device_time = DeviceTime{ns};
    frame = at<std::uint32_t>(packet, psvr2::kFrame);
    read_eye(packet.subspan(psvr2::kLeftEye), out.eye(Eye::left));
    read_eye(packet.subspan(psvr2::kRightEye), out.eye(Eye::right));
    EyeState& both = out.eye(Eye::combined);
    both = {};
    read_direction(packet, psvr2::kCombinedDirValid, psvr2::kCombinedDir, both);
    const EyeState &l = out.eye(Eye::left), &r = out.eye(Eye::right);
    // Closed only when both are: one eye shut is a wink, and the other still sees. fmax passes over an unknown.
    both.openness = std::fmax(l.openness, r.openness);
    out.head = {};
    return Psvr2Packet::gaze;
}

std::span<const std::uint8_t> PacketJoiner::take(std::span<const std::uint8_t> transfer) noexcept {
    if (has_magic(transfer)) {
        if (size_ != 0) ++malformed_;
        size_ = 0;
        if (transfer[1] != 'S' || transfer.size() == kPsvr2PacketBytes) return transfer;
    } else if (size_ == 0) {
        if (!transfer.empty()) ++malformed_;
        return {};
    }
    if (transfer.size() > bytes_.size() - size_) {
        ++malformed_;
        size_ = 0;
        return {};
    }
    std::ranges::copy(transfer, bytes_.begin() + static_cast<std::ptrdiff_t>(size_));
    size_ += transfer.size();
    if (size_ < bytes_.size()) return {};
    size_ = 0;
    return bytes_;
}

}  // namespace fovea::drivers::usb
