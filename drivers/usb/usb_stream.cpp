#include "drivers/usb/usb_stream.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <vector>

#include <fmt/format.h>
#include <libusb-1.0/libusb.h>

#include "drivers/access.hpp"

namespace fovea::drivers::usb {

namespace {

constexpr unsigned kMaxInFlight = 16;
constexpr std::size_t kMaxControlBytes = 64;
constexpr unsigned kControlTimeoutMs = 200;

struct Endpoint {
    std::uint8_t address = 0;
    bool interrupt = false;
};

// The wanted IN endpoint of the interface, else its first one.
Result<Endpoint> find_endpoint(libusb_device* device, const UsbTarget& target, const std::string& where) {
    libusb_config_descriptor* config = nullptr;
    if (libusb_get_active_config_descriptor(device, &config) != 0)
        return fail("cannot read the device's configuration", where, "plug it in again");
    Endpoint found;
    bool has_interface = false;
    for (int i = 0; i < config->bNumInterfaces; ++i) {
        if (config->interface[i].num_altsetting < 1) continue;
        const libusb_interface_descriptor& d = config->interface[i].altsetting[0];
        if (d.bInterfaceNumber != target.interface) continue;
        has_interface = true;
        for (int e = 0; e < d.bNumEndpoints; ++e) {
            const libusb_endpoint_descriptor& ep = d.endpoint[e];
            const int type = ep.bmAttributes & 3;
            if ((ep.bEndpointAddress & LIBUSB_ENDPOINT_IN) == 0) continue;
            if (type != LIBUSB_TRANSFER_TYPE_INTERRUPT && type != LIBUSB_TRANSFER_TYPE_BULK) continue;
            if (found.address == 0 || ep.bEndpointAddress == target.endpoint)
                found = {ep.bEndpointAddress, type == LIBUSB_TRANSFER_TYPE_INTERRUPT};
        }
    }
    libusb_free_config_descriptor(config);
    if (!has_interface) return fail(fmt::format("the device has no interface {}", target.interface), where);
    if (found.address == 0)
        return fail(fmt::format("interface {} has no interrupt or bulk IN endpoint", target.interface), where);
    return found;
}

std::string describe_location(libusb_device* device) {
    return fmt::format("bus {}, address {}", libusb_get_bus_number(device), libusb_get_device_address(device));
}

std::string node_of(libusb_device* device) {
    return fmt::format("/dev/bus/usb/{:03}/{:03}", libusb_get_bus_number(device), libusb_get_device_address(device));
}

}  // namespace

struct UsbStream::State {
    // Lives as long as the stream, so that wake() always has something to interrupt.
    std::atomic<libusb_context*> context{nullptr};
    std::atomic<bool> woken{false};
    const TimeSource* time = nullptr;
    libusb_device_handle* handle = nullptr;
    libusb_hotplug_callback_handle hotplug = 0;
    bool has_hotplug = false;
    UsbTarget target;
    Endpoint endpoint;

    struct Transfer {
        State* owner = nullptr;
        libusb_transfer* transfer = nullptr;
        std::vector<std::uint8_t> buffer;
        Instant received;
        bool in_flight = false;
    };
    std::array<Transfer, kMaxInFlight> transfers;
    // Completed transfers, oldest first; each of them is in at most once, so the ring never overflows.
    std::array<std::uint8_t, kMaxInFlight> done{};
    unsigned done_head = 0, done_count = 0;
    int handed_out = -1;   // whose buffer the caller is reading

    libusb_transfer* control = nullptr;
    std::array<std::uint8_t, LIBUSB_CONTROL_SETUP_SIZE + kMaxControlBytes> control_buffer{};
    bool control_in_flight = false;

    UsbCounters counters;
    unsigned faults_in_a_row = 0;
    bool gone = false, recovering = false;
    const char* why_lost = "";
    std::string location, product;

    void give_up(const char* why) noexcept {
        if (!gone) why_lost = why;
        gone = true;
    }

    void submit(unsigned index) noexcept {
        Transfer& t = transfers[index];
        const int result = libusb_submit_transfer(t.transfer);
        t.in_flight = result == 0;
        if (result == LIBUSB_ERROR_NO_DEVICE) give_up("unplugged");
        else if (result != 0) give_up("a transfer could not be queued");
    }

