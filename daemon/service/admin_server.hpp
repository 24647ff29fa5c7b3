// The administrators' socket: one JSON object per line in, one per line out.
//
// Only root and the daemon's own user are admitted (SO_PEERCRED); the socket file is 0600 besides. A line longer than
// 64 KiB, or an idle minute, ends the connection. What the lines mean is the handler's matter (docs/daemon.md).
//
// Threads: everything on the thread that runs the io_context.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "daemon/service/endpoint.hpp"

namespace boost::asio {
class io_context;
}

namespace fovea::service {

class AdminServer {
public:
    struct Reply {
        std::string line;
        std::function<void()> afterwards = {};   // when the line has been sent, or could not be
    };
    // Takes one line without its end.
    using Answer = std::function<Reply(const std::string& line)>;
    AdminServer(boost::asio::io_context& io, const Endpoint& endpoint, Answer answer);
    ~AdminServer();

private:
    struct State;
    std::shared_ptr<State> state_;
};

}  // namespace fovea::service
