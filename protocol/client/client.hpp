// What stands behind fovea_client: the mappings of a daemon's regions, and a thread that keeps them.
//
//                 connect ok                     socket ends
//   waiting  ------------------->  connected  ------------------->  waiting
//      ^  |                                                            |
//      +--+ every 50 ms, doubling to 1 s                               +  the old mapping stays readable until the new
//                                                                         daemon's is taken
//
// Threads: latch() and submit() from one thread at a time; status(), last_error() from any; the maintenance thread is
// the client's own, with all signals blocked.
// Errors: of the maintenance thread: kept for last_error(). latch() and submit() neither allocate, lock nor log.
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "fovea/fovea.h"
#include "protocol/client/focal.hpp"
#include "protocol/client/mailbox.hpp"
#include "protocol/focus_region.hpp"
#include "protocol/frames_region.hpp"
#include "protocol/handshake.hpp"

namespace fovea::client {

class Client {
public:
    // Connects, or fails; with `wait`, an absent daemon is no failure.
    [[nodiscard]] static std::expected<std::unique_ptr<Client>, ConnectFailure> create(std::string path,
                                                                                       std::string name, bool wait);
    ~Client();
    Client(const Client&) = delete;
    Client& operator=(const Client&) = delete;

    // view_of() for view i (below kMaxViews) of the latching thread, remembered: views hardly ever change from one frame
    // to the next. Null where view_of() has nothing. Valid until the next call for i.
    [[nodiscard]] const View* view(unsigned i, const fovea_view& given) noexcept;

    // The estimate of each eye of `eyes` (bits) at `photon`; `info` says what it was made from (struct_size untouched).
    // Those of the eyes that were not asked for are not constructed: clearing them would cost more than evaluating one.
    struct Estimates {
        union {
            GazeEstimate of_eye[kEyeCount];
        };
        Estimates() noexcept {}
    };
    void latch(Instant photon, std::uint8_t eyes, Estimates& estimates, fovea_latch_info& info) noexcept;
    // Reports a frame, or counts it as dropped. A frame that no daemon would accept: why.
    [[nodiscard]] FrameFault submit(const FrameTiming& timing) noexcept;

    void status(fovea_status& out);
    [[nodiscard]] std::string last_error();
    void note_argument_error(const char* literal) noexcept;   // lock-free; kept as a pointer

private:
    struct Mapping {
        FocusReader focus;
        FrameReporter frames;
        Mapping* next_retired = nullptr;
    };
    struct Counter {   // written by one thread, so no atomic addition is needed
        std::atomic<std::uint64_t> value{0};
        void add() noexcept { value.store(value.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed); }
        [[nodiscard]] std::uint64_t get() const noexcept { return value.load(std::memory_order_relaxed); }
    };

    Client(std::string path, Hello hello) noexcept : path_{std::move(path)}, hello_{std::move(hello)} {}
    void run();
    [[nodiscard]] std::expected<void, ConnectFailure> connect(int cancel_fd);
    void wait_for_end_of_connection();
    void delete_retired();
    void note_error(const ConnectFailure& failure);
    void take_mapping() noexcept;

    const std::string path_;
    const Hello hello_;

    // Of the latching thread.
    Mapping* mapping_ = nullptr;
    MotionModel models_[2];
    unsigned model_ = 0;                 // models_[model_] is the newest whole one
    std::uint8_t eyes_held_ = 0;         // whose motion models_[model_] holds; 0: there has never been a model
    bool from_this_daemon_ = false;      // ... and came through mapping_
    Instant last_beat_;                  // of the daemon, while it was live
    LossPolicy policy_;
    fovea_view views_given_[kMaxViews]{};   // eye and all else 0: no legal view
    View views_[kMaxViews];
    Counter latches_, stale_latches_, submitted_, dropped_;

    // Between the threads.
    Mailbox<Mapping> mailbox_;
    std::atomic<bool> connected_{false};
    std::atomic<const char*> argument_error_{nullptr};   // set: it is newer than error_

    // Of the maintenance thread; what status() and last_error() see is under mutex_.
    UniqueFd socket_, wake_fd_;
    std::mutex mutex_;
    const Mapping* newest_ = nullptr;
    std::uint64_t connects_ = 0;
    std::string error_;
    std::thread thread_;
};

}  // namespace fovea::client
