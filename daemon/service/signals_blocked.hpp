// A thread that is started while this object lives receives no signals: they are the service thread's, and no device's
// wait is interrupted by them.
//
// Threads: one owner, on the thread that starts others.
#pragma once

#include <csignal>

namespace fovea::service {

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

}  // namespace fovea::service
