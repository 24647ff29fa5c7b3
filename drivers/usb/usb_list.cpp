#include "drivers/usb/usb_list.hpp"

#include <fmt/format.h>
#include <libusb-1.0/libusb.h>

#include "drivers/access.hpp"

namespace fovea::drivers::usb {

namespace {

std::string interfaces_in_words(libusb_device* device) {
    libusb_config_descriptor* config = nullptr;
    if (libusb_get_active_config_descriptor(device, &config) != 0) return "no active configuration\n";
    constexpr const char* kTypes[] = {"control", "isochronous", "bulk", "interrupt"};
    std::string text;
    for (int i = 0; i < config->bNumInterfaces; ++i)
        for (int a = 0; a < config->interface[i].num_altsetting; ++a) {
            const libusb_interface_descriptor& d = config->interface[i].altsetting[a];
            text += fmt::format("interface {} alternate {}: class 0x{:02X}\n", d.bInterfaceNumber, d.bAlternateSetting,
                                d.bInterfaceClass);
            for (int e = 0; e < d.bNumEndpoints; ++e)
                text += fmt::format("  endpoint 0x{:02X} {} {}, {} bytes\n", d.endpoint[e].bEndpointAddress,
                                    kTypes[d.endpoint[e].bmAttributes & 3],
                                    (d.endpoint[e].bEndpointAddress & LIBUSB_ENDPOINT_IN) != 0 ? "in" : "out",
                                    d.endpoint[e].wMaxPacketSize & 0x7FF);
        }
    libusb_free_config_descriptor(config);
    return text;
}

}  // namespace

std::vector<FoundDevice> list_usb(std::uint16_t vendor, std::uint16_t product, const char* name, bool with_details) {
    std::vector<FoundDevice> found;
    libusb_context* context = nullptr;
    if (libusb_init(&context) != 0) return found;
    libusb_device** list = nullptr;
    const ssize_t count = libusb_get_device_list(context, &list);
    for (ssize_t i = 0; i < count; ++i) {
        libusb_device_descriptor d{};
        if (libusb_get_device_descriptor(list[i], &d) != 0 || d.idVendor != vendor || d.idProduct != product) continue;
        FoundDevice f;
        f.location = fmt::format("/dev/bus/usb/{:03}/{:03}", libusb_get_bus_number(list[i]),
                                 libusb_get_device_address(list[i]));
        f.name = fmt::format("{} ({:04x}:{:04x})", name, vendor, product);
        if (const int code = try_open(f.location); code != 0) f.problem = cannot_open(f.location, code).error().message();
        if (with_details) f.details = interfaces_in_words(list[i]);
        found.push_back(std::move(f));
    }
    if (list != nullptr) libusb_free_device_list(list, 1);
    libusb_exit(context);
    return found;
}

}  // namespace fovea::drivers::usb
