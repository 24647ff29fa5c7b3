// What a V4L2 stream asks of the kernel, as one table: the kernel's own, or a test's camera made of code.
//
// Each call is as in open(2), close(2), ioctl(2), mmap(2), munmap(2): a failed one sets errno.
// Threads: one stream at a time. All but open() and dma_buffer() are called in the steady loop or may be.
#pragma once

#include <cstddef>
#include <sys/types.h>

namespace fovea::drivers::camera {

class V4l2Calls {
public:
    virtual ~V4l2Calls() = default;
    [[nodiscard]] virtual int open(const char* node) noexcept = 0;   // for reading and writing, not blocking
    virtual void close(int fd) noexcept = 0;
    virtual int ioctl(int fd, unsigned long request, void* argument) noexcept = 0;
    [[nodiscard]] virtual void* map(std::size_t bytes, int fd, off_t offset) noexcept = 0;   // shared; MAP_FAILED
    virtual void unmap(void* data, std::size_t bytes) noexcept = 0;
    // A DMA-BUF of so many bytes, a multiple of the page: from the system's heap, else from anonymous memory; -1 where
    // the kernel has neither.
    [[nodiscard]] virtual int dma_buffer(std::size_t bytes) noexcept = 0;
};

[[nodiscard]] V4l2Calls& kernel_v4l2() noexcept;

}  // namespace fovea::drivers::camera
