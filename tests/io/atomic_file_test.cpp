// AtomicFile: files appear complete or not at all.
#include <csignal>
#include <cstdint>

#include <grp.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <sys/xattr.h>
#include <unistd.h>

#include <marrow/atomic_file.h>
#include <marrow/error.h>

#include "support/temporary_folder.h"

namespace marrow::test {
namespace {

using Names = std::set<std::string>;

TEST(AtomicFile, ReplacesTheOldFileOnlyAtCommit) {
    const TemporaryFolder folder;
    write_file(folder / "a", "old");
    AtomicFile file(folder / "a");
    file.write("new ");
    file.write("content");
    EXPECT_EQ(read_file(folder / "a"), "old");
    file.commit();
    EXPECT_EQ(read_file(folder / "a"), "new content");
    EXPECT_EQ(folder.files(), Names{"a"});
}

TEST(AtomicFile, LeavesNothingWithoutCommit) {
    const TemporaryFolder folder;
    write_file(folder / "a", "old");
    {
        AtomicFile old(folder / "a"), fresh(folder / "b");
        old.write("new");
        fresh.write("new");
        EXPECT_EQ(folder.files().size(), 3u);  // the temporary files are in the target's folder
    }
    EXPECT_EQ(read_file(folder / "a"), "old");
    EXPECT_EQ(folder.files(), Names{"a"});
}

TEST(AtomicFile, FollowsSymbolicLinks) {
    const TemporaryFolder folder;
    std::filesystem::create_directory(folder / "there");
    write_file(folder / "there/a", "old");
    std::filesystem::create_symlink("there/a", folder / "link");
    AtomicFile file(folder / "link");
    file.write("new");
    file.commit();
    EXPECT_TRUE(std::filesystem::is_symlink(folder / "link"));
    EXPECT_EQ(read_file(folder / "there/a"), "new");
}

TEST(AtomicFile, FollowsLinksToAFileThatDoesNotExistYet) {
    const TemporaryFolder folder;
    std::filesystem::create_directory(folder / "there");
    std::filesystem::create_symlink("../again", folder / "there/link");
    std::filesystem::create_symlink(folder / "there/a", folder / "again");
    AtomicFile file(folder / "there/link");
    file.write("new");
    file.commit();
    EXPECT_TRUE(std::filesystem::is_symlink(folder / "there/link"));
    EXPECT_TRUE(std::filesystem::is_symlink(folder / "again"));
    EXPECT_EQ(read_file(folder / "there/a"), "new");

    std::filesystem::create_symlink("loop", folder / "loop");
    std::filesystem::create_symlink("missing/a", folder / "lost");
    EXPECT_THROW(AtomicFile{folder / "loop"}, IoError);
    EXPECT_THROW(AtomicFile{folder / "lost"}, IoError);
    EXPECT_EQ(folder.files(), (Names{"again", "loop", "lost", "there"}));
}

enum class Outcome { done, failed, no_such_user };

// Replaces a file as a user who is not root and, unless the tests run as one, in no group of theirs.
Outcome replace_as_other_user(const std::filesystem::path& file) {
    const pid_t child = fork();
    if (child == 0) {
        if (geteuid() == 0 && (setgroups(0, nullptr) != 0 || setgid(65534) != 0 || setuid(65534) != 0))
            _exit(77);
        if (access(file.parent_path().c_str(), X_OK) != 0) _exit(77);
        try {
            AtomicFile out(file);
            out.write("new");
            out.commit();
        } catch (const std::exception&) {
            _exit(1);
        }
        _exit(0);
    }
    int status = -1;
    EXPECT_EQ(waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFEXITED(status));
    return WEXITSTATUS(status) == 77  ? Outcome::no_such_user
           : WEXITSTATUS(status) == 0 ? Outcome::done
                                      : Outcome::failed;
}

constexpr auto kAnyoneMayCreateFiles = static_cast<std::filesystem::perms>(0777);

unsigned mode_of(const std::filesystem::path& file) {
    return static_cast<unsigned>(std::filesystem::status(file).permissions());
}

TEST(AtomicFile, NeedsNoPermissionToListTheFolder) {
    const TemporaryFolder folder;
    std::filesystem::permissions(folder.path(), static_cast<std::filesystem::perms>(0333));
    const Outcome outcome = replace_as_other_user(folder / "a");
    std::filesystem::permissions(folder.path(), std::filesystem::perms::owner_all);
    if (outcome == Outcome::no_such_user) GTEST_SKIP() << "there is no other user who may enter";
    EXPECT_EQ(outcome, Outcome::done);
    EXPECT_EQ(read_file(folder / "a"), "new");
}

TEST(AtomicFile, RefusesToReplaceAFileThatIsWriteProtected) {
    const TemporaryFolder folder;
    std::filesystem::permissions(folder.path(), kAnyoneMayCreateFiles);
    write_file(folder / "a", "old");
    std::filesystem::permissions(folder / "a", static_cast<std::filesystem::perms>(0444));
    const Outcome outcome = replace_as_other_user(folder / "a");
    if (outcome == Outcome::no_such_user) GTEST_SKIP() << "there is no other user who may enter";
    EXPECT_EQ(outcome, Outcome::failed);
    EXPECT_EQ(read_file(folder / "a"), "old");
    EXPECT_EQ(folder.files(), Names{"a"});
}

TEST(AtomicFile, LetsNoOtherGroupReadTheFileThanBefore) {
    if (geteuid() != 0) GTEST_SKIP() << "only root may give files to any group";
    const TemporaryFolder folder;
    std::filesystem::permissions(folder.path(), kAnyoneMayCreateFiles);
    const auto write_for_group = [&](unsigned mode) {
        write_file(folder / "a", "old");
        ASSERT_EQ(chown((folder / "a").c_str(), 0, 4242), 0);
        std::filesystem::permissions(folder / "a", static_cast<std::filesystem::perms>(mode));
    };
    const auto group = [&] {
        struct stat found {};
        EXPECT_EQ(stat((folder / "a").c_str(), &found), 0);
        return found.st_gid;
    };
    write_for_group(0640);
    AtomicFile(folder / "a").commit();
    EXPECT_EQ(group(), 4242u);
    EXPECT_EQ(mode_of(folder / "a"), 0640u);

    write_for_group(0666);
    const Outcome outcome = replace_as_other_user(folder / "a");
    if (outcome == Outcome::no_such_user) GTEST_SKIP() << "there is no other user who may enter";
    EXPECT_EQ(outcome, Outcome::done);
    EXPECT_NE(group(), 4242u);
    EXPECT_EQ(mode_of(folder / "a"), 0666u);
}

TEST(AtomicFile, KeepsTheAccessControlListOfTheFileThatItReplaces) {
    const TemporaryFolder folder;
    write_file(folder / "a", "old");
    // Version 2: kind, rights, user or group. The owner and user 1234 may read and write, all others nothing.
    struct Entry {
        std::uint16_t kind, rights;
        std::uint32_t id;
    };
    const struct {
        std::uint32_t version = 2;
        Entry entries[5] = {{1, 6, ~0u}, {2, 6, 1234}, {4, 0, ~0u}, {16, 6, ~0u}, {32, 0, ~0u}};
    } list;
    constexpr const char* kName = "system.posix_acl_access";
    if (setxattr((folder / "a").c_str(), kName, &list, sizeof list, 0) != 0)
        GTEST_SKIP() << "the file system has no access control lists";
    const auto list_of = [](const std::filesystem::path& file) {
        std::string found(1000, '\0');
        const ssize_t size = getxattr(file.c_str(), kName, found.data(), found.size());
        found.resize(size < 0 ? 0 : static_cast<std::size_t>(size));
        return found;
    };
    const std::string before = list_of(folder / "a");
    ASSERT_FALSE(before.empty());
    AtomicFile(folder / "a").commit();
    EXPECT_EQ(list_of(folder / "a"), before);
}

TEST(AtomicFile, GivesThePermissionsOfANewFile) {
    const TemporaryFolder folder;
    AtomicFile file(folder / "a");
    file.commit();
    write_file(folder / "b", "");
    EXPECT_EQ(std::filesystem::status(folder / "a").permissions(),
              std::filesystem::status(folder / "b").permissions());
}

TEST(AtomicFile, KeepsThePermissionsOfTheFileThatItReplaces) {
    const TemporaryFolder folder;
    for (const unsigned mode : {0600u, 0640u, 0666u}) {
        write_file(folder / "a", "old");
        std::filesystem::permissions(folder / "a", static_cast<std::filesystem::perms>(mode));
        AtomicFile file(folder / "a");
        file.commit();
        EXPECT_EQ(std::filesystem::status(folder / "a").permissions(),
                  static_cast<std::filesystem::perms>(mode));
    }
}

TEST(AtomicFile, RefusesTargetsThatAreNotRegularFiles) {
    const TemporaryFolder folder;
    write_file(folder / "file", "old");
    std::filesystem::create_directory(folder / "folder");
    for (const auto& target : {folder / "folder", folder / "missing/a", folder / "file/a",
                               std::filesystem::path("/dev/full"), std::filesystem::path("")}) {
        EXPECT_THROW(AtomicFile{target}, IoError) << target;
    }
    EXPECT_TRUE(std::filesystem::is_character_file("/dev/full"));
    EXPECT_EQ(folder.files(), (Names{"file", "folder"}));
    EXPECT_EQ(read_file(folder / "file"), "old");
}

TEST(AtomicFile, ReportsTheErrorOfTheSystem) {
    const TemporaryFolder folder;
    const auto message = [](const std::filesystem::path& target) -> std::string {
        try {
            AtomicFile file(target);
        } catch (const IoError& error) {
            return error.what();
        }
        return "opened";
    };
    EXPECT_NE(message(folder / "missing/a").find("there is no folder"), std::string::npos);
    EXPECT_EQ(message(folder / "a\nb/c").find('\n'), std::string::npos) << "one line";
    std::filesystem::create_symlink("missing/a", folder / "lost");
    EXPECT_NE(message(folder / "lost").find("there is no folder"), std::string::npos)
        << message(folder / "lost");
    // This folder exists, but no file can be created in it.
    const std::string proc = message("/proc/a");
    EXPECT_EQ(proc.find("there is no folder"), std::string::npos) << proc;
    EXPECT_EQ(proc.find("cannot write '/proc/a': "), 0u) << proc;
}

TEST(AtomicFile, LeavesNothingWhenTheSystemStopsWriting) {
    const TemporaryFolder folder;
    write_file(folder / "a", "old");
    const std::string data(100000, 'x');

    // The limit shortens the first write, and the next one fails.
    const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
    rlimit old_limit{};
    getrlimit(RLIMIT_FSIZE, &old_limit);
    rlimit limit = old_limit;
    limit.rlim_cur = 50000;
    setrlimit(RLIMIT_FSIZE, &limit);
    std::string message;
    try {
        AtomicFile file(folder / "a");
        file.write(data);
        file.commit();
    } catch (const IoError& error) {
        message = error.what();
    }
    setrlimit(RLIMIT_FSIZE, &old_limit);
    std::signal(SIGXFSZ, old_handler);

    EXPECT_EQ(message, "cannot write '" + (folder / "a").string() + "': File too large");
    EXPECT_EQ(read_file(folder / "a"), "old");
    EXPECT_EQ(folder.files(), Names{"a"});
}

}  // namespace
}  // namespace marrow::test
