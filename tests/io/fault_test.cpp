// System calls fail: each call that can fail fails once, for every format, and the old mesh stays.
#include <cerrno>
#include <chrono>
#include <csignal>
#include <thread>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <marrow/error.h>
#include <marrow/mesh_io.h>
#include <marrow/parts.h>

#include "support/fields.h"
#include "support/small_scans.h"

extern char** environ;

namespace marrow::test {
namespace {

struct Process {
    int code = 0;  // exit code, or minus the signal that ended the process
    std::string err;
    std::int64_t peak_bytes = 0;
};

// Runs `PROGRAM ARGUMENTS...` with additional environment variables. Sends `kill_signal` after `delay`, if it
// is not 0.
Process run(std::vector<std::string> arguments, const std::vector<std::string>& more,
            const TemporaryFolder& scratch, int kill_signal = 0, std::chrono::microseconds delay = {},
            const char* program = MARROW_PROGRAM) {
    arguments.insert(arguments.begin(), program);
    std::vector<char*> argv;
    for (auto& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    std::vector<std::string> settings = more;
    std::vector<char*> environment;
    for (char** e = environ; *e; ++e) environment.push_back(*e);
    for (auto& setting : settings) environment.push_back(setting.data());
    environment.push_back(nullptr);

    const std::string err = scratch / "err";
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, err.c_str(), O_WRONLY | O_CREAT | O_TRUNC,
                                     0666);
    pid_t pid = 0;
    const int error = posix_spawn(&pid, program, &actions, nullptr, argv.data(), environment.data());
    posix_spawn_file_actions_destroy(&actions);
    if (error != 0) return {-1, "cannot start"};
    if (kill_signal != 0) {
        std::this_thread::sleep_for(delay);
        kill(pid, kill_signal);
    }
    int status = 0;
    rusage usage{};
    wait4(pid, &status, 0, &usage);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status), read_file(err),
            std::int64_t{usage.ru_maxrss} * 1024};
}

// The settings that make the n-th `call` on files of the folder fail.
std::vector<std::string> fault(const TemporaryFolder& folder, const std::string& call, int n, int error,
                               const TemporaryFolder& scratch) {
    return {"LD_PRELOAD=" MARROW_FAULT_SHIM,
            "ASAN_OPTIONS=verify_asan_link_order=0",
            "MARROW_FAULT_FOLDER=" + folder.path().string(),
            "MARROW_FAULT_CALL=" + call,
            "MARROW_FAULT_AT=" + std::to_string(n),
            "MARROW_FAULT_ERRNO=" + std::to_string(error),
            "MARROW_FAULT_FIRED=" + (scratch / "fired").string()};
}

// Runs the command with the n-th `call` failing, n = 1, 2, ..., until it has fewer calls. Each time the mesh
// must be the old one or the complete new one, and no other file may be left.
void fail_each(const std::vector<std::string>& command, const TemporaryFolder& folder, const fs::path& mesh,
               const std::string& call, int error) {
    TemporaryFolder scratch;
    const Process good = run(command, {}, scratch);
    ASSERT_EQ(good.code, 0) << good.err;
    const std::string whole = read_file(mesh);
    write_file(mesh, "old");
    const auto files = folder.files();
    constexpr int most = 200;
    for (int n = 1; n < most; ++n) {
        SCOPED_TRACE(call + " number " + std::to_string(n) + " fails with error " + std::to_string(error));
        write_file(mesh, "old");
        fs::remove(scratch / "fired");
        const Process process = run(command, fault(folder, call, n, error, scratch), scratch);
        EXPECT_EQ(folder.files(), files);
        if (!fs::exists(scratch / "fired")) {
            EXPECT_EQ(process.code, 0) << process.err;
            EXPECT_TRUE(read_file(mesh) == whole);
            EXPECT_GT(n, 1) << "no " << call << " at all";
            return;
        }
        // A short transfer is no failure, and neither is a folder that may not be opened after the rename.
        if (error == 0 || (error == EACCES && process.code == 0)) {
            EXPECT_EQ(process.code, 0) << process.err;
            EXPECT_TRUE(read_file(mesh) == whole);
            continue;
        }
        EXPECT_EQ(process.code, 3) << process.err;
        EXPECT_EQ(std::count(process.err.begin(), process.err.end(), '\n'), 1) << process.err;
        EXPECT_EQ(process.err.find("marrow: "), 0u) << process.err;
        const std::string left = read_file(mesh);
        if (left == whole)
            EXPECT_TRUE(call == "fsync" || call == "open") << "the folder's, after the rename";
        else
            EXPECT_TRUE(left == "old");
    }
    ADD_FAILURE() << "still failing";
}

