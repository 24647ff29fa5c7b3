#include "tests/drivers/camera/fake_camera.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <linux/dma-buf.h>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <unistd.h>

namespace fovea::tests {

namespace {

std::uint32_t bytes_per_pixel(std::uint32_t fourcc) {
    return fourcc == V4L2_PIX_FMT_GREY ? 1 : 2;
}

void ring(int fd) {
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t n = ::write(fd, &one, sizeof one);
}

int refuse(int code) {
    errno = code;
    return -1;
}

}  // namespace

FakeCameras::~FakeCameras() {
    for (auto& [node, c] : cameras_)
        if (c.fd >= 0) ::close(c.fd);
    for (auto& [fd, bytes] : dma_) ::close(fd);
}

FakeCamera* FakeCameras::of(int fd) {
    for (auto& [node, c] : cameras_)
        if (c.fd == fd) return &c;
    return nullptr;
}

void FakeCameras::show(const std::string& node, FakeCamera::Picture picture) {
    const std::lock_guard lock(mutex_);
    FakeCamera& c = cameras_.at(node);
    c.waiting.push_back(std::move(picture));
    if (c.fd >= 0) ring(c.fd);
}

void FakeCameras::unplug(const std::string& node) {
    const std::lock_guard lock(mutex_);
    FakeCamera& c = cameras_.at(node);
    c.plugged = false;
    if (c.fd >= 0) ring(c.fd);
}

void FakeCameras::plug_in(const std::string& node) {
    const std::lock_guard lock(mutex_);
    cameras_.at(node).plugged = true;
    cameras_.at(node).waiting.clear();
}

int FakeCameras::open(const char* node) noexcept {
    const std::lock_guard lock(mutex_);
    const auto it = cameras_.find(node);
    if (it == cameras_.end() || !it->second.plugged) return refuse(ENOENT);
    FakeCamera& c = it->second;
    if (c.fd >= 0) return refuse(EBUSY);
    c.fd = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK | EFD_SEMAPHORE);
    for (std::size_t i = 0; i < c.waiting.size(); ++i) ring(c.fd);
    ++c.opens;
    ++open_;
    return c.fd;
}

void FakeCameras::close(int fd) noexcept {
    const std::lock_guard lock(mutex_);
    if (FakeCamera* c = of(fd)) {
        c->fd = -1;
        c->streaming = false;
        --open_;
    } else if (dma_.erase(fd) == 1) {
        --dma_fds_;
    }
    ::close(fd);
}

int FakeCameras::ioctl(int fd, unsigned long request, void* argument) noexcept {
    const std::lock_guard lock(mutex_);
    if (FakeCamera* c = of(fd)) return c->plugged ? answer(*c, request, argument) : refuse(ENODEV);
    if (dma_.contains(fd) && request == DMA_BUF_IOCTL_SYNC) {
        ++syncs_;
        return 0;
    }
    return refuse(EBADF);
}

