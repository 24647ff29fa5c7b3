// A thread that is started while this object lives receives no signals: they are for the threads that were there before
// (the daemon's service thread, an app's own), no handler runs on it and no wait of its is interrupted.
//
// Threads: one owner, on the thread that starts others.
#pragma once

#include <csignal>

namespace fovea {

class SignalsBlocked {
public:
    SignalsBlocked() noexcept {
        sigset_t all;
        sigfillset(&all);
        pthread_sigmask(SIG_SETMASK, &all, &before_);
    }
    ~SignalsBlocked() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
    SignalsBlocked(const SignalsBlocked&) = delete;
    SignalsBlocked& operator=(const SignalsBlocked&) = delete;

private:
    sigset_t before_;
};

}  // namespace fovea
