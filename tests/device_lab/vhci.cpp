#include "tests/device_lab/vhci.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include "tests/device_lab/feed.hpp"

namespace fovea::lab {

namespace {

constexpr std::size_t kHeaderBytes = 48;
constexpr std::uint32_t kCmdSubmit = 1, kCmdUnlink = 2, kRetSubmit = 3, kRetUnlink = 4;
constexpr int kHighSpeed = 3;

std::uint32_t big32(const std::uint8_t* p) {
    return std::uint32_t{p[0]} << 24 | std::uint32_t{p[1]} << 16 | std::uint32_t{p[2]} << 8 | p[3];
}
void put_big32(std::uint8_t* p, std::uint32_t v) {
    for (int i = 0; i < 4; ++i) p[i] = static_cast<std::uint8_t>(v >> (24 - 8 * i));
}

bool read_all(int fd, void* data, std::size_t size) {
    auto* at = static_cast<std::uint8_t*>(data);
    while (size > 0) {
        const ssize_t n = ::recv(fd, at, size, 0);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return false;
        at += n;
        size -= static_cast<std::size_t>(n);
    }
    return true;
}

bool write_all(int fd, const void* data, std::size_t size) {
    const auto* at = static_cast<const std::uint8_t*>(data);
    while (size > 0) {
        const ssize_t n = ::send(fd, at, size, MSG_NOSIGNAL);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return false;
        at += n;
        size -= static_cast<std::size_t>(n);
    }
    return true;
}

}  // namespace

VhciDevice::VhciDevice(UsbDescriptors descriptors, int port) : descriptors_{std::move(descriptors)}, port_{port} {
    int ends[2];
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) die("socketpair");
    socket_ = ends[0];
    const std::string path = "/sys/devices/platform/vhci_hcd.0/attach";
    const int attach = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
    if (attach < 0) die(path);
    const std::string line = std::to_string(port) + " " + std::to_string(ends[1]) + " " +
                             std::to_string(0x10000 + port + 2) + " " + std::to_string(kHighSpeed);
    // A port that was just given up is busy for a moment.
    for (int tries = 0;; ++tries) {
        if (::write(attach, line.data(), line.size()) == static_cast<ssize_t>(line.size())) break;
        if (tries > 200) die("attach to vhci_hcd");
        ::usleep(10'000);
    }
    ::close(attach);
    ::close(ends[1]);
}

VhciDevice::~VhciDevice() {
    ::shutdown(socket_, SHUT_RDWR);
    ::close(socket_);
}

bool VhciDevice::answer(std::uint32_t sequence, std::int32_t status, std::span<const std::uint8_t> data, bool in,
                        std::size_t actual) {
    std::vector<std::uint8_t> out(kHeaderBytes, 0);
    put_big32(out.data(), kRetSubmit);
    put_big32(out.data() + 4, sequence);
    put_big32(out.data() + 20, static_cast<std::uint32_t>(status));
    put_big32(out.data() + 24, static_cast<std::uint32_t>(actual));
    if (in) out.insert(out.end(), data.begin(), data.end());
    return write_all(socket_, out.data(), out.size());
}

std::size_t VhciDevice::waiting(std::uint8_t endpoint) const {
    const auto it = waiting_.find(endpoint);
    return it == waiting_.end() ? 0 : it->second.size();
}

std::size_t VhciDevice::room(std::uint8_t endpoint) const {
    const auto it = waiting_.find(endpoint);
    return it == waiting_.end() || it->second.empty() ? 0 : it->second.front().room;
}

bool VhciDevice::complete(std::uint8_t endpoint, std::span<const std::uint8_t> data) {
    auto& queue = waiting_[endpoint];
    if (queue.empty()) return false;
    const Waiting w = queue.front();
    queue.pop_front();
    if (data.size() > w.room) return answer(w.sequence, -EOVERFLOW, data.first(w.room), true, w.room);
    return answer(w.sequence, 0, data, true, data.size());
}

bool VhciDevice::stall(std::uint8_t endpoint) {
    auto& queue = waiting_[endpoint];
    if (queue.empty()) return false;
    const Waiting w = queue.front();
    queue.pop_front();
    return answer(w.sequence, -EPIPE, {}, true, 0);
}

std::optional<std::vector<std::uint8_t>> VhciDevice::standard(const UsbSetup& s) {
    constexpr std::uint8_t kGetStatus = 0, kClearFeature = 1, kGetDescriptor = 6, kSetConfiguration = 9, kSetInterface = 11;
    if (s.request == kGetStatus) return std::vector<std::uint8_t>{0, 0};
    if (s.request == kSetConfiguration || s.request == kSetInterface) return std::vector<std::uint8_t>{};
    if (s.request == kClearFeature) {
        if ((s.type & 0x1F) == 2) ++halts_cleared_;
        return std::vector<std::uint8_t>{};
    }
    if (s.request != kGetDescriptor) return std::nullopt;
    const int index = s.value & 0xFF;
    switch (s.value >> 8) {
        case 1: return descriptors_.device;
        case 2: return descriptors_.configuration;
        case 3: {
            if (index == 0) return std::vector<std::uint8_t>{4, 3, 9, 4};   // English
            if (index > 3) return std::nullopt;
            std::vector<std::uint8_t> bytes = {0, 3};
            for (const char c : descriptors_.strings[static_cast<std::size_t>(index - 1)]) {
                bytes.push_back(static_cast<std::uint8_t>(c));
                bytes.push_back(0);
            }
            bytes[0] = static_cast<std::uint8_t>(bytes.size());
            return bytes;
        }
        case 6: {
            std::vector<std::uint8_t> q = {10, 6, 0, 2, 0, 0, 0, 64, 1, 0};
            std::copy(descriptors_.device.begin() + 4, descriptors_.device.begin() + 7, q.begin() + 4);
            return q;
        }
        default: return std::nullopt;
    }
}

void VhciDevice::control(std::uint32_t sequence, const UsbSetup& s, std::span<const std::uint8_t> out) {
    const bool in = (s.type & 0x80) != 0, is_standard = (s.type & 0x60) == 0;
    auto reply = is_standard ? standard(s) : on_request ? on_request(s, out) : std::nullopt;
    if (!reply) {
        answer(sequence, -EPIPE, {}, in, 0);
        return;
    }
    if (reply->size() > s.length) reply->resize(s.length);
    answer(sequence, 0, *reply, in, in ? reply->size() : out.size());
}

bool VhciDevice::handle_submit(std::span<const std::uint8_t, kHeaderBytes> h) {
    const std::uint32_t sequence = big32(&h[4]), direction = big32(&h[12]), endpoint = big32(&h[16]);
    const std::size_t length = big32(&h[24]);
    std::vector<std::uint8_t> out;
    if (direction == 0 && length > 0) {
        if (length > 1u << 20) return false;
        out.resize(length);
        if (!read_all(socket_, out.data(), length)) return false;
    }
    if (endpoint != 0) {
        if (direction == 1) waiting_[static_cast<std::uint8_t>(0x80 | endpoint)].push_back({sequence, length});
        else answer(sequence, 0, {}, false, out.size());
        return true;
    }
    const std::uint8_t* p = &h[40];
    const auto u16 = [&](int at) { return static_cast<std::uint16_t>(p[at] | p[at + 1] << 8); };
    control(sequence, {p[0], p[1], u16(2), u16(4), u16(6)}, out);
    return true;
}

bool VhciDevice::serve(Instant t) {
    while (wait_until(t, socket_)) {
        std::array<std::uint8_t, kHeaderBytes> h{};
        if (!read_all(socket_, h.data(), h.size())) return false;
        const std::uint32_t command = big32(&h[0]);
        if (command == kCmdSubmit) {
            if (!handle_submit(h)) return false;
        } else if (command == kCmdUnlink) {
            const std::uint32_t victim = big32(&h[20]);
            bool found = false;
            for (auto& [endpoint, queue] : waiting_)
                found = found || std::erase_if(queue, [&](const Waiting& w) { return w.sequence == victim; }) > 0;
            std::array<std::uint8_t, kHeaderBytes> r{};
            put_big32(&r[0], kRetUnlink);
            std::copy_n(h.begin() + 4, 4, r.begin() + 4);
            put_big32(&r[20], static_cast<std::uint32_t>(found ? -ECONNRESET : 0));
            if (!write_all(socket_, r.data(), r.size())) return false;
        } else {
            return false;
        }
    }
    return true;
}

}  // namespace fovea::lab
