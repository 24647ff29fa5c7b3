#include "tests/allocation/allocation_count.hpp"

#include <cstdlib>

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
namespace {
thread_local std::size_t count = 0, bytes_asked = 0;

void note(std::size_t bytes) noexcept {
    ++count;
    bytes_asked += bytes;
}
}  // namespace

// glibc's own, under the names that it keeps for those who wrap them. operator new and libfovea.so come here too.
extern "C" {
void* __libc_malloc(std::size_t bytes);
void* __libc_calloc(std::size_t n, std::size_t bytes);
void* __libc_realloc(void* old, std::size_t bytes);
void* __libc_memalign(std::size_t alignment, std::size_t bytes);
void* malloc(std::size_t bytes) { return note(bytes), __libc_malloc(bytes); }
void* calloc(std::size_t n, std::size_t bytes) { return note(n * bytes), __libc_calloc(n, bytes); }
void* realloc(void* old, std::size_t bytes) { return note(bytes), __libc_realloc(old, bytes); }
void* aligned_alloc(std::size_t alignment, std::size_t bytes) { return note(bytes), __libc_memalign(alignment, bytes); }
}

namespace fovea::test {
std::size_t allocations() noexcept { return count; }
bool counts_allocations() noexcept { return true; }
std::size_t allocated_bytes() noexcept { return bytes_asked; }
}  // namespace fovea::test
#else
namespace fovea::test {
std::size_t allocations() noexcept { return 0; }
bool counts_allocations() noexcept { return false; }
std::size_t allocated_bytes() noexcept { return 0; }
}  // namespace fovea::test
#endif
