#include "drivers/camera/v4l2_stream.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <linux/dma-buf.h>
#include <linux/videodev2.h>
#include <sys/mman.h>

#include <fmt/format.h>

#include "drivers/access.hpp"

namespace fovea::drivers::camera {

namespace {

constexpr std::size_t kMaxImageBytes = std::size_t{kMaxImageSide} * kMaxImageSide * 2;
constexpr unsigned kMaxFaultsInARow = 32;
constexpr std::size_t kPage = 4096;
constexpr std::int64_t kMaxStamp_s = 9'000'000'000;   // 285 years: the last whole thousand million below 2^63 ns

struct KnownFormat {
    PixelFormat format;
    std::uint32_t fourcc;
    std::size_t bytes_per_pixel;   // 0: compressed
};
// In the order of preference: no decoding first.
constexpr KnownFormat kFormats[] = {
    {PixelFormat::grey, V4L2_PIX_FMT_GREY, 1},
    {PixelFormat::y16, V4L2_PIX_FMT_Y16, 2},
    {PixelFormat::yuyv, V4L2_PIX_FMT_YUYV, 2},
    {PixelFormat::mjpg, V4L2_PIX_FMT_MJPEG, 0},
};

const KnownFormat* by_fourcc(std::uint32_t fourcc) noexcept {
    for (const KnownFormat& f : kFormats)
        if (f.fourcc == fourcc) return &f;
    return nullptr;
}

constexpr std::uint32_t v4l2_memory(BufferMemory m) noexcept {
    switch (m) {
        case BufferMemory::user_pointer: return V4L2_MEMORY_USERPTR;
        case BufferMemory::dma_buffer: return V4L2_MEMORY_DMABUF;
        case BufferMemory::none:
        case BufferMemory::mapped: break;
    }
    return V4L2_MEMORY_MMAP;
}

std::string fourcc_text(std::uint32_t v) {
    std::string text(4, ' ');
    for (int i = 0; i < 4; ++i) {
        const auto c = static_cast<char>(v >> (8 * i));
        text[static_cast<std::size_t>(i)] = c >= 32 && c < 127 ? c : '?';
    }
    return text;
}

}  // namespace

const char* to_string(BufferMemory memory) noexcept {
    switch (memory) {
        case BufferMemory::none: return "none";
        case BufferMemory::mapped: return "memory mapping";
        case BufferMemory::user_pointer: return "user pointers";
        case BufferMemory::dma_buffer: return "DMA-BUFs";
    }
    return "none";
}

std::vector<PixelFormat> usable_formats(int fd, V4l2Calls& calls) {
    std::vector<PixelFormat> found;
    for (std::uint32_t i = 0; i < 256; ++i) {
        v4l2_fmtdesc d{};
        d.index = i;
        d.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
        if (calls.ioctl(fd, VIDIOC_ENUM_FMT, &d) != 0) break;
        if (const KnownFormat* f = by_fourcc(d.pixelformat)) found.push_back(f->format);
    }
    return found;
}

Result<void> V4l2Stream::open(const StreamSettings& settings) {
    close();
    fd_ = calls_->open(settings.path.c_str());
    if (fd_ < 0) return cannot_open(settings.path, errno);
    counters_ = {};
    not_granted_.clear();
    held_ = -1;
    has_sequence_ = false;
    faults_in_a_row_ = 0;
    auto ready = negotiate(settings);
    if (ready) ready = set_up_buffers(settings.buffers);
    if (ready) {
        set_controls(settings);
        int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
        if (calls_->ioctl(fd_, VIDIOC_STREAMON, &type) != 0) {
            const int code = errno;
            ready = code == EBUSY ? Result<void>(cannot_open(settings.path, EBUSY))
                                  : fail_errno("the camera does not start", code, settings.path);
        }
    }
    if (!ready) close();
    return ready;
}

Result<void> V4l2Stream::negotiate(const StreamSettings& settings) {
    v4l2_capability cap{};
    if (calls_->ioctl(fd_, VIDIOC_QUERYCAP, &cap) != 0)
        return fail_errno("this is no video device", errno, settings.path, "`fovea devices camera` lists the cameras");
    card_.assign(reinterpret_cast<const char*>(cap.card), strnlen(reinterpret_cast<const char*>(cap.card), sizeof cap.card));
    const std::uint32_t can = (cap.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? cap.device_caps : cap.capabilities;
    if ((can & V4L2_CAP_VIDEO_CAPTURE) == 0 || (can & V4L2_CAP_STREAMING) == 0)
        return fail("this video device does not stream pictures", settings.path, "`fovea devices camera` lists the cameras");

    const auto usable = usable_formats(fd_, *calls_);
    const KnownFormat* chosen = nullptr;
    for (const KnownFormat& f : kFormats)
        if (chosen == nullptr && std::ranges::find(usable, f.format) != usable.end() &&
            (settings.format == "auto" || settings.format == to_string(f.format)))
            chosen = &f;
    if (chosen == nullptr) {
        std::string offers;
        for (const PixelFormat f : usable) offers += std::string(offers.empty() ? "" : ", ") + to_string(f);
        return fail("the camera does not offer " + (settings.format == "auto" ? std::string("GREY, Y16, YUYV or MJPG") : settings.format),
                    settings.path, offers.empty() ? "use another camera" : "it offers " + offers);
    }
    v4l2_format format{};
    format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (calls_->ioctl(fd_, VIDIOC_G_FMT, &format) != 0) return fail_errno("the camera tells no format", errno, settings.path);
    if (settings.width > 0) format.fmt.pix.width = static_cast<std::uint32_t>(settings.width);
    if (settings.height > 0) format.fmt.pix.height = static_cast<std::uint32_t>(settings.height);
    format.fmt.pix.pixelformat = chosen->fourcc;
    format.fmt.pix.field = V4L2_FIELD_NONE;
    format.fmt.pix.bytesperline = 0;
    format.fmt.pix.sizeimage = 0;
    if (calls_->ioctl(fd_, VIDIOC_S_FMT, &format) != 0) {
        const int code = errno;
        return code == EBUSY ? cannot_open(settings.path, EBUSY)
                             : fail_errno("the camera refuses the format", code, settings.path);
    }
    const v4l2_pix_format& pix = format.fmt.pix;
    const KnownFormat* granted = by_fourcc(pix.pixelformat);
    if (granted == nullptr)
        return fail("the camera answers with the format " + fourcc_text(pix.pixelformat), settings.path,
                    "set format under [source] to one that it offers");
    if (pix.width < 1 || pix.height < 1 || pix.width > kMaxImageSide || pix.height > kMaxImageSide)
        return fail(fmt::format("the camera answers with {} x {} pixels", pix.width, pix.height), settings.path);
    format_ = granted->format;
    width_ = static_cast<int>(pix.width);
    height_ = static_cast<int>(pix.height);
    if (settings.width > 0 && (width_ != settings.width || height_ != settings.height))
        not_granted_.push_back(fmt::format("size: {} x {} in place of {} x {}", width_, height_, settings.width, settings.height));
    const std::size_t least = pix.width * granted->bytes_per_pixel;
    stride_ = granted->bytes_per_pixel == 0 ? 0 : std::max<std::size_t>(pix.bytesperline, least);
    const std::size_t raw = granted->bytes_per_pixel == 0 ? std::size_t{pix.width} * pix.height * 2 : stride_ * pix.height;
    image_bytes_ = std::max<std::size_t>(pix.sizeimage, raw);
    if (image_bytes_ > kMaxImageBytes)
        return fail(fmt::format("the camera wants {} bytes for a picture", image_bytes_), settings.path);

    v4l2_streamparm parm{};
    parm.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (calls_->ioctl(fd_, VIDIOC_G_PARM, &parm) == 0) {
        if (settings.rate_hz > 0) {
            parm.parm.capture.timeperframe = {1000, static_cast<std::uint32_t>(settings.rate_hz * 1000 + 0.5)};
            if (calls_->ioctl(fd_, VIDIOC_S_PARM, &parm) != 0) not_granted_.push_back("the frame rate");
        }
        const v4l2_fract t = parm.parm.capture.timeperframe;
        rate_hz_ = t.numerator > 0 ? static_cast<double>(t.denominator) / t.numerator : 0;
    } else if (settings.rate_hz > 0) {
        not_granted_.push_back("the frame rate");
    }
    return {};
}

void V4l2Stream::set_controls(const StreamSettings& settings) {
    const auto set = [&](std::uint32_t id, std::int32_t value, const char* name) {
        v4l2_control c{id, value};
        if (calls_->ioctl(fd_, VIDIOC_S_CTRL, &c) != 0) not_granted_.push_back(fmt::format("{} {}", name, value));
    };
    if (settings.exposure_us > 0) {
        set(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL, "manual exposure");
        set(V4L2_CID_EXPOSURE_ABSOLUTE, std::max(1, (settings.exposure_us + 50) / 100), "exposure, 100 us units,");
    }
    if (settings.gain >= 0) set(V4L2_CID_GAIN, settings.gain, "gain");
}

Result<void> V4l2Stream::set_up_buffers(unsigned count) {
    std::string tried;
    for (const BufferMemory memory : {BufferMemory::mapped, BufferMemory::user_pointer, BufferMemory::dma_buffer}) {
        auto ready = set_up_buffers(memory, count);
        if (ready) return ready;
        if (errno_of_request_ == EBUSY) return cannot_open(card_, EBUSY);
        tried += std::string(tried.empty() ? "" : "; ") + to_string(memory) + ": " + ready.error().what;
    }
    return fail("the camera's pictures cannot be taken over (" + tried + ")", card_, "use another camera");
}

Result<void> V4l2Stream::set_up_buffers(BufferMemory memory, unsigned count) {
    v4l2_requestbuffers request{};
    request.count = count;
    request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    request.memory = v4l2_memory(memory);
    errno_of_request_ = 0;
    if (calls_->ioctl(fd_, VIDIOC_REQBUFS, &request) != 0) {
        errno_of_request_ = errno;
        return fail_errno("not offered", errno_of_request_);
    }
    memory_ = memory;
    const auto give_up = [&](std::unexpected<Error> e) {
        release_buffers();
        return e;
    };
    if (request.count < 2 || request.count > 64) return give_up(fail(fmt::format("{} buffers granted", request.count)));
    for (unsigned i = 0; i < request.count; ++i) {
        buffers_.emplace_back();
        Buffer& b = buffers_.back();
        if (memory == BufferMemory::mapped) {
            v4l2_buffer v{};
            v.index = i;
            v.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
            v.memory = request.memory;
            if (calls_->ioctl(fd_, VIDIOC_QUERYBUF, &v) != 0 || v.length == 0 || v.length > 2 * kMaxImageBytes)
                return give_up(fail("no buffers to map"));
            b.length = v.length;
            b.data = calls_->map(b.length, fd_, static_cast<off_t>(v.m.offset));
        } else if (memory == BufferMemory::user_pointer) {
            b.length = (image_bytes_ + kPage - 1) & ~(kPage - 1);
            b.data = std::aligned_alloc(kPage, b.length);
        } else {
            b.length = (image_bytes_ + kPage - 1) & ~(kPage - 1);
            b.dma_fd = calls_->dma_buffer(b.length);
            if (b.dma_fd < 0) return give_up(fail("this system makes none (/dev/dma_heap/system, /dev/udmabuf)"));
            b.data = calls_->map(b.length, b.dma_fd, 0);
        }
        if (b.data == nullptr || b.data == MAP_FAILED) return give_up(fail("no memory"));
        if (!queue(i)) return give_up(fail_errno("a buffer is not accepted", errno));
    }
    return {};
}

void V4l2Stream::release_buffers() noexcept {
    for (const Buffer& b : buffers_) {
        if (b.data != nullptr && b.data != MAP_FAILED) {
            if (memory_ == BufferMemory::user_pointer) std::free(b.data);
            else calls_->unmap(b.data, b.length);
        }
        if (b.dma_fd >= 0) calls_->close(b.dma_fd);
    }
    buffers_.clear();
    if (fd_ >= 0 && memory_ != BufferMemory::none) {   // whatever was queued is the driver's no longer
        v4l2_requestbuffers none{};
        none.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
        none.memory = v4l2_memory(memory_);
        calls_->ioctl(fd_, VIDIOC_REQBUFS, &none);
    }
    memory_ = BufferMemory::none;
}

bool V4l2Stream::queue(unsigned index) noexcept {
    const Buffer& b = buffers_[index];
    v4l2_buffer v{};
    v.index = index;
    v.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    v.memory = v4l2_memory(memory_);
    v.length = static_cast<std::uint32_t>(b.length);
    if (memory_ == BufferMemory::user_pointer) v.m.userptr = reinterpret_cast<unsigned long>(b.data);
    if (memory_ == BufferMemory::dma_buffer) v.m.fd = b.dma_fd;
    return calls_->ioctl(fd_, VIDIOC_QBUF, &v) == 0;
}

void V4l2Stream::bracket_read(int index, bool begin) noexcept {
    if (memory_ != BufferMemory::dma_buffer || index < 0) return;
    dma_buf_sync sync{};
    sync.flags = DMA_BUF_SYNC_READ | (begin ? DMA_BUF_SYNC_START : DMA_BUF_SYNC_END);
    calls_->ioctl(buffers_[static_cast<std::size_t>(index)].dma_fd, DMA_BUF_IOCTL_SYNC, &sync);
}

int V4l2Stream::dequeue(Frame& out, Instant now) noexcept {
    v4l2_buffer v{};
    v.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    v.memory = v4l2_memory(memory_);
    if (calls_->ioctl(fd_, VIDIOC_DQBUF, &v) != 0) {
        if (errno == EAGAIN) return -1;
        if (errno == EIO && ++faults_in_a_row_ <= kMaxFaultsInARow) {
            ++counters_.broken;
            return -1;
        }
        return -2;   // ENODEV: unplugged; EINVAL and the like: the stream is over
    }
    if (v.index >= buffers_.size()) return -2;
    const Buffer& b = buffers_[v.index];
    std::size_t size = std::min<std::size_t>(v.bytesused, b.length), at = 0;
    if (format_ != PixelFormat::mjpg) {
        const std::size_t one = stride_ * static_cast<std::size_t>(height_);
        if (size == 0) size = std::min(one, b.length);   // some drivers leave bytesused at 0
        if (one > 0 && size >= 2 * one && size % one == 0) {
            counters_.dropped += size / one - 1;
            at = size - one;
        }
    }
    out.bytes = {static_cast<const std::uint8_t*>(b.data) + at, size - at};
    out.sequence = v.sequence;
    out.received = now;
    out.captured_known = (v.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
    // A stamp that our nanoseconds cannot hold is none.
    out.captured_known = out.captured_known && v.timestamp.tv_sec >= 0 && v.timestamp.tv_sec < kMaxStamp_s &&
                         v.timestamp.tv_usec >= 0 && v.timestamp.tv_usec < 1'000'000;
    const std::int64_t stamp_ns =
        out.captured_known ? std::int64_t{v.timestamp.tv_sec} * 1'000'000'000 + std::int64_t{v.timestamp.tv_usec} * 1000 : 0;
    out.captured = out.captured_known ? std::min(instant_from_ns(stamp_ns), now) : now;
    if (has_sequence_) {
        const std::uint32_t step = v.sequence - last_sequence_;
        if (step > 1 && step < 1'000'000) counters_.dropped += step - 1;
    }
    has_sequence_ = true;
    last_sequence_ = v.sequence;
    if ((v.flags & V4L2_BUF_FLAG_ERROR) != 0) {
        ++counters_.broken;
        if (++faults_in_a_row_ > kMaxFaultsInARow || !queue(v.index)) return -2;
        return -1;
    }
    faults_in_a_row_ = 0;
    return static_cast<int>(v.index);
}

FrameEvent V4l2Stream::next(Frame& out, Instant now) noexcept {
    if (fd_ < 0) return FrameEvent::lost;
    bracket_read(held_, false);
    if (held_ >= 0 && !queue(static_cast<unsigned>(held_))) return FrameEvent::lost;
    held_ = -1;
    // Frames that waited while the last one was worked on are old by now: only the newest counts.
    for (std::size_t i = 0; i <= buffers_.size(); ++i) {
        Frame frame;
        const int index = dequeue(frame, now);
        if (index == -2) return FrameEvent::lost;
        if (index < 0) break;
        if (held_ >= 0) {
            ++counters_.dropped;
            if (!queue(static_cast<unsigned>(held_))) return FrameEvent::lost;
        }
        held_ = index;
        out = frame;
    }
    if (held_ < 0) return FrameEvent::nothing;
    bracket_read(held_, true);
    ++counters_.frames;
    return FrameEvent::frame;
}

void V4l2Stream::close() noexcept {
    if (fd_ >= 0) {
        int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
        calls_->ioctl(fd_, VIDIOC_STREAMOFF, &type);
    }
    release_buffers();
    if (fd_ >= 0) calls_->close(fd_);
    fd_ = -1;
    held_ = -1;
}

}  // namespace fovea::drivers::camera
