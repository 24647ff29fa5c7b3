// A USB device in user space behind the kernel's vhci_hcd (USB/IP): real URBs, real usbfs, real class drivers, and every
// fault that hardware can show.
//
// Source: USB/IP protocol, Documentation/usb/usbip_protocol.rst of Linux 6.1 (USBIP_CMD_SUBMIT, _UNLINK).
// Threads: one; the device runs in serve(). Needs root, vhci-hcd loaded.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocol/clock.hpp"

namespace fovea::lab {

struct UsbSetup {
    std::uint8_t type = 0, request = 0;
    std::uint16_t value = 0, index = 0, length = 0;
};

struct UsbDescriptors {
    std::vector<std::uint8_t> device, configuration;
    std::array<std::string, 3> strings;   // manufacturer, product, serial: indices 1 to 3
};

class VhciDevice {
public:
    // Plugs the device into `port` (0 to 7) at high speed.
    VhciDevice(UsbDescriptors descriptors, int port);
    ~VhciDevice();   // pulls it out
    VhciDevice(const VhciDevice&) = delete;
    VhciDevice& operator=(const VhciDevice&) = delete;

    // Class and vendor requests: returns the data for IN, {} for an accepted OUT, nothing to stall.
    std::function<std::optional<std::vector<std::uint8_t>>(const UsbSetup&, std::span<const std::uint8_t> out)> on_request;

    // Handles what the host asks until `t`; false when the host has let go of the device.
    bool serve(Instant t);
    // IN transfers that wait on an endpoint, and the room of the oldest one.
    [[nodiscard]] std::size_t waiting(std::uint8_t endpoint) const;
    [[nodiscard]] std::size_t room(std::uint8_t endpoint) const;
    // Completes the oldest waiting IN transfer. Data longer than its room are reported as an overflow.
    bool complete(std::uint8_t endpoint, std::span<const std::uint8_t> data);
    bool stall(std::uint8_t endpoint);
    [[nodiscard]] unsigned halts_cleared() const { return halts_cleared_; }

private:
    struct Waiting {
        std::uint32_t sequence = 0;
        std::size_t room = 0;
    };
    bool answer(std::uint32_t sequence, std::int32_t status, std::span<const std::uint8_t> data, bool in,
                std::size_t actual);
    bool handle_submit(std::span<const std::uint8_t, 48> header);
    void control(std::uint32_t sequence, const UsbSetup& setup, std::span<const std::uint8_t> out);
    [[nodiscard]] std::optional<std::vector<std::uint8_t>> standard(const UsbSetup& setup);

    UsbDescriptors descriptors_;
    int socket_ = -1, port_ = 0;
    std::map<std::uint8_t, std::deque<Waiting>> waiting_;
    unsigned halts_cleared_ = 0;
};

}  // namespace fovea::lab
