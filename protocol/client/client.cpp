#include "protocol/client/client.hpp"

#include <poll.h>
#include <sys/eventfd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>
#include <new>

#include "protocol/signals_blocked.hpp"

namespace fovea::client {
namespace {

constexpr std::chrono::milliseconds kFirstRetry{50}, kLongestRetry{1000};

ConnectFailure system_failure(const char* what, int code) {
    ConnectFailure f;
    static_cast<Error&>(f) = fail_errno(what, code).error();
    f.fault = ConnectFault::system;
    return f;
}

}  // namespace

std::expected<std::unique_ptr<Client>, ConnectFailure> Client::create(std::string path, std::string name, bool wait) {
    Hello hello;
    hello.pid = getpid();
    hello.name = std::move(name);
    std::unique_ptr<Client> client(new Client(std::move(path), std::move(hello)));
    client->wake_fd_.reset(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
    if (!client->wake_fd_) return std::unexpected(system_failure("cannot make an event descriptor", errno));
    if (auto connected = client->connect(-1); !connected) {
        if (!wait || connected.error().fault != ConnectFault::no_daemon) return std::unexpected(connected.error());
        client->note_error(connected.error());
    }
    const SignalsBlocked inherited_by_the_thread;
    try {
        client->thread_ = std::thread([c = client.get()] { c->run(); });
    } catch (const std::system_error& e) {
        return std::unexpected(system_failure("cannot start the maintenance thread", e.code().value()));
    }
    return client;
}

Client::~Client() {
    if (thread_.joinable()) {
        (void)eventfd_write(wake_fd_.get(), 1);   // an event counter of 1 cannot overflow
        thread_.join();
    }
    if (Mapping* untaken = mailbox_.offer(nullptr)) delete untaken;
    delete_retired();
    delete mapping_;
}

void Client::take_mapping() noexcept {
    Mapping* const old = mapping_;
    // The old daemon's last word, for all eyes: it must last until the new daemon has spoken.
    if (old != nullptr && old->focus.read(models_[1 - model_], kAllEyes)) {
        model_ = 1 - model_;
        eyes_held_ = kAllEyes;
        last_beat_ = std::max(last_beat_, std::min(old->focus.heartbeat(), MonotonicClock::now()));
    }
    if (mailbox_.take(mapping_)) from_this_daemon_ = false;
}

const View* Client::view(unsigned i, const fovea_view& given) noexcept {
    // Bit for bit: equal bits give an equal answer.
    if (std::memcmp(&views_given_[i], &given, sizeof given) != 0) {
        const std::optional<View> checked = view_of(given);
        if (!checked) return nullptr;
        views_[i] = *checked;
        views_given_[i] = given;
    }
    return &views_[i];
}

void Client::latch(Instant photon, std::uint8_t eyes, Estimates& estimates, fovea_latch_info& info) noexcept {
    if (mailbox_.waiting()) take_mapping();
    bool live = false;
    if (mapping_ != nullptr) {
        if (auto policy = mapping_->focus.new_policy()) policy_ = *policy;
        // The light read leaves horizons of older models in the buffer; if no read comes through (the writer lapped
        // every attempt), the last buffer is evaluated at a new time, with the old model's neighbours at worst.
        if (mapping_->focus.read_at(models_[1 - model_], eyes, photon)) {
            model_ = 1 - model_;
            eyes_held_ = eyes;
            from_this_daemon_ = true;
        }
    }
    // After the read: a model that was published while this call ran must not seem to be latched before that.
    const Instant now = MonotonicClock::now();
    if (mapping_ != nullptr) {
        const Instant beat = mapping_->focus.heartbeat();
        live = from_this_daemon_ && connected_.load(std::memory_order_relaxed) && now - beat <= kHeartbeatStale;
        if (live) last_beat_ = std::min(beat, now);
    }
    MotionModel& model = models_[model_];
    for (unsigned e = 0; e < kEyeCount; ++e) {
        if ((eyes >> e & 1) == 0) continue;
        if (eyes_held_ == 0) {
            new (&estimates.of_eye[e]) GazeEstimate(evaluate(EyeMotion{}, policy_, photon));
            continue;
        }
        // An eye that the last model does not hold (only after a failed read): another one is the best there is.
        const unsigned held = (eyes_held_ >> e & 1) != 0 ? e : static_cast<unsigned>(std::countr_zero(eyes_held_));
        const auto source = static_cast<unsigned>((model.eyes_present >> held & 1) != 0 ? held : 0);
        EyeMotion& motion = model.eyes[source];
        // A dead daemon's gaze cannot be newer than its last heartbeat, whatever its clock said: it must grow old.
        if (!live) motion.reference = std::min(motion.reference, last_beat_);
        // Constructed in place: an assignment would read back 16 bytes at a time what was just written in eights.
        new (&estimates.of_eye[e]) GazeEstimate(evaluate(motion, policy_, photon));
    }
    latches_.add();
    if (!live) stale_latches_.add();

    info.flags = 0;
    if (live) info.flags |= FOVEA_LATCH_LIVE;
    if (model.exposed_estimated) info.flags |= FOVEA_LATCH_EXPOSED_ESTIMATED;
    info.model_sequence = model.sequence;
    info.sample_id = model.sample_id;
    info.exposed_ns = to_ns(model.exposed);
    info.received_ns = to_ns(model.received);
    info.filtered_ns = to_ns(model.filtered);
    info.published_ns = to_ns(model.published);
    info.latched_ns = to_ns(now);
    info.photon_ns = to_ns(photon);
}

FrameFault Client::submit(const FrameTiming& timing) noexcept {
    if (mailbox_.waiting()) take_mapping();
    const bool absent = mapping_ == nullptr || !connected_.load(std::memory_order_relaxed);
    if (!absent) {
        // The daemon's own rules, so that the app hears of a mistake instead of losing its reports silently.
        if (const FrameFault fault = check(timing, MonotonicClock::now()); fault != FrameFault::none) return fault;
        if (mapping_->frames.submit(timing)) {
            submitted_.add();
            return FrameFault::none;
        }
    }
    dropped_.add();
    return FrameFault::none;
}

std::expected<void, ConnectFailure> Client::connect(int cancel_fd) {
    auto connection = connect_to_daemon(path_, hello_, std::chrono::seconds(1), cancel_fd);
    if (!connection) return std::unexpected(std::move(connection.error()));
    const auto unusable = [&](Error error) {
        ConnectFailure f;
        static_cast<Error&>(f) = std::move(error);
        if (f.where.empty()) f.where = path_;
        f.fault = ConnectFault::protocol;
        return std::unexpected(std::move(f));
    };
    auto focus = FocusReader::map(connection->focus.get());
    if (!focus) return unusable(std::move(focus.error()));
    auto frames = FrameReporter::map(connection->frames.get());
    if (!frames) return unusable(std::move(frames.error()));
    auto mapping = std::make_unique<Mapping>();
    mapping->focus = std::move(*focus);
    mapping->frames = std::move(*frames);

    const std::scoped_lock lock(mutex_);
    socket_ = std::move(connection->socket);
    newest_ = mapping.get();
    ++connects_;
    delete mailbox_.offer(mapping.release());
    delete_retired();
    // relaxed: it only says whether to believe the heartbeat
    connected_.store(true, std::memory_order_relaxed);
    return {};
}

void Client::wait_for_end_of_connection() {
    for (;;) {
        pollfd fds[2] = {{socket_.get(), POLLIN, 0}, {wake_fd_.get(), POLLIN, 0}};
        if (poll(fds, 2, -1) < 0) continue;   // a signal cannot come; anything else passes
        if (fds[1].revents != 0) return;
        auto message = receive_message(socket_.get());
        if (message && message->has_value() && !(*message)->bytes.empty()) continue;   // of no meaning in this version
        if (message && !message->has_value() && (fds[0].revents & (POLLHUP | POLLERR)) == 0) continue;
        connected_.store(false, std::memory_order_relaxed);
        const std::scoped_lock lock(mutex_);
        socket_.reset();
        newest_ = nullptr;
        error_ = path_ + ": fovead has gone (the library reconnects by itself)";
        argument_error_.store(nullptr, std::memory_order_relaxed);
        return;
    }
}

void Client::run() {
    pthread_setname_np(pthread_self(), "fovea-client");
    std::chrono::milliseconds retry = kFirstRetry;
    const auto woken = [&](int timeout_ms) {
        pollfd wake{wake_fd_.get(), POLLIN, 0};
        return poll(&wake, 1, timeout_ms) > 0;
    };
    while (!woken(0)) {
        try {
            if (socket_) {
                wait_for_end_of_connection();
                retry = kFirstRetry;
                continue;
            }
            auto connected = connect(wake_fd_.get());
            if (connected) continue;
            if (connected.error().fault != ConnectFault::cancelled) note_error(connected.error());
        } catch (const std::exception&) {
            // Out of memory: tried again later, like everything else.
        }
        if (woken(static_cast<int>(retry.count()))) return;
        retry = std::min(2 * retry, kLongestRetry);
    }
}

void Client::delete_retired() {
    for (Mapping* m = mailbox_.collect(); m != nullptr;) delete std::exchange(m, m->next_retired);
}

void Client::note_error(const ConnectFailure& failure) {
    const std::scoped_lock lock(mutex_);
    error_ = failure.message();
    argument_error_.store(nullptr, std::memory_order_relaxed);
}

void Client::note_argument_error(const char* literal) noexcept {
    argument_error_.store(literal, std::memory_order_relaxed);   // relaxed: a literal is always whole
}

std::string Client::last_error() {
    if (const char* literal = argument_error_.load(std::memory_order_relaxed)) return literal;
    const std::scoped_lock lock(mutex_);
    return error_;
}

void Client::status(fovea_status& out) {
    out.latches = latches_.get();
    out.stale_latches = stale_latches_.get();
    out.frames_submitted = submitted_.get();
    out.frames_dropped = dropped_.get();
    const std::scoped_lock lock(mutex_);
    out.connected = newest_ != nullptr ? 1 : 0;
    out.connects = connects_;
    // newest_ lives: it is deleted only after a newer one was offered, and both happen under this lock.
    out.heartbeat_age_ns =
        newest_ != nullptr ? std::max<std::int64_t>(0, (MonotonicClock::now() - newest_->focus.heartbeat()).count()) : -1;
}

}  // namespace fovea::client
