#include "drivers/sample/sample_device.hpp"

#include "drivers/exposure_clock.hpp"
#include "drivers/sample/sample_packet.hpp"
#include "drivers/setting_values.hpp"
#include "drivers/usb/usb_list.hpp"
#include "drivers/usb/usb_stream.hpp"

namespace fovea::drivers::sample {

namespace {

constexpr std::uint16_t kVendor = 0x1D50, kProduct = 0xE7E3;

class SampleDevice final : public Device {
public:
    SampleDevice(Duration silent, const TimeSource& time) : silent_{silent}, time_{time} {}

    DeviceInfo info() const override { return {"sample", "Sample tracker", stream_.location(), 250, false}; }

    Result<void> open() override {
        const usb::UsbTarget target{.vendor = kVendor, .product = kProduct, .interface = 0, .endpoint = 0x81,
                                    .transfer_bytes = 64, .in_flight = 4};
        if (auto opened = stream_.open(target, time_); !opened) return opened;
        // Whatever the last connection left behind must not reach this one.
        ticks_.reset();
        clock_.reset();
        next_id_ = 1;
        last_packet_ = time_.now();
        return {};
    }

    PollStatus poll(GazeSample& out, Instant deadline) noexcept override {
        for (;;) {
            if (silent_ > Duration{} && time_.now() - last_packet_ > silent_) return lose("silent");
            std::span<const std::uint8_t> bytes;
            Instant received;
            switch (stream_.next(bytes, received, deadline)) {
                case usb::UsbEvent::nothing: return PollStatus::nothing;
                case usb::UsbEvent::lost: return lose(stream_.why_lost());
                case usb::UsbEvent::packet: break;
            }
            if (const auto packet = decode(bytes)) {
                last_packet_ = received;
                out = {};
                out.id = next_id_++;
                out.eye(Eye::combined) = packet->gaze;
                out.device_time = ticks_.extend(packet->time_ticks);
                out.received = received;
                clock_.stamp(out, true);
                ++counters_.samples;
                return PollStatus::sample;
            }
            ++counters_.malformed;
            if (received >= deadline) return PollStatus::nothing;
        }
    }

    void wake() noexcept override { stream_.wake(); }
    void close() noexcept override { stream_.close(); }
    DeviceCounters counters() const noexcept override { return counters_; }

private:
    PollStatus lose(const char* why) noexcept {
        stream_.close();
        ++counters_.losses;
        counters_.last_loss = why;
        return PollStatus::lost;
    }

    Duration silent_;
    const TimeSource& time_;
    usb::UsbStream stream_;
    TickClock ticks_;
    ExposureClock clock_;
    DeviceCounters counters_;
    std::uint64_t next_id_ = 1;
    Instant last_packet_;
};

}  // namespace

std::vector<DeviceKey> keys() {
    return {{"silent_ms", "2000", "no packet for this long counts as lost; milliseconds, 0 (never) to 600000"}};
}

Result<std::unique_ptr<Device>> create(const DeviceSettings& settings, const TimeSource& time) {
    SettingValues v(settings);
    const Duration silent = std::chrono::milliseconds(v.integer("silent_ms", 2000, 0, 600000));
    if (auto bad = v.failure(); !bad) return std::unexpected(bad.error());
    return std::make_unique<SampleDevice>(silent, time);
}

std::vector<FoundDevice> list(bool with_details) { return usb::list_usb(kVendor, kProduct, "Sample tracker", with_details); }

}  // namespace fovea::drivers::sample
