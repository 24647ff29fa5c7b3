// Sealed shared memory: made by the daemon, handed to clients as a file descriptor, mapped by both.
//
//   Access::daemon_writes   F_SEAL_SHRINK | GROW | FUTURE_WRITE | SEAL: the creator's mapping stays the only writable one
//   Access::client_writes   F_SEAL_SHRINK | GROW | SEAL: whoever holds the descriptor may write; untrusted bytes
//
// A region can never shrink, so no reader can be killed by SIGBUS.
//
// Source: memfd_create(2), fcntl(2) "File sealing"; Linux 5.1 or newer for F_SEAL_FUTURE_WRITE.
// Threads: a SharedMemory is plain data with one owner; what it maps is shared by contract of each region.
// Errors: Error with the system's reason; a descriptor that lacks the seals or the size is refused.
#pragma once

#include <cstddef>
#include <cstdint>

#include "protocol/error.hpp"
#include "protocol/unique_fd.hpp"

namespace fovea {

enum class Access : std::uint8_t { daemon_writes, client_writes };

class SharedMemory {
public:
    // A new region of `bytes` zeros, mapped writable here and then sealed. `name` shows in /proc/PID/maps.
    [[nodiscard]] static Result<SharedMemory> create(const char* name, std::size_t bytes, Access access);
    // Maps somebody else's region, read-only for daemon_writes and writable for client_writes, after checking its seals
    // and that it holds min_bytes to max_bytes. Does not take the descriptor; it may be closed afterwards.
    [[nodiscard]] static Result<SharedMemory> map(int fd, Access access, std::size_t min_bytes, std::size_t max_bytes);

    SharedMemory() noexcept = default;
    SharedMemory(SharedMemory&& other) noexcept;
    SharedMemory& operator=(SharedMemory&& other) noexcept;
    ~SharedMemory();

    [[nodiscard]] std::byte* data() const noexcept { return data_; }
    [[nodiscard]] std::size_t size() const noexcept { return size_; }
    // To be handed to clients; -1 for a region that was mapped, not created.
    [[nodiscard]] int fd() const noexcept { return fd_.get(); }

private:
    void unmap() noexcept;
    std::byte* data_ = nullptr;
    std::size_t size_ = 0;
    UniqueFd fd_;
};

}  // namespace fovea
