// A listening Unix socket at a path, owned by exactly one daemon.
//
// A lock file beside the socket (PATH.lock, flock) says who owns the path: a second daemon is refused, and the socket
// file that a killed daemon left behind is taken over, because its lock died with it. Anything at the path that is not
// a socket is left alone. Socket and lock are removed when the object goes.
//
// Threads: one owner.
// Errors: the path is too long, in use, not a socket, or not writable; each names the path and the way out.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/unique_fd.hpp"

namespace fovea::service {

class Endpoint {
public:
    // `type`: SOCK_SEQPACKET or SOCK_STREAM. `mode`: permissions of the socket file. Missing folders are made: for the
    // user alone (0700), or to be passed through (0711) where `mode` admits others. The error's `what` begins with kInUse when another process serves the path.
    [[nodiscard]] static Result<Endpoint> listen(const std::string& path, int type, mode_t mode);
    static constexpr const char* kInUse = "another fovead";

    Endpoint(Endpoint&&) noexcept = default;
    Endpoint& operator=(Endpoint&&) = delete;
    ~Endpoint();

    // Other permissions of the socket file, and of the folders that listen() made, from now on.
    [[nodiscard]] Result<void> set_mode(mode_t mode) const;
    [[nodiscard]] int fd() const noexcept { return socket_.get(); }   // non-blocking, close-on-exec
    [[nodiscard]] const std::string& path() const noexcept { return path_; }

private:
    Endpoint() = default;
    std::string path_;
    std::vector<std::string> made_folders_;
    UniqueFd lock_, socket_;
    dev_t device_ = 0;   // of the socket file that is ours to remove
    ino_t inode_ = 0;
};

}  // namespace fovea::service