int FakeCameras::answer(FakeCamera& c, unsigned long request, void* argument) {
    switch (request) {
        case VIDIOC_QUERYCAP: {
            auto& cap = *static_cast<v4l2_capability*>(argument);
            cap = {};
            std::memcpy(cap.card, "Made camera", 12);
            cap.capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
            return 0;
        }
        case VIDIOC_ENUM_FMT: {
            auto& f = *static_cast<v4l2_fmtdesc*>(argument);
            if (f.index >= c.formats.size()) return refuse(EINVAL);
            f.pixelformat = c.formats[f.index];
            return 0;
        }
        case VIDIOC_G_FMT:
        case VIDIOC_S_FMT: {
            v4l2_pix_format& pix = static_cast<v4l2_format*>(argument)->fmt.pix;
            if (request == VIDIOC_G_FMT || std::ranges::find(c.formats, pix.pixelformat) == c.formats.end()) pix.pixelformat = c.formats[0];
            pix.width = c.width;
            pix.height = c.height;
            pix.bytesperline = c.tells_sizes && pix.pixelformat != V4L2_PIX_FMT_MJPEG ? c.width * bytes_per_pixel(pix.pixelformat) : 0;
            pix.sizeimage = c.tells_sizes ? c.width * c.height * bytes_per_pixel(pix.pixelformat) : 0;
            return 0;
        }
        case VIDIOC_G_PARM:
        case VIDIOC_S_PARM: static_cast<v4l2_streamparm*>(argument)->parm.capture.timeperframe = {1, c.rate_hz}; return 0;
        case VIDIOC_S_CTRL: {
            const auto& control = *static_cast<v4l2_control*>(argument);
            c.controls[control.id] = control.value;
            return 0;
        }
        case VIDIOC_REQBUFS: {
            auto& r = *static_cast<v4l2_requestbuffers*>(argument);
            if (!(r.memory == V4L2_MEMORY_MMAP ? c.offers_mapping : r.memory == V4L2_MEMORY_USERPTR ? c.offers_user_pointers : c.offers_dma_buffers))
                return refuse(EINVAL);
            c.memory = r.memory;
            c.queued.clear();
            c.own.assign(r.memory == V4L2_MEMORY_MMAP ? r.count : 0, std::vector<std::uint8_t>(c.width * c.height * 4));
            return 0;
        }
        case VIDIOC_QUERYBUF: {
            auto& v = *static_cast<v4l2_buffer*>(argument);
            if (v.index >= c.own.size()) return refuse(EINVAL);
            v.length = static_cast<std::uint32_t>(c.own[v.index].size());
            v.m.offset = v.index * 4096;
            return 0;
        }
        case VIDIOC_QBUF: {
            const auto& v = *static_cast<v4l2_buffer*>(argument);
            if (v.memory != c.memory) return refuse(EINVAL);
            if (v.memory == V4L2_MEMORY_MMAP) c.queued.push_back({v.index, c.own.at(v.index).data(), c.own[v.index].size()});
            else if (v.memory == V4L2_MEMORY_USERPTR) c.queued.push_back({v.index, reinterpret_cast<std::uint8_t*>(v.m.userptr), v.length});
            else c.queued.push_back({v.index, dma_.at(v.m.fd).data(), dma_.at(v.m.fd).size()});
            return 0;
        }
        case VIDIOC_DQBUF: return hand_over(c, *static_cast<v4l2_buffer*>(argument));
        case VIDIOC_STREAMON: c.streaming = true; return 0;
        case VIDIOC_STREAMOFF: c.streaming = false; return 0;
        default: return refuse(ENOTTY);
    }
}

int FakeCameras::hand_over(FakeCamera& c, v4l2_buffer& v) {
    std::uint64_t taken = 0;
    if (!c.streaming) return refuse(EINVAL);
    if (c.waiting.empty() || c.queued.empty() || ::read(c.fd, &taken, sizeof taken) < 0) return refuse(EAGAIN);
    const FakeCamera::Picture p = std::move(c.waiting.front());
    c.waiting.pop_front();
    const FakeCamera::Queued q = c.queued.front();
    c.queued.pop_front();
    const std::size_t bytes = std::min(p.bytes.size(), q.length);
    std::memcpy(q.data, p.bytes.data(), bytes);
    v.index = q.index;
    v.bytesused = p.tells_bytes ? static_cast<std::uint32_t>(bytes) : 0;
    v.sequence = p.sequence;
    v.timestamp = {p.captured_ns / 1'000'000'000, p.captured_ns / 1000 % 1'000'000};
    v.flags = c.stamp_flag | p.flags;
    return 0;
}

void* FakeCameras::map(std::size_t bytes, int fd, off_t offset) noexcept {
    const std::lock_guard lock(mutex_);
    if (FakeCamera* c = of(fd)) {
        const auto index = static_cast<std::size_t>(offset / 4096);
        if (!c->maps || index >= c->own.size() || bytes > c->own[index].size()) {
            errno = ENOMEM;
            return MAP_FAILED;
        }
        ++maps_;
        return c->own[index].data();
    }
    const auto it = dma_.find(fd);
    if (it == dma_.end() || bytes > it->second.size()) return MAP_FAILED;
    ++maps_;
    return it->second.data();
}

void FakeCameras::unmap(void*, std::size_t) noexcept { --maps_; }

int FakeCameras::dma_buffer(std::size_t bytes) noexcept {
    const std::lock_guard lock(mutex_);
    if (!has_dma_heap) return refuse(ENOENT);
    const int fd = ::eventfd(0, EFD_CLOEXEC);   // a number of its own
    dma_[fd].resize(bytes);
    ++dma_fds_;
    return fd;
}

}  // namespace fovea::tests
