// What signals do to the programs.
#pragma once

#include <atomic>
#include <csignal>

namespace marrow {

/// Becomes true on SIGINT and SIGTERM. A file that grows beyond its limit becomes an error like a full disk.
inline const std::atomic<bool>& stopped_by_signals() {
    static std::atomic<bool> stop{false};
    static_assert(std::atomic<bool>::is_always_lock_free, "set in a signal handler");
    struct sigaction action {};
    action.sa_handler = [](int) { stop = true; };
    action.sa_flags = SA_RESTART;
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
    std::signal(SIGXFSZ, SIG_IGN);
    return stop;
}

}  // namespace marrow
