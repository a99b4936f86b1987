/// Turns signals into a flag that stops the work.
#pragma once

#include <atomic>
#include <csignal>

namespace marrow::apps {

/// Becomes true on SIGINT, SIGTERM and SIGHUP, which comes when the terminal closes. Those that are ignored
/// stay so: SIGHUP under `nohup`, SIGINT in a script's background. A file that exceeds its size limit, or a
/// pipe that nobody reads, then causes an error, as a full disk does.
inline const std::atomic<bool>& stopped_by_signals() {
    static std::atomic<bool> stop{false};
    static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler sets it");
    struct sigaction action {};
    action.sa_handler = [](int) { stop = true; };
    action.sa_flags = SA_RESTART;
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
        struct sigaction before {};
        sigaction(signal, nullptr, &before);
        if (before.sa_handler != SIG_IGN) sigaction(signal, &action, nullptr);
    }
    std::signal(SIGXFSZ, SIG_IGN);
    std::signal(SIGPIPE, SIG_IGN);
    return stop;
}

}  // namespace marrow::apps
