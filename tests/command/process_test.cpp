// The program as a process: which files remain after signals, and what happens without standard streams.
#include <chrono>
#include <csignal>
#include <map>
#include <set>
#include <thread>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

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

// Starts the program. `streams` says what its standard streams are.
pid_t start(const std::vector<std::string>& arguments, const posix_spawn_file_actions_t* streams = nullptr) {
    std::string program = MARROW_PROGRAM;
    std::vector<char*> argv{program.data()};
    std::vector<std::string> copies = arguments;
    for (std::string& argument : copies) argv.push_back(argument.data());
    argv.push_back(nullptr);
    pid_t pid = -1;
    const int failed = posix_spawn(&pid, program.c_str(), streams, nullptr, argv.data(), environ);
    return failed == 0 ? pid : -1;
}

// The exit code, or minus the signal that ended the process.
int wait_for(pid_t pid) {
    int status = 0;
    if (waitpid(pid, &status, 0) != pid) return -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

// The signal ends the process, or does nothing if `ignored`, as SIGHUP with nohup.
int exit_code_after(const std::vector<std::string>& arguments, int signal, std::chrono::milliseconds delay,
                    bool ignored = false) {
    const auto before = std::signal(signal, ignored ? SIG_IGN : SIG_DFL);
    const pid_t pid = start(arguments);
    std::signal(signal, before);
    if (pid == -1) return -1;
    std::this_thread::sleep_for(delay);
    kill(pid, signal);
    return wait_for(pid);
}

// With these descriptors closed.
int exit_code_without(const std::vector<int>& descriptors, const std::vector<std::string>& arguments) {
    posix_spawn_file_actions_t streams;
    posix_spawn_file_actions_init(&streams);
    for (const int descriptor : descriptors) posix_spawn_file_actions_addclose(&streams, descriptor);
    const pid_t pid = start(arguments, &streams);
    posix_spawn_file_actions_destroy(&streams);
    return wait_for(pid);
}

// With a pipe that nobody reads as this descriptor. Standard error goes to `errors`, if it is not that one.
int exit_code_unread(int descriptor, const std::string& errors, const std::vector<std::string>& arguments) {
    int pipe_ends[2];
    if (pipe2(pipe_ends, O_CLOEXEC) != 0) return -1;
    close(pipe_ends[0]);
    posix_spawn_file_actions_t streams;
    posix_spawn_file_actions_init(&streams);
    posix_spawn_file_actions_addopen(&streams, STDERR_FILENO, errors.c_str(), O_WRONLY | O_CREAT, 0666);
    posix_spawn_file_actions_adddup2(&streams, pipe_ends[1], descriptor);
    const pid_t pid = start(arguments, &streams);
    posix_spawn_file_actions_destroy(&streams);
    close(pipe_ends[1]);
    return wait_for(pid);
}

TEST(Process, InterruptedLeavesTheOldFileOrTheWholeNewOne) {
    const TemporaryFolder folder;
    write_busy_scan(folder / "scan.nrrd");
    const std::string mesh = folder / "mesh.stl";
    const std::vector<std::string> command{folder / "scan.nrrd", "-o", mesh, "--isovalue", "0", "-q"};
    ASSERT_EQ(marrow_with(command).code, 0);
    const auto whole = std::filesystem::file_size(mesh);

    std::map<int, int> interrupted;  // the delays at which signals were handled
    // On a busy machine the program needs longer before it handles signals.
    for (int delay = 30; delay <= 600 || (interrupted.size() < 3 && delay < 20'000); delay = delay * 3 / 2) {
        for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
            write_file(mesh, "old");
            const int code = exit_code_after(command, signal, std::chrono::milliseconds(delay));
            if (code == 130) {
                EXPECT_EQ(read_file(mesh), "old");
                interrupted[signal] = delay;
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
    ASSERT_EQ(interrupted.size(), 3u);
    for (const auto& [signal, delay] : interrupted)
        EXPECT_EQ(exit_code_after(command, signal, std::chrono::milliseconds(delay), true), 0) << signal;
}

// A file that is opened would take the number of a closed stream, and receive its messages.
TEST(Process, WritesNoMessagesIntoTheMeshWithoutStandardStreams) {
    const TemporaryFolder folder;
    write_nrrd(folder / "ball.nrrd", 24, 25, 13, ball(12, 12, 6, 8));
    const std::string mesh = folder / "mesh.ply";
    const std::vector<std::string> command{folder / "ball.nrrd", "-o", mesh, "--isovalue", "0", "-v",
                                           "--max-memory",       "1G"};
    ASSERT_EQ(marrow_with(command).code, 0);
    const std::string whole = read_file(mesh);
    EXPECT_EQ(exit_code_without({2}, command), 0);
    EXPECT_TRUE(read_file(mesh) == whole);
    EXPECT_EQ(exit_code_without({0, 1, 2}, command), kUnreadable) << "the summary is lost";
    EXPECT_TRUE(read_file(mesh) == whole);
}

TEST(Process, OutlivesTheReaderOfItsMessages) {
    const TemporaryFolder folder;
    write_nrrd(folder / "ball.nrrd", 24, 25, 13, ball(12, 12, 6, 8));
    EXPECT_EQ(exit_code_unread(STDERR_FILENO, "/dev/null",
                               {folder / "ball.nrrd", "-o", folder / "mesh.stl", "--isovalue", "0", "-v"}),
              0);
    EXPECT_EQ(folder.files(), (Names{"ball.nrrd", "mesh.stl"}));
}

// As with `| head -1`.
TEST(Process, IsQuietIfTheReaderOfItsResultsHasEnough) {
    const TemporaryFolder folder;
    write_nrrd(folder / "ball.nrrd", 24, 25, 13, ball(12, 12, 6, 8));
    EXPECT_EQ(exit_code_unread(STDOUT_FILENO, folder / "errors", {"info", folder / "ball.nrrd"}),
              kUnreadable);
    EXPECT_EQ(read_file(folder / "errors"), "");
}

}  // namespace
}  // namespace marrow::test
