// Frames from one V4L2 camera: negotiation, buffers, controls, timestamps and sequence numbers.
//
// Source: Linux 6.1 V4L2 API (single-planar video capture, streaming I/O).
// What drivers get wrong and is put up with: sizeimage or bytesperline of 0 (computed from the format), two frames in one
// buffer (the newer one counts), timestamps in the future (clamped to the arrival), memory mapping refused (user
// pointers are tried next, then DMA-BUFs, each from asking for buffers to queueing the last one), rates and controls that they do not have (reported, not an error).
// Threads: one at a time. Errors: open() says what the camera cannot do and what it can.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "drivers/camera/image.hpp"
#include "drivers/camera/v4l2_calls.hpp"
#include "protocol/clock.hpp"
#include "protocol/error.hpp"

namespace fovea::drivers::camera {

struct StreamSettings {
    std::string path;               // "/dev/video0"
    int width = 0, height = 0;      // 0: as the camera has them now
    double rate_hz = 0;             // 0: as the camera has it now
    std::string format = "auto";    // auto, GREY, Y16, YUYV, MJPG
    int exposure_us = 0;            // 0: the camera's own choice
    int gain = -1;                  // -1: the camera's own choice
    unsigned buffers = 4;           // 2 to 16
};

enum class BufferMemory : std::uint8_t { none, mapped, user_pointer, dma_buffer };
[[nodiscard]] const char* to_string(BufferMemory memory) noexcept;

enum class FrameEvent : std::uint8_t { frame, nothing, lost };

struct Frame {
    std::span<const std::uint8_t> bytes;
    Instant captured;               // by the driver's stamp; the arrival where it has none of our clock
    bool captured_known = false;
    Instant received;
    std::uint32_t sequence = 0;
};

struct StreamCounters {
    std::uint64_t frames = 0, dropped = 0, broken = 0;   // dropped: gaps in the sequence, and frames passed over as old
};

class V4l2Stream {
public:
    explicit V4l2Stream(V4l2Calls& calls = kernel_v4l2()) noexcept : calls_{&calls} {}
    ~V4l2Stream() { close(); }
    V4l2Stream(const V4l2Stream&) = delete;
    V4l2Stream& operator=(const V4l2Stream&) = delete;

    [[nodiscard]] Result<void> open(const StreamSettings& settings);
    // The newest frame that is ready; never waits (wait on fd() for reading). The frame's bytes are valid until the next
    // call. noexcept, no allocation.
    [[nodiscard]] FrameEvent next(Frame& out, Instant now) noexcept;
    void close() noexcept;

    [[nodiscard]] int fd() const noexcept { return fd_; }
    [[nodiscard]] bool is_open() const noexcept { return fd_ >= 0; }
    [[nodiscard]] PixelFormat format() const noexcept { return format_; }
    [[nodiscard]] int width() const noexcept { return width_; }
    [[nodiscard]] int height() const noexcept { return height_; }
    [[nodiscard]] std::size_t stride() const noexcept { return stride_; }
    [[nodiscard]] double rate_hz() const noexcept { return rate_hz_; }
    [[nodiscard]] BufferMemory memory() const noexcept { return memory_; }
    [[nodiscard]] const std::string& card() const noexcept { return card_; }
    [[nodiscard]] const StreamCounters& counters() const noexcept { return counters_; }
    // What was asked for and not granted, in words.
    [[nodiscard]] const std::vector<std::string>& not_granted() const noexcept { return not_granted_; }

private:
    struct Buffer {
        void* data = nullptr;
        std::size_t length = 0;
        int dma_fd = -1;
    };
    [[nodiscard]] Result<void> negotiate(const StreamSettings& settings);
    [[nodiscard]] Result<void> set_up_buffers(unsigned count);
    [[nodiscard]] Result<void> set_up_buffers(BufferMemory memory, unsigned count);
    void release_buffers() noexcept;
    void bracket_read(int index, bool begin) noexcept;   // DMA-BUF: the processor's caches
    void set_controls(const StreamSettings& settings);
    [[nodiscard]] bool queue(unsigned index) noexcept;
    [[nodiscard]] int dequeue(Frame& out, Instant now) noexcept;   // buffer index, -1 nothing, -2 lost

    V4l2Calls* calls_;
    int fd_ = -1;
    PixelFormat format_ = PixelFormat::grey;
    int width_ = 0, height_ = 0;
    std::size_t stride_ = 0, image_bytes_ = 0;
    double rate_hz_ = 0;
    BufferMemory memory_ = BufferMemory::none;
    std::string card_;
    std::vector<Buffer> buffers_;
    std::vector<std::string> not_granted_;
    StreamCounters counters_;
    int errno_of_request_ = 0;
    int held_ = -1;              // the buffer whose bytes the caller is reading
    bool has_sequence_ = false;
    std::uint32_t last_sequence_ = 0;
    unsigned faults_in_a_row_ = 0;
};

// The formats that a camera offers and this driver reads; empty: none, or no camera. Does not start it.
[[nodiscard]] std::vector<PixelFormat> usable_formats(int fd, V4l2Calls& calls = kernel_v4l2());

}  // namespace fovea::drivers::camera
