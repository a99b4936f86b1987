#include <csignal>
#include <iostream>

#include <unistd.h>

#include "run.h"

namespace {

std::atomic<bool> stop{false};
static_assert(std::atomic<bool>::is_always_lock_free, "set in a signal handler");

void stop_on(int signal) {
    struct sigaction action {};
    action.sa_handler = [](int) { stop = true; };
    action.sa_flags = SA_RESTART;
    sigaction(signal, &action, nullptr);
}

}  // namespace

int main(int argc, char** argv) {
    stop_on(SIGINT);
    stop_on(SIGTERM);
    std::signal(SIGXFSZ, SIG_IGN);  // a file that grows beyond its limit is an error like a full disk
    try {
        const auto parsed = marrow::parse_command_line(argc, argv, std::cout);
        if (const int* exit_code = std::get_if<int>(&parsed)) return *exit_code;
        return marrow::run(std::get<marrow::Settings>(parsed),
                           {std::cout, std::cerr, isatty(STDERR_FILENO) != 0}, stop);
    } catch (const marrow::UsageError& error) {
        std::cerr << "marrow: " << error.what() << '\n';
        return marrow::kUsage;
    }
}
