// The daemon's side of its clients: accepts them, checks who they are, hands them their descriptors, and drains their
// frame reports.
//
//   accepted --hello, allowed--> connected --closed, or said anything more--> gone (its last reports are drained)
//      |--- no hello within a second, not allowed, other ABI: told why, closed
//
// What is trusted: the kernel's word on who connected (SO_PEERCRED). A hello is parsed with bounds; frame reports are
// copied once and then checked (protocol/frames_region.hpp). A client can hold nothing up: all calls are non-blocking,
// each drain looks at a bounded number of records, and nobody is waited for.
//
// Threads: everything on the thread that runs the io_context.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "daemon/service/endpoint.hpp"
#include "protocol/frames_region.hpp"
#include "protocol/samples_region.hpp"

namespace boost::asio {
class io_context;
}

namespace fovea::service {

// Who may connect, besides root and the daemon's own user.
struct AccessRules {
    std::vector<std::int64_t> uids, gids;
    std::vector<std::int64_t> sample_uids;   // who may also read raw samples
    std::size_t max_clients = 16;
};

struct ClientStatus {
    std::uint64_t id = 0;          // Welcome::client_id
    pid_t pid = 0;
    uid_t uid = 0;
    std::string name;              // as it calls itself: for people
    bool reads_samples = false;
    std::int64_t connected_ns = 0;
    FrameCounters frames;
    std::uint64_t newest_frame = 0;
};

class ClientServer {
public:
    struct Regions {
        int focus_fd;
        SamplesPublisher& samples;  // publish_frame() is this object's alone
    };
    struct Counters {
        std::uint64_t connected = 0, refused = 0, misbehaved = 0;
        FrameCounters gone_frames;  // of clients that have left
    };

    // `clients_changed` is called after each coming and going.
    ClientServer(boost::asio::io_context& io, const Endpoint& endpoint, Regions regions, AccessRules rules,
                 const TimeSource& time, std::function<void()> clients_changed);
    ~ClientServer();   // closes all; their reports are drained first

    void drain();      // validates new frame reports and puts them into the samples region's ring of frames
    void set_rules(AccessRules rules);   // for the clients to come
    [[nodiscard]] std::size_t size() const noexcept;
    [[nodiscard]] std::vector<ClientStatus> clients() const;
    [[nodiscard]] const Counters& counters() const noexcept;

private:
    struct State;
    std::shared_ptr<State> state_;   // handlers that are still queued hold weak references
};

}  // namespace fovea::service