std::vector<std::string> command_for(const SmallScan& scan, const TemporaryFolder& folder,
                                     const fs::path& mesh) {
    std::vector<std::string> command{folder / scan.name, "-o", mesh, "--isovalue", "0.5", "-q"};
    if (scan.needs_spacing) command.insert(command.end(), {"--spacing", "1,1,1"});
    return command;
}

// This test is first, because a new process starts with the peak memory of its parent. Libraries count too.
TEST(Faults, AHeaderThatClaimsATrillionSamplesAllocatesNothing) {
    TemporaryFolder folder, scratch;
    NiftiWriter nifti;
    nifti.dim = {3, 10000, 10000, 10000};
    const std::string text = "\nsizes: 10000 10000 10000\ntype: short\nendian: little\nspacings: 1 1 1\n";
    const std::map<std::string, std::string> files = {
        {"a.nii", nifti.header()},
        {"b.nii.gz", gzipped(nifti.header())},
        {"c.nrrd", "NRRD0004\ndimension: 3" + text + "encoding: raw\n\n"},
        {"d.nrrd", "NRRD0004\ndimension: 3" + text + "encoding: gzip\n\n"},
        {"e.mha",
         "ObjectType = Image\nNDims = 3\nDimSize = 10000 10000 10000\nElementSpacing = 1 1 1\nElementType = "
         "MET_SHORT\nElementDataFile = LOCAL\n"}};
    for (const auto& [name, bytes] : files) {
        SCOPED_TRACE(name);
        write_file(folder / name, bytes + std::string(400 - std::min<std::size_t>(400, bytes.size()), '\0'));
        const Process process =
            run({folder / name, "-o", folder / "mesh.stl", "--isovalue", "0"}, {}, scratch);
        EXPECT_EQ(process.code, 3);
        EXPECT_NE(process.err.find("claims"), process.err.npos) << process.err;
        EXPECT_LT(process.peak_bytes, 100 << 20);
    }
}

TEST(Faults, WhereReadingFailsNothingIsWritten) {
    for (const SmallScan& scan : small_scans()) {
        SCOPED_TRACE(scan.name);
        TemporaryFolder folder;
        scan.write(folder.path());
        const fs::path mesh = folder / "mesh.stl";
        const auto command = command_for(scan, folder, mesh);
        fail_each(command, folder, mesh, "read", EIO);
        fail_each(command, folder, mesh, "read", 0);
    }
}

TEST(Faults, WhereAFileCannotBeOpenedNothingIsWritten) {
    for (const SmallScan& scan : small_scans()) {
        SCOPED_TRACE(scan.name);
        TemporaryFolder folder;
        scan.write(folder.path());
        const fs::path mesh = folder / "mesh.stl";
        fail_each(command_for(scan, folder, mesh), folder, mesh, "open", EACCES);
    }
}

TEST(Faults, WhereWritingFailsTheOldMeshStays) {
    const SmallScan scan = small_scans().front();
    for (const char* ending : {".stl", ".ply", ".obj", ".vtp", ".3mf", ".glb", ".stl.gz"}) {
        SCOPED_TRACE(ending);
        TemporaryFolder folder;
        scan.write(folder.path());
        const fs::path mesh = folder / (std::string("mesh") + ending);
        const auto command = command_for(scan, folder, mesh);
        for (const int error : {ENOSPC, EIO, 0}) fail_each(command, folder, mesh, "write", error);
        fail_each(command, folder, mesh, "fsync", EIO);
        fail_each(command, folder, mesh, "close", EIO);
        fail_each(command, folder, mesh, "rename", EROFS);
    }
}

