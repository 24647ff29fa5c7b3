#include "protocol/shared_memory.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>

#include <cerrno>
#include <string>

// <linux/memfd.h> and <fcntl.h> cannot be included together everywhere; the value is kernel ABI (Linux 5.1).
#ifndef F_SEAL_FUTURE_WRITE
#define F_SEAL_FUTURE_WRITE 0x0010
#endif

namespace fovea {
namespace {

int seals(Access access) noexcept {
    const int fixed_size = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL;
    return access == Access::daemon_writes ? fixed_size | F_SEAL_FUTURE_WRITE : fixed_size;
}

}  // namespace

Result<SharedMemory> SharedMemory::create(const char* name, std::size_t bytes, Access access) {
    SharedMemory memory;
    memory.fd_.reset(memfd_create(name, MFD_CLOEXEC | MFD_ALLOW_SEALING));
    if (!memory.fd_)
        return fail_errno("cannot create shared memory", errno, name, "Linux 5.1 or newer with memfd_create is needed");
    if (ftruncate(memory.fd(), static_cast<off_t>(bytes)) != 0)
        return fail_errno("cannot size shared memory to " + std::to_string(bytes) + " bytes", errno, name,
                          "free memory, or configure smaller rings");
    // Populated: a page that is first touched in the steady loop would hold it up by tens of microseconds.
    void* data = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, memory.fd(), 0);
    if (data == MAP_FAILED) return fail_errno("cannot map shared memory", errno, name, "free memory");
    memory.data_ = static_cast<std::byte*>(data);
    memory.size_ = bytes;
    // After the mapping above: from here on no further writable one can be made where the daemon alone writes.
    if (fcntl(memory.fd(), F_ADD_SEALS, seals(access)) != 0)
        return fail_errno("cannot seal shared memory", errno, name, "Linux 5.1 or newer is needed");
    return memory;
}

Result<SharedMemory> SharedMemory::map(int fd, Access access, std::size_t min_bytes, std::size_t max_bytes) {
    struct stat status {};
    if (fstat(fd, &status) != 0) return fail_errno("cannot examine shared memory", errno);
    const auto bytes = static_cast<std::size_t>(status.st_size);
    if (status.st_size < 0 || bytes < min_bytes || bytes > max_bytes)
        return fail("shared memory has " + std::to_string(status.st_size) + " bytes instead of " +
                        std::to_string(min_bytes) + (max_bytes == min_bytes ? "" : " or more"),
                    {}, "the daemon is no fovead of this version");
    const int present = fcntl(fd, F_GET_SEALS);
    if (present < 0 || (present & seals(access)) != seals(access))
        return fail("shared memory is not sealed", {}, "the daemon is no fovead of this version");
    const int protection = access == Access::daemon_writes ? PROT_READ : PROT_READ | PROT_WRITE;
    void* data = mmap(nullptr, bytes, protection, MAP_SHARED, fd, 0);
    if (data == MAP_FAILED) return fail_errno("cannot map shared memory", errno, {}, "free memory");
    SharedMemory memory;
    memory.data_ = static_cast<std::byte*>(data);
    memory.size_ = bytes;
    return memory;
}

SharedMemory::SharedMemory(SharedMemory&& other) noexcept
    : data_{std::exchange(other.data_, nullptr)}, size_{std::exchange(other.size_, 0)}, fd_{std::move(other.fd_)} {}

SharedMemory& SharedMemory::operator=(SharedMemory&& other) noexcept {
    if (this != &other) {
        unmap();
        data_ = std::exchange(other.data_, nullptr);
        size_ = std::exchange(other.size_, 0);
        fd_ = std::move(other.fd_);
    }
    return *this;
}

SharedMemory::~SharedMemory() { unmap(); }

void SharedMemory::unmap() noexcept {
    if (data_ != nullptr) munmap(data_, size_);
    data_ = nullptr;
}

}  // namespace fovea
