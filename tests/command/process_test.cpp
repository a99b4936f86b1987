// The program as a process: which files remain after signals.
#include <chrono>
#include <csignal>
#include <set>
#include <thread>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>

#include "support/command_line.h"

extern char** environ;

namespace marrow::test {
namespace {

using Names = std::set<std::string>;

// Many small balls, so that reading, extracting and writing each take a while.
void write_busy_scan(const std::filesystem::path& file) {
    write_nrrd(file, 192, 192, 192,
               [](int x, int y, int z) { return (x / 2 + y / 2 + z / 2) % 2 ? 1000 : -1000; });
}

// SIGHUP ends the process, or does nothing if `ignored`, as with nohup.
int exit_code_after(const std::vector<std::string>& arguments, int signal, std::chrono::milliseconds delay,
                    bool ignored = false) {
    std::string program = MARROW_PROGRAM;
    std::vector<char*> argv{program.data()};
    std::vector<std::string> copies = arguments;
    for (std::string& argument : copies) argv.push_back(argument.data());
    argv.push_back(nullptr);
    pid_t pid = 0;
    const auto before = std::signal(SIGHUP, ignored ? SIG_IGN : SIG_DFL);
    const int failed = posix_spawn(&pid, program.c_str(), nullptr, nullptr, argv.data(), environ);
    std::signal(SIGHUP, before);
    if (failed != 0) return -1;
    std::this_thread::sleep_for(delay);
    kill(pid, signal);
    int status = 0;
    waitpid(pid, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

TEST(Process, InterruptedLeavesTheOldFileOrTheWholeNewOne) {
    const TemporaryFolder folder;
    write_busy_scan(folder / "scan.nrrd");
    const std::string mesh = folder / "mesh.stl";
    const std::vector<std::string> command{folder / "scan.nrrd", "-o", mesh, "--isovalue", "0", "-q"};
    ASSERT_EQ(marrow_with(command).code, 0);
    const auto whole = std::filesystem::file_size(mesh);

    std::set<int> interrupted;  // signals that were handled
    // On a busy machine the program needs longer before it handles signals.
    for (int delay = 30; delay <= 600 || (interrupted.size() < 3 && delay < 20'000); delay = delay * 3 / 2) {
        for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
            write_file(mesh, "old");
            const int code = exit_code_after(command, signal, std::chrono::milliseconds(delay));
            if (code == 130) {
                EXPECT_EQ(read_file(mesh), "old");
                interrupted.insert(signal);
            } else if (code == 0) {
                EXPECT_EQ(std::filesystem::file_size(mesh), whole);
            } else {
                // The signal came before the program handled signals.
                EXPECT_EQ(code, -signal);
                EXPECT_EQ(read_file(mesh), "old");
            }
            EXPECT_EQ(folder.files(), (Names{"mesh.stl", "scan.nrrd"}));
        }
    }
    EXPECT_EQ(interrupted, (std::set{SIGINT, SIGTERM, SIGHUP}));
    EXPECT_EQ(exit_code_after(command, SIGHUP, std::chrono::milliseconds(60), true), 0);
}

}  // namespace
}  // namespace marrow::test