TEST(Faults, KilledAtAnyTimeTheMeshIsOldOrWhole) {
    TemporaryFolder folder, scratch;
    NiftiWriter header;  // many small balls, so that reading, extracting and writing take some time
    constexpr int n = 128;
    header.dim = {3, n, n, n};
    std::vector<std::int16_t> samples;
    for (int i = 0; i < n * n * n; ++i)
        samples.push_back((i / 2 + i / n / 2 + i / n / n / 2) % 2 ? 1000 : -1000);
    write_file(folder / "scan.nii", header.header() + bytes_of(samples));
    const fs::path mesh = folder / "mesh.stl";
    const std::vector<std::string> command{folder / "scan.nii", "-o", mesh, "--isovalue", "0", "-q"};
    ASSERT_EQ(run(command, {}, scratch).code, 0);
    const std::string whole = read_file(mesh);
    int killed = 0;
    std::uint32_t random = 1;
    for (int attempt = 0; attempt < 30; ++attempt) {
        write_file(mesh, "old");
        random = random * 1664525u + 1013904223u;
        const std::chrono::microseconds delay(random % 500'000);
        const Process process = run(command, {}, scratch, SIGKILL, delay);
        killed += process.code == -SIGKILL;
        const std::string left = read_file(mesh);
        EXPECT_TRUE(left == "old" || left == whole) << left.size() << " bytes";
        if (process.code == 0) {
            EXPECT_TRUE(left == whole);
        }
        for (const auto& name : folder.files()) {  // a killed process cannot remove its temporary file
            EXPECT_TRUE(name == "scan.nii" || name == "mesh.stl" || name.starts_with(".marrow-")) << name;
            if (name.starts_with(".marrow-")) fs::remove(folder / name);
        }
    }
    EXPECT_GT(killed, 0);
}

TEST(Faults, DevicesAreRefused) {
    TemporaryFolder folder, scratch;
    const SmallScan scan = small_scans().front();
    scan.write(folder.path());
    fs::create_symlink("/dev/full", folder / "full.stl");
    const Process device = run(command_for(scan, folder, folder / "full.stl"), {}, scratch);
    EXPECT_EQ(device.code, 3);
    EXPECT_NE(device.err.find("not a regular file"), device.err.npos) << device.err;
    EXPECT_TRUE(fs::is_symlink(folder / "full.stl"));
}

TEST(Faults, ReadOnlyFoldersAreRefused) {
    TemporaryFolder folder, scratch;
    const SmallScan scan = small_scans().front();
    scan.write(folder.path());
    if (geteuid() == 0) {  // root may write to any folder except those of the kernel
        const Process refused = run(command_for(scan, folder, "/sys/mesh.stl"), {}, scratch);
        EXPECT_EQ(refused.code, 3);
        EXPECT_NE(refused.err.find("cannot write '/sys/mesh.stl'"), refused.err.npos) << refused.err;
        return;
    }
    fs::create_directory(folder / "locked");
    fs::permissions(folder / "locked", fs::perms::owner_read | fs::perms::owner_exec);
    const Process locked = run(command_for(scan, folder, folder / "locked/mesh.stl"), {}, scratch);
    fs::permissions(folder / "locked", fs::perms::owner_all);
    EXPECT_EQ(locked.code, 3);
    EXPECT_NE(locked.err.find("Permission denied"), locked.err.npos) << locked.err;
    EXPECT_TRUE(fs::is_empty(folder / "locked"));
}

// Runs in a process of its own, whose system calls fail.
TEST(Faults, DISABLED_WritesAPart) {
    const char* const folder = std::getenv("MARROW_FAULT_FOLDER");
    if (folder == nullptr) GTEST_SKIP() << "another test runs it";
    const Volume volume = sampled_in_space<float>(grid(9, 9, 9), sphere({4, 4, 4}, 3));
    const std::vector<PartCounts> counts{count_part(volume, volume.geometry().dims, 0, {})};
    const SharedSurfaceWriter writer(folder + std::string("/a.ply"), counts[0].total(), true);
    EXPECT_THROW(write_part(writer.file(), extract_numbered_part(volume, number_parts(counts)[0], 0, {})),
                 IoError);
}

// A full quota of a network's file system shows only when a file is flushed or closed.
TEST(Faults, APartThatIsNotOnTheDiskIsReported) {
    for (const char* call : {"fsync", "close"}) {
        TemporaryFolder folder, scratch;
        const Process process =
            run({"--gtest_filter=Faults.DISABLED_WritesAPart", "--gtest_also_run_disabled_tests"},
                fault(folder, call, 1, EDQUOT, scratch), scratch, 0, {}, "/proc/self/exe");
        EXPECT_EQ(process.code, 0) << call;
        EXPECT_TRUE(fs::exists(scratch / "fired")) << call;
    }
}

}  // namespace
}  // namespace marrow::test
