// A stream of packets from one IN endpoint of a USB device: several transfers in flight, through libusb.
//
// Source: libusb 1.0 asynchronous API. The endpoint is looked up in the device's descriptors, never assumed: device
// controllers renumber endpoints.
//
//   closed -> open() -> streaming -> (NO_DEVICE | LEFT | too many faults) -> lost -> close()
//   A stall is cleared and the transfers are queued again; kMaxFaultsInARow faults without a packet between end it.
//
// Cost: libusb allocates one URB per submitted transfer (its own doing); nothing else in the steady loop.
// Threads: one at a time, except wake(). Errors: open() says which interface, endpoint or permission is missing.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "protocol/clock.hpp"
#include "protocol/error.hpp"

namespace fovea::drivers::usb {

struct UsbTarget {
    std::uint16_t vendor = 0, product = 0;
    std::uint8_t interface = 0;
    std::uint8_t endpoint = 0;         // the usual IN endpoint; another one of the interface is taken where it is missing
    std::size_t transfer_bytes = 1024; // room for one packet and for seeing that it is overlong
    unsigned in_flight = 4;            // 1 to 16: queued in the kernel, so that a late poll loses nothing
};

enum class UsbEvent : std::uint8_t { packet, nothing, lost };

struct UsbCounters {
    std::uint64_t stalls = 0, overflows = 0, errors = 0;
};

class UsbStream {
public:
    static constexpr unsigned kMaxFaultsInARow = 32;

    UsbStream();
    ~UsbStream();
    UsbStream(const UsbStream&) = delete;
    UsbStream& operator=(const UsbStream&) = delete;

    // Finds the device, detaches a kernel driver from the interface, claims it, and queues the transfers.
    [[nodiscard]] Result<void> open(const UsbTarget& target, const TimeSource& time);
    // Waits for a packet until `deadline`. `packet` stays valid until the next call.
    [[nodiscard]] UsbEvent next(std::span<const std::uint8_t>& packet, Instant& received, Instant deadline) noexcept;
    // Queues a vendor control request (host to device) of at most 64 bytes, without waiting; false while the last one
    // is still under way or when the device is gone.
    bool send_vendor_request(std::uint8_t recipient, std::uint8_t request, std::uint16_t value, std::uint16_t index,
                             std::span<const std::uint8_t> data) noexcept;
    // Cancels what is in flight, waits for it, releases the interface and gives it back to the kernel's driver.
    void close() noexcept;
    void wake() noexcept;

    [[nodiscard]] bool is_open() const noexcept;
    [[nodiscard]] const UsbCounters& counters() const noexcept;
    [[nodiscard]] const char* why_lost() const noexcept;
    [[nodiscard]] std::string location() const;   // "bus 1, address 5"
    [[nodiscard]] std::string product() const;    // as the device calls itself; may be empty

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace fovea::drivers::usb
