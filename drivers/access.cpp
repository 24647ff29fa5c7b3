#include "drivers/access.hpp"

#include <cerrno>
#include <fcntl.h>
#include <unistd.h>

namespace fovea::drivers {

std::unexpected<Error> cannot_open(const std::string& node, int code) {
    switch (code) {
        case EACCES:
        case EPERM:
            return fail("you may not open this device", node,
                        "install configs/udev/60-fovea.rules in /etc/udev/rules.d, run `udevadm control --reload`, and "
                        "plug the device in again");
        case EBUSY:
            return fail("another program holds this device", node, "`fuser " + node + "` shows which; close it");
        case ENOENT:
        case ENODEV:
        case ENXIO: return fail("this device is not there (any more)", node, "`fovea devices` lists what is there");
        default: return fail_errno("cannot open this device", code, node);
    }
}

int try_open(const std::string& node) {
    const int fd = ::open(node.c_str(), O_RDWR | O_CLOEXEC | O_NONBLOCK);
    if (fd < 0) return errno;
    ::close(fd);
    return 0;
}

}  // namespace fovea::drivers
