// Errors and warnings on the console: colours, flags, and programs that are not installed.
#include <array>
#include <cstdio>
#include <cstdlib>
#include <sstream>

#include <gtest/gtest.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shared/console.h"
#include "shared/library_options.h"
#include "support/command_line.h"

namespace marrow::test {
namespace {

// What a program prints to a terminal.
std::string on_a_terminal(const std::vector<std::string>& command, bool no_colour) {
    int terminal = -1;
    const pid_t child = forkpty(&terminal, nullptr, nullptr, nullptr);
    if (child == 0) {
        setenv("TERM", "xterm", 1);
        no_colour ? setenv("NO_COLOR", "1", 1) : unsetenv("NO_COLOR");
        std::vector<char*> argv;
        for (const std::string& argument : command) argv.push_back(const_cast<char*>(argument.c_str()));
        argv.push_back(nullptr);
        execv(argv[0], argv.data());
        _exit(127);
    }
    std::string text;
    char buffer[256];
    for (ssize_t n; (n = read(terminal, buffer, sizeof buffer)) > 0;)
        text.append(buffer, static_cast<std::size_t>(n));
    close(terminal);
    waitpid(child, nullptr, 0);
    return text;
}

TEST(Console, MarksErrorsAndWarningsInColour) {
    std::ostringstream out, err;
    const Console console{out, err, false, true};
    console.error("bad");
    console.warning("odd");
    EXPECT_EQ(err.str(), "\x1b[1;31mmarrow:\x1b[0m bad\n\x1b[1;33mmarrow: warning:\x1b[0m odd\n");
    EXPECT_EQ(out.str(), "");
}

TEST(Console, UsesColourOnTerminalsOnly) {
    const TemporaryFolder folder;
    const std::string scan = folder / "missing.nrrd";
    const std::vector<std::string> command{MARROW_PROGRAM, scan, "-o", folder / "a.stl", "--isovalue", "0"};
    const std::string red = "\x1b[1;31mmarrow:\x1b[0m ";
    EXPECT_EQ(on_a_terminal(command, false).find(red), 0u);
    EXPECT_EQ(on_a_terminal(command, true).find("marrow: "), 0u) << "NO_COLOR is set";
    EXPECT_EQ(marrow_with({command.begin() + 1, command.end()}).err.find("marrow: "), 0u) << "no terminal";
}

TEST(Console, NamesFlagsInsteadOfLibraryOptions) {
    EXPECT_EQ(apps::name_flags("3 series; choose one with options.series, or options.series_x"),
              "3 series; choose one with --series, or options.series_x");
    EXPECT_EQ(apps::name_flags("inspect_scan lists all"), "'marrow info' lists all");
    EXPECT_EQ(apps::name_flags("no option"), "no option");
}

TEST(Console, SaysHowToGetAProgramThatIsNotInstalled) {
    const TemporaryFolder folder;
    const std::string program = folder / "marrow";
    std::filesystem::copy_file(MARROW_PROGRAM, program);
    const auto printed = [&](const std::string& command) {
        FILE* pipe = popen(("'" + program + "' " + command + " 2>&1").c_str(), "r");
        std::string text;
        std::array<char, 256> line{};
        while (fgets(line.data(), line.size(), pipe)) text += line.data();
        EXPECT_EQ(WEXITSTATUS(pclose(pipe)), kUnreadable);
        return text;
    };
    EXPECT_EQ(printed("view"),
              "marrow: the viewer is not installed; build it with 'make viewer' or install the package "
              "marrow-viewer\n");
    const std::string json = printed("terrain x.asc --json");
    EXPECT_NE(json.find("not installed"), std::string::npos) << json;
    EXPECT_NE(json.find("\"exit_code\": 3"), std::string::npos) << json;
}

}  // namespace
}  // namespace marrow::test
