// A machine with devices made of code, for the drivers as they are: /sys, udev and device nodes through umockdev.
//
// The drivers' own calls (libudev, hidapi, libusb, open(2), ioctl(2), ppoll(2)) run unchanged. umockdev's preloaded library turns
// /sys and /dev to a folder of ours and hands each ioctl() on a node to its Node, on a thread of umockdev. CTest starts
// the tests through umockdev-wrapper, which preloads it.
//
// A node is a FIFO in packet mode: one write is one read, and ppoll() waits for it as for a device.
// Threads: a node's answer() runs on umockdev's thread while the test waits in ioctl(); the rest is the test's.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "protocol/unique_fd.hpp"

namespace fovea::tests {

// False: the test must skip, and `why` says why.
[[nodiscard]] bool testbed_works(std::string& why);

class Testbed {
public:
    Testbed();
    ~Testbed();
    Testbed(const Testbed&) = delete;
    Testbed& operator=(const Testbed&) = delete;

    // Devices in umockdev's text format (man umockdev-record): P: path, N: node, E: property, A: attribute, H: the same
    // in hexadecimal, L: link. No event is sent.
    void add(const std::string& text);
    void send_event(const std::string& sys_path, const char* action);   // "add", "remove"
    void remove(const std::string& sys_path);
    [[nodiscard]] std::string real_path(const std::string& path) const;   // of /dev/... or /sys/..., past the preload

private:
    friend class Node;
    struct Parts;
    std::unique_ptr<Parts> parts_;
};

// As ioctl(2): `argument` points into the caller's memory (it is this process); the result, or minus the errno.
using IoctlAnswer = std::function<long(unsigned long request, void* argument)>;

class Node {
public:
    // Takes the place of the node that the testbed made for `path` ("/dev/hidraw0").
    Node(Testbed& testbed, std::string path, IoctlAnswer answer);
    ~Node();
    Node(const Node&) = delete;
    Node& operator=(const Node&) = delete;

    void send(std::span<const std::uint8_t> packet);   // one read(2) of the driver
    void unplug();                                     // read(2) says EIO from now on, ioctl(2) ENODEV
    // Readiness for drivers that never read(2) the node: readable once ready, or (libusb) writable once ready.
    void drain();                                      // takes back what was sent
    void fill();                                       // not writable until drain()
    struct Handler;

private:
    std::unique_ptr<Handler> handler_;
};

[[nodiscard]] std::string hex(std::span<const std::uint8_t> bytes);

}  // namespace fovea::tests
