// The same still picture from a camera by each way that a frame's memory can be had.
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <linux/videodev2.h>
#include <poll.h>

#include "drivers/camera/v4l2_stream.hpp"
#include "tests/device_lab/feed.hpp"
#include "tests/device_lab/probe.hpp"

namespace fovea::lab {
namespace {

using drivers::camera::BufferMemory;

// The kernel's calls, but for ways of having memory that this camera is said to refuse.
class Refusing final : public drivers::camera::V4l2Calls {
public:
    explicit Refusing(BufferMemory only) : only_{only} {}
    int open(const char* node) noexcept override { return kernel_.open(node); }
    void close(int fd) noexcept override { kernel_.close(fd); }
    int ioctl(int fd, unsigned long request, void* argument) noexcept override {
        if (request == VIDIOC_REQBUFS) {
            const auto& r = *static_cast<v4l2_requestbuffers*>(argument);
            const auto wanted = only_ == BufferMemory::mapped ? V4L2_MEMORY_MMAP : only_ == BufferMemory::user_pointer ? V4L2_MEMORY_USERPTR : V4L2_MEMORY_DMABUF;
            if (r.count > 0 && r.memory != static_cast<__u32>(wanted)) {
                errno = EINVAL;
                return -1;
            }
        }
        return kernel_.ioctl(fd, request, argument);
    }
    void* map(std::size_t bytes, int fd, off_t offset) noexcept override { return kernel_.map(bytes, fd, offset); }
    void unmap(void* data, std::size_t bytes) noexcept override { kernel_.unmap(data, bytes); }
    int dma_buffer(std::size_t bytes) noexcept override { return kernel_.dma_buffer(bytes); }

private:
    BufferMemory only_;
    drivers::camera::V4l2Calls& kernel_ = drivers::camera::kernel_v4l2();
};

// vivid writes the time into its pictures, and can be told not to.
void set_control(int fd, const char* name, int value) {
    v4l2_queryctrl q{};
    q.id = V4L2_CTRL_FLAG_NEXT_CTRL;
    while (drivers::camera::kernel_v4l2().ioctl(fd, VIDIOC_QUERYCTRL, &q) == 0) {
        if (std::strcmp(reinterpret_cast<const char*>(q.name), name) == 0) {
            v4l2_control c{q.id, value};
            if (drivers::camera::kernel_v4l2().ioctl(fd, VIDIOC_S_CTRL, &c) != 0) die(name);
            return;
        }
        q.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
    }
    die(std::string("the camera has no control ") + name);
}

std::vector<std::uint8_t> picture(const std::string& node, BufferMemory memory, const std::string& format, int pattern, unsigned long frames) {
    Refusing calls(memory);
    drivers::camera::V4l2Stream stream(calls);
    drivers::camera::StreamSettings settings;
    settings.path = node;
    settings.format = format;
    settings.width = 640;
    settings.height = 360;
    if (auto opened = stream.open(settings); !opened) die(opened.error().message());
    if (stream.memory() != memory) die(std::string("memory is ") + to_string(stream.memory()));
    set_control(stream.fd(), "OSD Text Mode", 2);
    set_control(stream.fd(), "Test Pattern", pattern);
    std::vector<std::uint8_t> last;
    const Instant end = MonotonicClock::now() + std::chrono::seconds(30);
    for (unsigned long n = 0; n < frames && MonotonicClock::now() < end;) {
        pollfd p{stream.fd(), POLLIN, 0};
        ::poll(&p, 1, 200);
        drivers::camera::Frame frame;
        switch (stream.next(frame, MonotonicClock::now())) {
            case drivers::camera::FrameEvent::frame:
                last.assign(frame.bytes.begin(), frame.bytes.end());
                ++n;
                break;
            case drivers::camera::FrameEvent::nothing: break;
            case drivers::camera::FrameEvent::lost: die("lost");
        }
    }
    return last;
}

}  // namespace

// Exit status 0: all three ways gave the same bytes, and another picture other bytes.
int dma_frames(const std::string& node, int argc, char** argv) {
    const Arguments args(argc, argv, {"--format", "--frames"});
    const std::string format = args.text("--format", "GREY");
    const auto frames = static_cast<unsigned long>(args.number("--frames", 12));
    const auto mapped = picture(node, BufferMemory::mapped, format, 0, frames);
    const auto pointed = picture(node, BufferMemory::user_pointer, format, 0, frames);
    const auto shared = picture(node, BufferMemory::dma_buffer, format, 0, frames);
    const auto other = picture(node, BufferMemory::dma_buffer, format, 10, frames);
    const auto differing = [&](const std::vector<std::uint8_t>& a) {
        std::size_t n = a.size() == mapped.size() ? 0 : std::max(a.size(), mapped.size());
        for (std::size_t i = 0; n == 0 && i < a.size(); ++i) n += a[i] != mapped[i] ? 1 : 0;
        return n;
    };
    std::size_t dark = 0;
    for (const auto b : mapped) dark += b < 8 ? 1 : 0;
    std::printf("dma bytes=%zu dark=%zu user_pointer_differing=%zu dma_differing=%zu other_picture_differs=%d\n", mapped.size(), dark, differing(pointed),
                differing(shared), differing(other) != 0 && other.size() == mapped.size());
    const bool ok = !mapped.empty() && dark < mapped.size() && differing(pointed) == 0 && differing(shared) == 0 && differing(other) != 0 && other.size() == mapped.size();
    return ok ? 0 : 1;
}

}  // namespace fovea::lab
