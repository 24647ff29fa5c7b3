// Cameras made of code behind the V4L2 stream's table of calls: what they grant and refuse is set per test.
//
// Each opened node is an eventfd, so that the driver's real poll() waits on it. Threads: show() and unplug() from any.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include <linux/videodev2.h>

#include "drivers/camera/v4l2_calls.hpp"

namespace fovea::tests {

struct FakeCamera {
    // What it is.
    std::vector<std::uint32_t> formats = {V4L2_PIX_FMT_GREY};
    std::uint32_t width = 64, height = 48;
    std::uint32_t rate_hz = 100;
    bool offers_mapping = true, offers_user_pointers = true, offers_dma_buffers = true;
    bool maps = true;                   // false: mapping is offered, and fails
    bool tells_sizes = true;            // false: sizeimage and bytesperline stay 0
    std::uint32_t stamp_flag = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;

    struct Picture {
        std::vector<std::uint8_t> bytes;
        std::uint32_t sequence = 0;
        std::int64_t captured_ns = 0;
        std::uint32_t flags = 0;
        bool tells_bytes = true;        // false: bytesused stays 0
    };

    // What has become of it.
    int opens = 0;
    int fd = -1;
    bool streaming = false, plugged = true;
    std::uint32_t memory = 0;
    std::vector<std::vector<std::uint8_t>> own;      // mapped buffers
    struct Queued { std::uint32_t index; std::uint8_t* data; std::size_t length; };
    std::deque<Queued> queued;
    std::deque<Picture> waiting;
    std::map<std::uint32_t, std::int32_t> controls;
};

class FakeCameras final : public drivers::camera::V4l2Calls {
public:
    ~FakeCameras() override;
    FakeCamera& at(const std::string& node) { return cameras_[node]; }   // plugs one in
    void show(const std::string& node, FakeCamera::Picture picture);
    void unplug(const std::string& node);
    void plug_in(const std::string& node);
    [[nodiscard]] int held() const { return maps_ + dma_fds_ + open_; }   // what has been taken and not given back
    [[nodiscard]] int syncs() const { return syncs_; }

    bool has_dma_heap = true;

    int open(const char* node) noexcept override;
    void close(int fd) noexcept override;
    int ioctl(int fd, unsigned long request, void* argument) noexcept override;
    void* map(std::size_t bytes, int fd, off_t offset) noexcept override;
    void unmap(void* data, std::size_t bytes) noexcept override;
    int dma_buffer(std::size_t bytes) noexcept override;

private:
    FakeCamera* of(int fd);
    int answer(FakeCamera& c, unsigned long request, void* argument);
    int hand_over(FakeCamera& c, v4l2_buffer& v);
    std::mutex mutex_;
    std::map<std::string, FakeCamera> cameras_;
    std::map<int, std::vector<std::uint8_t>> dma_;   // by descriptor
    int maps_ = 0, dma_fds_ = 0, open_ = 0, syncs_ = 0;
};

}  // namespace fovea::tests
