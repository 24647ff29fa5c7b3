#include "daemon/service/client_server.hpp"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <optional>

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "protocol/handshake.hpp"

namespace fovea::service {
namespace {

namespace asio = boost::asio;
using asio::posix::stream_descriptor;

constexpr auto kHelloWithin = std::chrono::seconds(1);   // libfovea sends it at once
constexpr std::size_t kGreetingsPerUser = 64;  // so that one user cannot keep the others out; more than connect at once
constexpr int kAcceptAtOnce = 16;   // then the heartbeat and the other sockets have their turn, however many still knock
constexpr auto kAcceptPause = std::chrono::milliseconds(100);  // after accept() failed, e.g. for want of descriptors

bool contains(const std::vector<std::int64_t>& ids, std::uint64_t id) {
    return std::ranges::find(ids, static_cast<std::int64_t>(id)) != ids.end();
}

// The supplementary groups of the process that connected, by the kernel.
std::vector<gid_t> peer_groups(int socket) {
    std::vector<gid_t> groups(64);
    for (;;) {
        auto bytes = static_cast<socklen_t>(groups.size() * sizeof(gid_t));
        const int got = ::getsockopt(socket, SOL_SOCKET, SO_PEERGROUPS, groups.data(), &bytes);
        if (got == 0) {
            groups.resize(bytes / sizeof(gid_t));
            return groups;
        }
        if (errno != ERANGE || bytes / sizeof(gid_t) <= groups.size()) return {};
        groups.resize(bytes / sizeof(gid_t));  // the kernel says how many there are
    }
}

void add(FrameCounters& sum, const FrameCounters& c) {
    sum.accepted += c.accepted;
    sum.bad_values += c.bad_values;
    sum.bad_instants += c.bad_instants;
    sum.bad_index += c.bad_index;
    sum.overrun += c.overrun;
}

// A client's own name for itself, fit for a terminal.
std::string printable(std::string name) {
    for (char& c : name)
        if (static_cast<unsigned char>(c) < 0x20 || static_cast<unsigned char>(c) > 0x7e) c = '?';
    return name;
}

struct Client {
    Client(asio::io_context& io, int fd) : socket{io, fd}, hello_timer{io} {}
    stream_descriptor socket;      // closes the descriptor
    asio::steady_timer hello_timer;
    PeerCredentials peer;
    std::optional<FrameCollector> frames;  // connected
    ClientStatus status;
};

}  // namespace

struct ClientServer::State : std::enable_shared_from_this<State> {
    State(asio::io_context& io_context, int listening, Regions r, AccessRules a, const TimeSource& t,
          std::function<void()> changed)
        : io{io_context}, acceptor{io_context, ::dup(listening)}, accept_pause{io_context}, regions{r},
          rules{std::move(a)}, time{t}, clients_changed{std::move(changed)} {}

    using ClientPtr = std::shared_ptr<Client>;

    // A handler that does nothing once the server or the client is gone: asio may have queued it before that.
    template <class Act>
    auto guarded(const ClientPtr& client, Act act) {
        return [act, weak = weak_from_this(), weak_client = std::weak_ptr(client)](boost::system::error_code error) {
            const auto self = weak.lock();
            const ClientPtr still_there = weak_client.lock();
            if (self && still_there && !error) act(*self, still_there);
        };
    }

    void accept_next() {
        acceptor.async_wait(stream_descriptor::wait_read, [weak = weak_from_this()](auto error) {
            if (auto self = weak.lock(); self && !error) self->accept();
        });
    }