    // Called by libusb inside next() and close(), on the polling thread.
    static void LIBUSB_CALL completed(libusb_transfer* transfer) {
        auto& t = *static_cast<Transfer*>(transfer->user_data);
        State& s = *t.owner;
        t.in_flight = false;
        t.received = s.time->now();
        if (transfer->status == LIBUSB_TRANSFER_CANCELLED) return;
        const auto index = static_cast<std::uint8_t>(&t - s.transfers.data());
        s.done[(s.done_head + s.done_count++) % kMaxInFlight] = index;
    }

    static void LIBUSB_CALL control_completed(libusb_transfer* transfer) {
        static_cast<State*>(transfer->user_data)->control_in_flight = false;
    }

    static int LIBUSB_CALL left(libusb_context*, libusb_device* device, libusb_hotplug_event, void* self) {
        auto& s = *static_cast<State*>(self);
        if (s.handle != nullptr && device == libusb_get_device(s.handle)) s.give_up("unplugged");
        return 0;
    }

    void handle_events(Duration wait) noexcept {
        const auto us = std::max<std::int64_t>(wait.count() / 1000, 0);
        timeval tv{static_cast<time_t>(us / 1'000'000), static_cast<suseconds_t>(us % 1'000'000)};
        libusb_handle_events_timeout_completed(context.load(std::memory_order_relaxed), &tv, nullptr);
    }

    // A stalled endpoint must have nothing queued when it is cleared: everything is cancelled first, and queued again
    // when the last one has come back.
    void begin_recovery() noexcept {
        recovering = true;
        for (unsigned i = 0; i < target.in_flight; ++i)
            if (transfers[i].in_flight) libusb_cancel_transfer(transfers[i].transfer);
    }

