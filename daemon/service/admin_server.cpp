#include "daemon/service/admin_server.hpp"

#include <sys/socket.h>
#include <unistd.h>

#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <spdlog/spdlog.h>

#include "protocol/handshake.hpp"

namespace fovea::service {
namespace {

namespace asio = boost::asio;
using Protocol = asio::local::stream_protocol;

constexpr std::size_t kLongestLine = 64 * 1024;
constexpr auto kIdleAtMost = std::chrono::minutes(1);
constexpr std::size_t kConnections = 16;

// One administrator's connection; lives as long as something waits on it.
class Talk : public std::enable_shared_from_this<Talk> {
public:
    Talk(Protocol::socket socket, const AdminServer::Answer& answer, std::shared_ptr<std::size_t> count)
        : socket_{std::move(socket)}, idle_{socket_.get_executor()}, answer_{answer}, count_{std::move(count)} {
        ++*count_;
    }
    ~Talk() { --*count_; }

    void next_line() {
        idle_.expires_after(kIdleAtMost);
        idle_.async_wait([weak = weak_from_this()](auto error) {
            boost::system::error_code ignored;
            if (auto self = weak.lock(); self && !error) self->socket_.close(ignored);
        });
        asio::async_read_until(socket_, asio::dynamic_buffer(received_, kLongestLine), '\n',
                               [self = shared_from_this()](auto error, std::size_t length) {
                                   if (!error) self->reply(length);
                               });
    }

private:
    void reply(std::size_t length) {
        AdminServer::Reply reply = answer_(received_.substr(0, length - 1));
        received_.erase(0, length);
        sent_ = std::move(reply.line) + "\n";
        asio::async_write(socket_, asio::buffer(sent_),
                          [self = shared_from_this(), afterwards = std::move(reply.afterwards)](auto error, std::size_t) {
            if (afterwards) afterwards();
            if (!error) self->next_line();
        });
    }

    Protocol::socket socket_;
    asio::steady_timer idle_;
    const AdminServer::Answer& answer_;
    std::shared_ptr<std::size_t> count_;
    std::string received_, sent_;
};

}  // namespace

struct AdminServer::State : std::enable_shared_from_this<State> {
    State(asio::io_context& io, int listening, Answer a)
        : acceptor{io, Protocol(), ::dup(listening)}, pause{io}, answer{std::move(a)} {}

    void accept_next() {
        acceptor.async_accept([weak = weak_from_this()](auto error, Protocol::socket socket) {
            const auto self = weak.lock();
            if (!self || error == asio::error::operation_aborted) return;
            if (!error) {
                self->admit(std::move(socket));
                return self->accept_next();
            }
            spdlog::warn("cannot accept an administrator: {}", error.message());
            self->pause.expires_after(std::chrono::milliseconds(100));
            self->pause.async_wait([weak](auto cancelled) {
                if (auto again = weak.lock(); again && !cancelled) again->accept_next();
            });
        });
    }

    void admit(Protocol::socket socket) {
        const Result<PeerCredentials> peer = peer_credentials(socket.native_handle());
        if (!peer || (peer->uid != 0 && peer->uid != ::geteuid())) {
            spdlog::warn("administrator refused: uid {}", peer ? static_cast<long>(peer->uid) : -1L);
            return;
        }
        if (*connections >= kConnections) return;
        std::make_shared<Talk>(std::move(socket), answer, connections)->next_line();
    }

    Protocol::acceptor acceptor;
    asio::steady_timer pause;
    Answer answer;   // outlives every Talk: the io_context runs none of them once the server is gone
    std::shared_ptr<std::size_t> connections = std::make_shared<std::size_t>(0);
};

AdminServer::AdminServer(asio::io_context& io, const Endpoint& endpoint, Answer answer)
    : state_{std::make_shared<State>(io, endpoint.fd(), std::move(answer))} {
    state_->accept_next();
}

AdminServer::~AdminServer() = default;

}  // namespace fovea::service
