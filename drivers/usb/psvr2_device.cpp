#include "drivers/usb/psvr2_device.hpp"

#include <fmt/format.h>

#include "drivers/exposure_clock.hpp"
#include "drivers/setting_values.hpp"
#include "drivers/usb/psvr2_packet.hpp"
#include "drivers/usb/usb_list.hpp"
#include "drivers/usb/usb_stream.hpp"

namespace fovea::drivers::usb {

namespace {

constexpr Duration kAskAgain = std::chrono::milliseconds(500);   // until the first packet
constexpr Duration kKeepAlive = std::chrono::seconds(1);         // from then on
constexpr std::uint8_t kToEndpoint = 2;                          // recipient of the vendor request
constexpr std::uint8_t kSetReport = 9;
constexpr std::uint8_t kGazeStreamReport = 0x0C;
// Report id, sub-command 1 (enable), length of the data that follow (none); 16, 16 and 32 bits.
constexpr std::array<std::uint8_t, 8> kEnable = {kGazeStreamReport, 0, 1, 0, 0, 0, 0, 0};

class Psvr2Device final : public Device {
public:
    Psvr2Device(UsbTarget target, Duration silent, const TimeSource& time)
        : target_{target}, silent_{silent}, time_{time} {}

    DeviceInfo info() const override {
        const std::string product = stream_.product();
        return {"psvr2", product.empty() ? "PlayStation VR2" : product, stream_.location(), 120, false};
    }

    Result<void> open() override {
        if (auto opened = stream_.open(target_, time_); !opened) return opened;
        joiner_.reset();
        clock_.reset();
        next_id_ = 1;
        has_frame_ = false;
        last_ = {};
        last_packet_ = time_.now();
        ask_at_ = last_packet_;
        return {};
    }

    PollStatus poll(GazeSample& out, Instant deadline) noexcept override {
        if (!stream_.is_open()) return lose("not open");
        for (;;) {
            const Instant now = time_.now();
            if (silent_ > Duration{} && now - last_packet_ > silent_) return lose("silent");
            if (now >= ask_at_) {
                stream_.send_vendor_request(kToEndpoint, kSetReport, kGazeStreamReport, 0, kEnable);
                ask_at_ = now + (has_frame_ ? kKeepAlive : kAskAgain);
            }
            std::span<const std::uint8_t> transfer;
            Instant received;
            switch (stream_.next(transfer, received, std::min(deadline, ask_at_))) {
                case UsbEvent::lost: return lose(stream_.why_lost());
                case UsbEvent::nothing:
                    if (time_.now() < ask_at_ || time_.now() >= deadline) return PollStatus::nothing;
                    continue;
                case UsbEvent::packet: break;
            }
            const auto packet = joiner_.take(transfer);
            if (!packet.empty() && take(packet, out)) {
                out.received = received;
                clock_.stamp(out, true);
                return PollStatus::sample;
            }
            if (received >= deadline) return PollStatus::nothing;
        }
    }

    void rehearse() noexcept override {
        if (last_.empty()) return;
        GazeSample sample;
        std::uint32_t frame = 0;
        static_cast<void>(decode_psvr2(last_, sample, frame));
        sample.received = last_packet_;
        ExposureClock clock = clock_;
        clock.stamp(sample, true);
    }
    void wake() noexcept override { stream_.wake(); }
    void close() noexcept override { stream_.close(); }

    DeviceCounters counters() const noexcept override {
        DeviceCounters c = counters_;
        const UsbCounters& u = stream_.counters();
        c.malformed += joiner_.malformed() + u.overflows + u.errors + u.stalls;
        return c;
    }

private:
    PollStatus lose(const char* why) noexcept {
        stream_.close();
        ++counters_.losses;
        counters_.last_loss = why;
        return PollStatus::lost;
    }

    bool take(std::span<const std::uint8_t> packet, GazeSample& out) noexcept {
        std::uint32_t frame = 0;
        switch (decode_psvr2(packet, out, frame)) {
            case Psvr2Packet::malformed: ++counters_.malformed; return false;
            case Psvr2Packet::other: return false;
            case Psvr2Packet::gaze: break;
        }
        last_packet_ = time_.now();
        if (has_frame_) {
            const std::uint32_t step = frame - last_frame_;   // modulo 2^32, as the device counts
            if (step > 1 && step < 1'000'000) counters_.dropped += step - 1;
        }
        has_frame_ = true;
        last_ = packet;
        last_frame_ = frame;
        out.id = next_id_++;
        ++counters_.samples;
        return true;
    }

    UsbTarget target_;
    Duration silent_;
    const TimeSource& time_;
    UsbStream stream_;
    PacketJoiner joiner_;
    ExposureClock clock_;
    DeviceCounters counters_;
    std::uint64_t next_id_ = 1;
    bool has_frame_ = false;
    std::uint32_t last_frame_ = 0;
    Instant last_packet_, ask_at_;
    std::span<const std::uint8_t> last_;   // the newest gaze packet, where the stream or the joiner has it
};

}  // namespace

std::vector<DeviceKey> psvr2_keys() {
    return {
        {"vendor", "0x054C", "USB vendor id, 1 to 65535"},
        {"product", "0x0CDE", "USB product id, 1 to 65535"},
        {"interface", "5", "USB interface of the gaze stream, 0 to 31"},
        {"silent_ms", "3000", "no packet for this long counts as lost; milliseconds, 0 (never) to 600000"},
        {"in_flight", "4", "USB transfers queued at a time, 1 to 16"},
    };
}

Result<std::unique_ptr<Device>> create_psvr2(const DeviceSettings& settings, const TimeSource& time) {
    SettingValues v(settings);
    UsbTarget t;
    t.vendor = static_cast<std::uint16_t>(v.integer("vendor", kPsvr2Vendor, 1, 65535));
    t.product = static_cast<std::uint16_t>(v.integer("product", kPsvr2Product, 1, 65535));
    t.interface = static_cast<std::uint8_t>(v.integer("interface", kPsvr2Interface, 0, 31));
    t.endpoint = kPsvr2Endpoint;
    t.in_flight = static_cast<unsigned>(v.integer("in_flight", 4, 1, 16));
    const Duration silent = std::chrono::milliseconds(v.integer("silent_ms", 3000, 0, 600000));
    if (auto bad = v.failure(); !bad) return std::unexpected(bad.error());
    return std::make_unique<Psvr2Device>(t, silent, time);
}

std::vector<FoundDevice> list_psvr2(bool with_details) {
    return list_usb(kPsvr2Vendor, kPsvr2Product, "PlayStation VR2", with_details);
}

}  // namespace fovea::drivers::usb