    void finish_recovery() noexcept {
        for (unsigned i = 0; i < target.in_flight; ++i)
            if (transfers[i].in_flight) return;
        recovering = false;
        if (libusb_clear_halt(handle, endpoint.address) == LIBUSB_ERROR_NO_DEVICE) return give_up("unplugged");
        for (unsigned i = 0; i < target.in_flight; ++i) submit(i);   // none is in `done`, none is handed out
    }
};

UsbStream::UsbStream() : state_{std::make_unique<State>()} {
    for (auto& t : state_->transfers) t.owner = state_.get();
}

UsbStream::~UsbStream() {
    close();
    if (libusb_context* c = state_->context.load()) libusb_exit(c);
}

Result<void> UsbStream::open(const UsbTarget& target, const TimeSource& time) {
    close();
    State& s = *state_;
    FOVEA_REQUIRE(target.in_flight >= 1 && target.in_flight <= kMaxInFlight);
    s.target = target;
    s.time = &time;
    if (s.context.load() == nullptr) {
        libusb_context* context = nullptr;
        if (const int r = libusb_init(&context); r != 0)
            return fail(std::string("libusb does not start: ") + libusb_error_name(r), {}, "is USB there at all?");
        s.context.store(context);
    }
    libusb_device** list = nullptr;
    const ssize_t count = libusb_get_device_list(s.context.load(), &list);
    libusb_device* device = nullptr;
    for (ssize_t i = 0; i < count && device == nullptr; ++i) {
        libusb_device_descriptor d{};
        if (libusb_get_device_descriptor(list[i], &d) == 0 && d.idVendor == target.vendor && d.idProduct == target.product)
            device = libusb_ref_device(list[i]);
    }
    if (list != nullptr) libusb_free_device_list(list, 1);
    const std::string ids = fmt::format("USB device {:04x}:{:04x}", target.vendor, target.product);
    if (device == nullptr) return fail("it is not plugged in", ids, "plug it in; `fovea devices` lists what is there");
    const std::string node = node_of(device), where = ids + ", " + node;
    const auto give_up = [&](std::unexpected<Error> e) {
        if (s.handle != nullptr) libusb_close(s.handle);
        s.handle = nullptr;
        libusb_unref_device(device);
        return e;
    };
    const auto endpoint = find_endpoint(device, target, where);
    if (!endpoint) return give_up(std::unexpected(endpoint.error()));
    s.endpoint = *endpoint;
    if (const int r = libusb_open(device, &s.handle); r != 0) {
        s.handle = nullptr;
        return give_up(cannot_open(node, r == LIBUSB_ERROR_ACCESS ? EACCES : r == LIBUSB_ERROR_NO_DEVICE ? ENODEV : EIO));
    }
    libusb_set_auto_detach_kernel_driver(s.handle, 1);
    if (const int r = libusb_claim_interface(s.handle, target.interface); r != 0) {
        if (r == LIBUSB_ERROR_BUSY) return give_up(cannot_open(node, EBUSY));
        return give_up(fail(fmt::format("cannot claim interface {}: {}", target.interface, libusb_error_name(r)), where));
    }
    s.location = describe_location(device);
    s.product.clear();
    libusb_device_descriptor d{};
    unsigned char text[128];
    if (libusb_get_device_descriptor(device, &d) == 0 && d.iProduct != 0)
        if (const int n = libusb_get_string_descriptor_ascii(s.handle, d.iProduct, text, sizeof text); n > 0)
            s.product.assign(reinterpret_cast<const char*>(text), static_cast<std::size_t>(n));
    libusb_unref_device(device);   // the handle holds its own reference

    s.gone = s.recovering = false;
    s.why_lost = "";
    s.faults_in_a_row = 0;
    s.done_head = s.done_count = 0;
    s.handed_out = -1;
    s.has_hotplug = libusb_has_capability(LIBUSB_CAP_HAS_HOTPLUG) != 0 &&
                    libusb_hotplug_register_callback(s.context.load(), LIBUSB_HOTPLUG_EVENT_DEVICE_LEFT, 0,
                                                     target.vendor, target.product, LIBUSB_HOTPLUG_MATCH_ANY,
                                                     &State::left, &s, &s.hotplug) == 0;
    s.control = libusb_alloc_transfer(0);
    for (unsigned i = 0; i < target.in_flight; ++i) {
        State::Transfer& t = s.transfers[i];
        t.transfer = libusb_alloc_transfer(0);
        t.buffer.assign(target.transfer_bytes, 0);
        if (t.transfer == nullptr || s.control == nullptr) {
            close();
            return fail("no memory for USB transfers", where);
        }
        const auto fill = s.endpoint.interrupt ? libusb_fill_interrupt_transfer : libusb_fill_bulk_transfer;
        fill(t.transfer, s.handle, s.endpoint.address, t.buffer.data(), static_cast<int>(t.buffer.size()),
             &State::completed, &t, 0);
        s.submit(i);
    }
    if (s.gone) {
        const char* why = s.why_lost;
        close();
        return fail(why, where, "plug it in again");
    }
    return {};
}

UsbEvent UsbStream::next(std::span<const std::uint8_t>& packet, Instant& received, Instant deadline) noexcept {
    State& s = *state_;
    if (s.handle == nullptr) return UsbEvent::lost;
    if (s.handed_out >= 0) {
        const auto index = static_cast<unsigned>(s.handed_out);
        s.handed_out = -1;
        if (!s.recovering) s.submit(index);
    }
    for (;;) {
        while (s.done_count > 0) {
            const unsigned index = s.done[s.done_head];
            s.done_head = (s.done_head + 1) % kMaxInFlight;
            --s.done_count;
            const State::Transfer& t = s.transfers[index];
            switch (t.transfer->status) {
                case LIBUSB_TRANSFER_COMPLETED:
                    s.faults_in_a_row = 0;
                    s.handed_out = static_cast<int>(index);
                    packet = {t.buffer.data(), static_cast<std::size_t>(t.transfer->actual_length)};
                    received = t.received;
                    return UsbEvent::packet;
                case LIBUSB_TRANSFER_NO_DEVICE: s.give_up("unplugged"); break;
                case LIBUSB_TRANSFER_STALL:
                    ++s.counters.stalls;
                    if (++s.faults_in_a_row > kMaxFaultsInARow) s.give_up("its endpoint stalls for ever");
                    else if (!s.recovering) s.begin_recovery();
                    break;
                default:
                    ++(t.transfer->status == LIBUSB_TRANSFER_OVERFLOW ? s.counters.overflows : s.counters.errors);
                    if (++s.faults_in_a_row > kMaxFaultsInARow) s.give_up("its transfers fail for ever");
                    else if (!s.recovering) s.submit(index);
                    break;
            }
        }
        if (s.recovering && !s.gone) s.finish_recovery();
        if (s.gone) return UsbEvent::lost;
        if (s.woken.exchange(false, std::memory_order_relaxed)) return UsbEvent::nothing;
        const Instant now = s.time->now();
        if (now >= deadline) {
            s.handle_events({});   // what is there already
            if (s.done_count == 0) return s.gone ? UsbEvent::lost : UsbEvent::nothing;
            continue;
        }
        s.handle_events(std::min<Duration>(deadline - now, std::chrono::seconds(1)));
    }
}

bool UsbStream::send_vendor_request(std::uint8_t recipient, std::uint8_t request, std::uint16_t value,
                                    std::uint16_t index, std::span<const std::uint8_t> data) noexcept {
    State& s = *state_;
    if (s.handle == nullptr || s.control_in_flight || s.gone || data.size() > kMaxControlBytes) return false;
    const auto type = static_cast<std::uint8_t>(int{LIBUSB_REQUEST_TYPE_VENDOR} | recipient);  // host to device
    libusb_fill_control_setup(s.control_buffer.data(), type, request, value, index, static_cast<std::uint16_t>(data.size()));
    std::ranges::copy(data, s.control_buffer.begin() + LIBUSB_CONTROL_SETUP_SIZE);
    libusb_fill_control_transfer(s.control, s.handle, s.control_buffer.data(), &State::control_completed, &s,
                                 kControlTimeoutMs);
    s.control_in_flight = libusb_submit_transfer(s.control) == 0;
    return s.control_in_flight;
}

void UsbStream::close() noexcept {
    State& s = *state_;
    if (s.handle == nullptr) return;
    const auto busy = [&] {
        for (const auto& t : s.transfers)
            if (t.in_flight) return true;
        return s.control_in_flight;
    };
    for (auto& t : s.transfers)
        if (t.in_flight) libusb_cancel_transfer(t.transfer);
    if (s.control_in_flight) libusb_cancel_transfer(s.control);
    // The kernel gives every cancelled transfer back; a bound all the same, so that a wedged driver cannot hold us.
    for (int i = 0; i < 200 && busy(); ++i) s.handle_events(std::chrono::milliseconds(10));
    const bool wedged = busy();
    if (s.has_hotplug) libusb_hotplug_deregister_callback(s.context.load(), s.hotplug);
    s.has_hotplug = false;
    for (auto& t : s.transfers) {
        if (t.transfer != nullptr && !t.in_flight) libusb_free_transfer(t.transfer);
        t.transfer = nullptr;   // one that is still in flight is left to the kernel on purpose
        if (t.in_flight) (void)new std::vector<std::uint8_t>(std::move(t.buffer));
        t.in_flight = false;
    }
    if (s.control != nullptr && !s.control_in_flight) libusb_free_transfer(s.control);
    s.control = nullptr;
    s.control_in_flight = false;
    s.done_count = 0;
    s.handed_out = -1;
    if (!wedged) {
        libusb_release_interface(s.handle, s.target.interface);   // also gives it back to the kernel's driver
        libusb_close(s.handle);
    }
    s.handle = nullptr;
}

void UsbStream::wake() noexcept {
    state_->woken.store(true, std::memory_order_relaxed);
    if (libusb_context* c = state_->context.load()) libusb_interrupt_event_handler(c);
}

bool UsbStream::is_open() const noexcept { return state_->handle != nullptr; }
const UsbCounters& UsbStream::counters() const noexcept { return state_->counters; }
const char* UsbStream::why_lost() const noexcept { return state_->why_lost; }
std::string UsbStream::location() const { return state_->location; }
std::string UsbStream::product() const { return state_->product; }

}  // namespace fovea::drivers::usb