    void accept() {
        for (int accepted = 0; accepted < kAcceptAtOnce; ++accepted) {
            const int fd = ::accept4(acceptor.native_handle(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
            if (fd >= 0) {
                greet(fd);
                continue;
            }
            if (errno == EINTR || errno == ECONNABORTED) continue;
            if (errno == EAGAIN) return accept_next();
            spdlog::warn("cannot accept a client: {}", std::generic_category().message(errno));
            accept_pause.expires_after(kAcceptPause);
            return accept_pause.async_wait([weak = weak_from_this()](auto error) {
                if (auto self = weak.lock(); self && !error) self->accept_next();
            });
        }
        accept_next();
    }

    void greet(int fd) {
        UniqueFd owned(fd);
        const Result<PeerCredentials> peer = peer_credentials(fd);
        if (!peer) return;
        const auto waiting = std::ranges::count_if(
            clients, [&](const ClientPtr& c) { return !c->frames && c->peer.uid == peer->uid; });
        if (static_cast<std::size_t>(waiting) >= kGreetingsPerUser) {
            ++counters.refused;
            return;
        }
        const ClientPtr client = clients.emplace_back(std::make_shared<Client>(io, owned.release()));
        client->peer = *peer;
        // The hello is read before a refusal is sent: closing a Unix socket with unread bytes would reset the
        // connection, and the client would never see why.
        client->hello_timer.expires_after(kHelloWithin);
        client->hello_timer.async_wait(guarded(client, [](State& self, const ClientPtr& late) {
            if (late->frames) return;
            ++self.counters.misbehaved;
            self.remove(late);
        }));
        read_next(client);
    }

    void read_next(const ClientPtr& client) {
        client->socket.async_wait(stream_descriptor::wait_read,
                                  guarded(client, [](State& self, const ClientPtr& c) { self.read(c); }));
    }

    void read(const ClientPtr& client) {
        const Result<std::optional<Message>> message = receive_message(client->socket.native_handle());
        if (message && !*message) return read_next(client);  // nothing yet
        const bool closed = !message || (*message)->bytes.empty();
        if (client->frames) {
            // Connected clients are silent: the end of the socket is all that is ever to be read from it.
            if (!closed) {
                ++counters.misbehaved;
                spdlog::warn("client {} ({}) broke the protocol; its connection is closed", client->status.id, client->status.name);
            }
            return remove(client);
        }
        if (closed) return remove(client);
        answer(client, (*message)->bytes);
    }

    void answer(const ClientPtr& client, std::span<const std::byte> bytes) {
        const std::expected<Hello, Refusal> hello = decode_hello(bytes);
        if (!hello) return refuse(client, hello.error());
        if (std::optional<Refusal> refusal = check(*client, *hello)) return refuse(client, *refusal);

        Result<FrameCollector> frames = FrameCollector::create();
        if (!frames) {
            spdlog::error("no memory for a client: {}", frames.error().message());
            return refuse(client, {RefusalReason::internal, "fovead has no memory left for another client"});
        }
        std::vector<int> fds;
        if ((hello->grants & kGrantFocus) != 0) fds.insert(fds.end(), {regions.focus_fd, frames->fd()});
        if ((hello->grants & kGrantSamples) != 0) fds.push_back(regions.samples.fd());
        const Welcome welcome{.grants = hello->grants,
                              .descriptors = static_cast<std::uint32_t>(fds.size()),
                              .client_id = next_id};
        if (const auto sent = send_message(client->socket.native_handle(), encode(welcome), fds); !sent) {
            ++counters.misbehaved;
            return remove(client);
        }
        ++next_id;
        client->hello_timer.cancel();
        client->frames = std::move(*frames);
        client->status = {.id = welcome.client_id,
                          .pid = client->peer.pid,
                          .uid = client->peer.uid,
                          .name = printable(hello->name),
                          .reads_samples = (hello->grants & kGrantSamples) != 0,
                          .connected_ns = to_ns(time.now()),
                          .frames = {},
                          .newest_frame = 0};
        ++counters.connected;
        spdlog::info("client {} connected: {} (pid {}, uid {}{})", client->status.id, client->status.name,
                     client->status.pid, client->status.uid, client->status.reads_samples ? ", reads samples" : "");
        read_next(client);
        clients_changed();
    }

    std::optional<Refusal> check(Client& client, const Hello& hello) const {
        const PeerCredentials& peer = client.peer;
        const bool house = peer.uid == 0 || peer.uid == ::geteuid();
        bool allowed = house || contains(rules.uids, peer.uid) || contains(rules.gids, peer.gid);
        if (!allowed && !rules.gids.empty()) {
            const std::vector<gid_t> groups = peer_groups(client.socket.native_handle());
            allowed = std::ranges::any_of(groups, [&](gid_t g) { return contains(rules.gids, g); });
        }
        if (!allowed)
            return Refusal{RefusalReason::permission,
                           fmt::format("fovead does not admit user {} (add {} to uids in [server] of its config)", peer.uid, peer.uid)};
        if (hello.grants == 0 || (hello.grants & ~(kGrantFocus | kGrantSamples)) != 0)
            return Refusal{RefusalReason::protocol, fmt::format("fovead knows no grants {:#x}", hello.grants)};
        if ((hello.grants & kGrantSamples) != 0 && !house && !contains(rules.sample_uids, peer.uid))
            return Refusal{RefusalReason::permission,
                           fmt::format("fovead does not give raw gaze samples to user {} (add {} to sample_uids in [server] of its config)",
                                       peer.uid, peer.uid)};
        if (size() >= rules.max_clients)
            return Refusal{RefusalReason::busy, fmt::format("fovead already serves {} clients (max_clients in [server] of its config)",
                                                            rules.max_clients)};
        return std::nullopt;
    }

    void refuse(const ClientPtr& client, const Refusal& refusal) {
        ++counters.refused;
        spdlog::warn("client refused (pid {}, uid {}): {}", client->peer.pid, client->peer.uid, refusal.text);
        // One message into an empty queue: it always fits; a client that is gone does not miss it.
        static_cast<void>(send_message(client->socket.native_handle(), encode(refusal)));
        remove(client);
    }

    void remove(ClientPtr client) {  // by value: the argument may be the vector's own element
        const bool was_connected = client->frames.has_value();
        if (was_connected) {
            drain(*client);  // what it reported before it left, or was killed, counts
            add(counters.gone_frames, client->frames->counters());
            spdlog::info("client {} left: {} ({} frames)", client->status.id, client->status.name,
                         client->frames->counters().accepted);
        }
        std::erase(clients, client);
        if (was_connected) clients_changed();
    }

    void drain(Client& client) {
        const Instant now = time.now();
        // Bounded: a client that writes as fast as this reads must not keep the others waiting.
        for (std::size_t i = 0; i < kFrameSlots; ++i) {
            const std::optional<FrameTiming> timing = client.frames->next(now);
            if (!timing) return;
            client.status.newest_frame = timing->frame;
            regions.samples.publish_frame(client.status.id, *timing);
        }
    }

    std::size_t size() const {
        return static_cast<std::size_t>(std::ranges::count_if(clients, [](const ClientPtr& c) { return c->frames.has_value(); }));
    }

    asio::io_context& io;
    stream_descriptor acceptor;
    asio::steady_timer accept_pause;
    Regions regions;
    AccessRules rules;
    const TimeSource& time;
    std::function<void()> clients_changed;
    std::vector<ClientPtr> clients;   // the only owners
    Counters counters;
    std::uint64_t next_id = 1;
};

ClientServer::ClientServer(asio::io_context& io, const Endpoint& endpoint, Regions regions, AccessRules rules,
                           const TimeSource& time, std::function<void()> clients_changed)
    : state_{std::make_shared<State>(io, endpoint.fd(), regions, std::move(rules), time, std::move(clients_changed))} {
    state_->accept_next();
}

ClientServer::~ClientServer() {
    state_->clients_changed = [] {};
    while (!state_->clients.empty()) state_->remove(state_->clients.back());
}

void ClientServer::drain() {
    for (const auto& client : state_->clients)
        if (client->frames) state_->drain(*client);
}

void ClientServer::set_rules(AccessRules rules) { state_->rules = std::move(rules); }
std::size_t ClientServer::size() const noexcept { return state_->size(); }
const ClientServer::Counters& ClientServer::counters() const noexcept { return state_->counters; }

std::vector<ClientStatus> ClientServer::clients() const {
    std::vector<ClientStatus> out;
    for (const auto& client : state_->clients) {
        if (!client->frames) continue;
        out.push_back(client->status);
        out.back().frames = client->frames->counters();
    }
    return out;
}

}  // namespace fovea::service
