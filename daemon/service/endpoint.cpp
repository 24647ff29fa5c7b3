#include "daemon/service/endpoint.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

namespace fovea::service {
namespace {

constexpr const char* kElsewhere = "choose a folder that you may write with --run-dir, or another path in [server]";

std::string lock_path(const std::string& path) { return path + ".lock"; }

// Who is let in by the socket must reach it: the folder may then be passed through, though not read.
mode_t folder_mode(mode_t socket_mode) { return (socket_mode & 0077) != 0 ? 0711 : 0700; }

Result<void> make_folder(const std::filesystem::path& folder, mode_t mode, std::vector<std::string>& made) {
    if (folder.empty()) return {};
    struct stat s {};
    if (::stat(folder.c_str(), &s) == 0) {
        if (S_ISDIR(s.st_mode)) return {};
        return fail("this is not a folder", folder.string(), kElsewhere);
    }
    if (auto ok = make_folder(folder.parent_path(), mode, made); !ok) return ok;
    if (::mkdir(folder.c_str(), 0700) != 0) {
        if (errno == EEXIST) return {};
        return fail_errno("cannot make the folder", errno, folder.string(), kElsewhere);
    }
    made.push_back(folder.string());
    if (::chmod(folder.c_str(), mode) != 0)   // whatever the umask is
        return fail_errno("cannot set the permissions of the folder", errno, folder.string(), kElsewhere);
    return {};
}

// Takes the lock file at `path`. The file may be unlinked by its owner between our open and our lock: then the lock is
// on a file that nobody else will find, and we begin again.
Result<UniqueFd> take_lock(const std::string& path, const std::string& socket_path) {
    for (;;) {
        UniqueFd fd(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600));
        if (!fd) return fail_errno("cannot create the lock file", errno, path, kElsewhere);
        if (::flock(fd.get(), LOCK_EX | LOCK_NB) != 0) {
            if (errno == EINTR) continue;
            if (errno == EWOULDBLOCK)
                return fail(std::string(Endpoint::kInUse) + " already serves this socket", socket_path,
                            "stop it (`fovea status` shows it), or start this one with another --run-dir");
            return fail_errno("cannot lock", errno, path, kElsewhere);
        }
        struct stat ours {}, there {};
        if (::fstat(fd.get(), &ours) == 0 && ::stat(path.c_str(), &there) == 0 && ours.st_dev == there.st_dev &&
            ours.st_ino == there.st_ino)
            return fd;
    }
}

// Somebody who does not take our lock may still be listening there.
bool answers(const sockaddr_un& address, int type) {
    UniqueFd probe(::socket(AF_UNIX, type | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    return probe && (::connect(probe.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 ||
                     errno == EAGAIN || errno == EPROTOTYPE);  // full queue; another type of socket
}

}  // namespace

Result<Endpoint> Endpoint::listen(const std::string& path, int type, mode_t mode) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (path.empty() || path.size() >= sizeof address.sun_path)
        return fail("a socket path has 1 to 107 bytes, this one " + std::to_string(path.size()), path,
                    "choose a shorter --run-dir");
    std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
    Endpoint endpoint;
    if (auto ok = make_folder(std::filesystem::path(path).parent_path(), folder_mode(mode), endpoint.made_folders_); !ok)
        return std::unexpected(ok.error());
    endpoint.path_ = path;
    Result<UniqueFd> lock = take_lock(lock_path(path), path);
    if (!lock) return std::unexpected(lock.error());
    endpoint.lock_ = std::move(*lock);

    struct stat there {};
    if (::lstat(path.c_str(), &there) == 0) {
        if (!S_ISSOCK(there.st_mode))
            return fail("there is a file at the socket's path that is no socket", path, "move it away, or choose another --run-dir");
        if (answers(address, type))
            return fail("another program listens on this socket", path, "stop it, or choose another --run-dir");
        if (::unlink(path.c_str()) != 0)
            return fail_errno("cannot remove the socket that a killed daemon left", errno, path, kElsewhere);
    }
    endpoint.socket_ = UniqueFd(::socket(AF_UNIX, type | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    if (!endpoint.socket_) return fail_errno("cannot make a socket", errno, path);
    const mode_t before = ::umask(static_cast<mode_t>(~mode & 0777));  // so that the file is never wider than `mode`
    const int bound = ::bind(endpoint.socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address);
    const int why = errno;
    ::umask(before);
    if (bound != 0) return fail_errno("cannot create the socket", why, path, kElsewhere);
    if (::lstat(path.c_str(), &there) == 0) {
        endpoint.device_ = there.st_dev;
        endpoint.inode_ = there.st_ino;
    }
    if (::listen(endpoint.socket_.get(), SOMAXCONN) != 0) return fail_errno("cannot listen", errno, path);
    return endpoint;
}

Result<void> Endpoint::set_mode(mode_t mode) const {
    struct stat there {};
    if (::lstat(path_.c_str(), &there) != 0 || there.st_dev != device_ || there.st_ino != inode_ || ::chmod(path_.c_str(), mode) != 0)
        return fail("cannot set the permissions of the socket", path_, "restart fovead");
    for (const std::string& folder : made_folders_)
        if (::chmod(folder.c_str(), folder_mode(mode)) != 0)
            return fail_errno("cannot set the permissions of the folder", errno, folder, "restart fovead");
    return {};
}

Endpoint::~Endpoint() {
    if (!lock_) return;  // moved from, or never ours
    struct stat there {};
    if (socket_ && ::lstat(path_.c_str(), &there) == 0 && there.st_dev == device_ && there.st_ino == inode_)
        ::unlink(path_.c_str());
    ::unlink(lock_path(path_).c_str());  // while it is locked: whoever waits for it looks again (take_lock)
}

}  // namespace fovea::service
