#include "tests/drivers/udev/testbed.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <umockdev.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>

#include <fmt/format.h>

#include "protocol/error.hpp"

namespace fovea::tests {

bool testbed_works(std::string& why) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    why = "umockdev's preloaded library and a sanitizer's both want to come first";
    return false;
#else
    why = "umockdev's library is not preloaded: run it through umockdev-wrapper, as ctest does";
    const Testbed probe;   // the answer is remembered from the first question on, and is no before the first testbed
    return umockdev_in_mock_environment() != FALSE;
#endif
}

struct Testbed::Parts {
    UMockdevTestbed* bed = nullptr;
    std::string root;
};

Testbed::Testbed() : parts_{std::make_unique<Parts>()} {
    parts_->bed = umockdev_testbed_new();
    char* root = umockdev_testbed_get_root_dir(parts_->bed);
    parts_->root = root;
    g_free(root);
}

Testbed::~Testbed() { g_object_unref(parts_->bed); }

void Testbed::add(const std::string& text) {
    GError* error = nullptr;
    const bool added = umockdev_testbed_add_from_string(parts_->bed, text.c_str(), &error) != FALSE;
    if (!added) fmt::print(stderr, "umockdev: {}\n", error->message);
    FOVEA_REQUIRE(added);
}

void Testbed::send_event(const std::string& sys_path, const char* action) {
    umockdev_testbed_uevent(parts_->bed, sys_path.c_str(), action);
}

void Testbed::remove(const std::string& sys_path) { umockdev_testbed_remove_device(parts_->bed, sys_path.c_str()); }

std::string Testbed::real_path(const std::string& path) const { return parts_->root + path; }

struct Node::Handler {
    Testbed& testbed;
    std::string path;
    IoctlAnswer answer;
    UMockdevIoctlBase* base = nullptr;
    UniqueFd far_end;
    std::atomic<bool> unplugged{false};

    static gboolean on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
        auto& h = *static_cast<Handler*>(self);
        if (h.unplugged) {
            umockdev_ioctl_client_complete(client, -1, ENODEV);
            return TRUE;
        }
        void* argument = nullptr;   // what umockdev holds is the call's third argument itself
        const UMockdevIoctlData* held = umockdev_ioctl_client_get_arg(client);
        FOVEA_REQUIRE(held->data_len == sizeof argument);
        std::copy_n(held->data, sizeof argument, reinterpret_cast<guint8*>(&argument));
        // Some callers hand over the request as an int: its upper half is the sign's.
        const long result = h.answer(umockdev_ioctl_client_get_request(client) & 0xFFFFFFFFu, argument);
        umockdev_ioctl_client_complete(client, result < 0 ? -1 : result, result < 0 ? static_cast<gint>(-result) : 0);
        return TRUE;
    }

    static gboolean on_read(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
        if (!static_cast<Handler*>(self)->unplugged) return FALSE;   // as it is: the FIFO is read
        umockdev_ioctl_client_complete(client, -1, EIO);
        return TRUE;
    }
};

Node::Node(Testbed& testbed, std::string path, IoctlAnswer answer)
    : handler_{std::make_unique<Handler>(testbed, std::move(path), std::move(answer))} {
    Handler& h = *handler_;
    const std::string file = testbed.real_path(h.path);
    ::unlink(file.c_str());
    FOVEA_REQUIRE(::mkfifo(file.c_str(), 0600) == 0);
    h.far_end = UniqueFd(::open(file.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
    // Packet mode; a FIFO takes it by fcntl() only.
    FOVEA_REQUIRE(h.far_end.get() >= 0 && ::fcntl(h.far_end.get(), F_SETFL, O_RDWR | O_NONBLOCK | O_DIRECT) == 0);
    h.base = umockdev_ioctl_base_new();
    g_signal_connect(h.base, "handle-ioctl", G_CALLBACK(&Handler::on_ioctl), &h);
    g_signal_connect(h.base, "handle-read", G_CALLBACK(&Handler::on_read), &h);
    GError* error = nullptr;
    FOVEA_REQUIRE(umockdev_testbed_attach_ioctl(testbed.parts_->bed, h.path.c_str(), h.base, &error) != FALSE);
}

Node::~Node() {
    umockdev_testbed_detach_ioctl(handler_->testbed.parts_->bed, handler_->path.c_str(), nullptr);
    g_object_unref(handler_->base);
}

void Node::send(std::span<const std::uint8_t> packet) {
    FOVEA_REQUIRE(::write(handler_->far_end.get(), packet.data(), packet.size()) == static_cast<ssize_t>(packet.size()));
}

void Node::unplug() {
    handler_->unplugged = true;
    const std::uint8_t wake = 0;
    send({&wake, 1});
}

void Node::drain() {
    std::uint8_t bytes[4096];
    while (::read(handler_->far_end.get(), bytes, sizeof bytes) > 0) {}
}

void Node::fill() {
    const std::uint8_t byte = 0;
    while (::write(handler_->far_end.get(), &byte, 1) > 0) {}   // packet mode: each write takes a page of the FIFO
}

std::string hex(std::span<const std::uint8_t> bytes) {
    std::string text;
    for (const std::uint8_t b : bytes) text += fmt::format("{:02X}", b);
    return text;
}

}  // namespace fovea::tests
