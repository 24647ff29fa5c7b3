#include "drivers/camera/v4l2_calls.hpp"

#include <cerrno>
#include <fcntl.h>
#include <linux/dma-heap.h>
#include <linux/udmabuf.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include "protocol/unique_fd.hpp"

namespace fovea::drivers::camera {

namespace {

class Kernel final : public V4l2Calls {
public:
    int open(const char* node) noexcept override { return ::open(node, O_RDWR | O_NONBLOCK | O_CLOEXEC); }
    void close(int fd) noexcept override { ::close(fd); }
    int ioctl(int fd, unsigned long request, void* argument) noexcept override {
        int r = 0;
        do r = ::ioctl(fd, request, argument);
        while (r < 0 && errno == EINTR);
        return r;
    }
    void* map(std::size_t bytes, int fd, off_t offset) noexcept override {
        return ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd, offset);
    }
    void unmap(void* data, std::size_t bytes) noexcept override { ::munmap(data, bytes); }
    int dma_buffer(std::size_t bytes) noexcept override {
        if (const UniqueFd heap(::open("/dev/dma_heap/system", O_RDWR | O_CLOEXEC)); heap) {
            dma_heap_allocation_data a{};
            a.len = bytes;
            a.fd_flags = O_RDWR | O_CLOEXEC;
            if (ioctl(heap.get(), DMA_HEAP_IOCTL_ALLOC, &a) == 0) return static_cast<int>(a.fd);
        }
        const UniqueFd udmabuf(::open("/dev/udmabuf", O_RDWR | O_CLOEXEC));
        const UniqueFd memory(::memfd_create("fovea-camera", MFD_CLOEXEC | MFD_ALLOW_SEALING));
        if (!udmabuf || !memory || ::ftruncate(memory.get(), static_cast<off_t>(bytes)) != 0 ||
            ::fcntl(memory.get(), F_ADD_SEALS, F_SEAL_SHRINK) != 0)
            return -1;
        udmabuf_create c{};
        c.memfd = static_cast<__u32>(memory.get());
        c.flags = UDMABUF_FLAGS_CLOEXEC;
        c.size = bytes;
        return ioctl(udmabuf.get(), UDMABUF_CREATE, &c);
    }
};

}  // namespace

V4l2Calls& kernel_v4l2() noexcept {
    static Kernel kernel;
    return kernel;
}

}  // namespace fovea::drivers::camera
