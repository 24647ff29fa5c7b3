#include "render/layer/command_log.hpp"

#include <algorithm>

namespace fovea::layer {

void* CommandLog::allocate(std::size_t bytes) {
    constexpr std::size_t kChunkBytes = std::size_t{256} << 10;
    bytes = (bytes + kAlign - 1) / kAlign * kAlign;
    while (chunk_ < chunks_.size() && used_ + bytes > chunks_[chunk_].size) {
        ++chunk_;
        used_ = 0;
    }
    if (chunk_ == chunks_.size()) {
        const std::size_t size = std::max(bytes, kChunkBytes);
        chunks_.push_back({std::make_unique_for_overwrite<std::byte[]>(size), size});
        used_ = 0;
    }
    void* at = chunks_[chunk_].memory.get() + used_;
    used_ += bytes;
    bytes_ += bytes;
    return at;
}

void CommandLog::clear() noexcept {
    std::size_t kept = 0, i = 0;
    while (i < chunks_.size() && (kept += chunks_[i].size) <= kKeptBytes) ++i;
    chunks_.resize(std::min(i, chunks_.size()));
    chunk_ = used_ = bytes_ = 0;
    first_ = last_ = nullptr;
}

}  // namespace fovea::layer
