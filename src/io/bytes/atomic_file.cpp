// Writes a temporary file and renames it to its target.
#include <array>
#include <atomic>
#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#ifdef __linux__
#include <sys/xattr.h>
#endif

#include <marrow/atomic_file.h>
#include <marrow/error.h>

#include "text.h"

namespace marrow {

using internal::io::quoted;

namespace fs = std::filesystem;

namespace {

fs::path folder_of(const fs::path& file) {
    const fs::path folder = file.parent_path();
    return folder.empty() ? fs::path(".") : folder;
}

// The file that a path names, with all links followed, also one to a file that does not exist yet.
fs::path followed(fs::path path, std::error_code& error) {
    constexpr int kMostLinks = 40;  // as Linux
    for (int links = 0; links <= kMostLinks; ++links) {
        path = fs::weakly_canonical(path, error);
        std::error_code ignored;
        if (error || !fs::is_symlink(fs::symlink_status(path, ignored))) return path;
        const fs::path next = fs::read_symlink(path, error);
        if (error) return path;
        path = path.parent_path() / next;
    }
    error = std::make_error_code(std::errc::too_many_symbolic_link_levels);
    return path;
}

// A rename is durable once its folder is flushed. Some file systems cannot flush folders and return EINVAL. A
// folder that may be written to but not listed cannot be opened; its file is there all the same.
int flush_folder(const fs::path& folder) {
    const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor < 0) return errno == EACCES ? 0 : errno;
    const int error = ::fsync(descriptor) == 0 || errno == EINVAL ? 0 : errno;
    ::close(descriptor);
    return error;
}

// Gives a file the permissions of the one that it replaces, so that nobody may read it who could not read
// that. File systems without permissions refuse this.
void keep_permissions(const fs::path& from, int descriptor) {
    struct stat old {};
    if (::stat(from.c_str(), &old) != 0) return;
    mode_t mode = old.st_mode & 0777;
    // Only members of a group may give it a file. Another group has no rights but those of all others.
    if (::fchown(descriptor, static_cast<uid_t>(-1), old.st_gid) != 0)
        mode = (mode & ~static_cast<mode_t>(S_IRWXG)) | (mode & S_IRWXO) << 3;
#ifdef __linux__
    // With an access control list, the bits of the group limit what others in the list may do.
    constexpr const char* kList = "system.posix_acl_access";
    std::array<char, 4096> list;
    const ssize_t size = ::getxattr(from.c_str(), kList, list.data(), list.size());
    const bool has_list = size >= 0 || errno == ERANGE;
    if (!has_list)
        ::fremovexattr(descriptor, kList);  // which the folder gives to new files
    else if (size < 0 || ::fsetxattr(descriptor, kList, list.data(), static_cast<std::size_t>(size), 0) != 0)
        mode &= ~static_cast<mode_t>(S_IRWXG);
#endif
    ::fchmod(descriptor, mode);
}

}  // namespace

AtomicFile::AtomicFile(const fs::path& target) : named_(target) {
    std::error_code error;
    target_ = followed(target, error);
    if (error) fail(error.value());
    const fs::file_status status = fs::status(target_, error);
    if (!target_.has_filename() || fs::is_directory(status)) fail(EISDIR);
    // A rename would replace a file that is protected, and a device or a pipe by a regular file.
    if (fs::exists(status) && ::faccessat(AT_FDCWD, target_.c_str(), W_OK, AT_EACCESS) != 0) fail(errno);
    if (fs::exists(status) && !fs::is_regular_file(status))
        throw IoError("cannot write " + quoted(named_) + ": it is not a regular file");

    static std::atomic<unsigned> files{0};
    const std::string stem = ".marrow-" + std::to_string(::getpid()) + "-";
    while (descriptor_ < 0) {
        temporary_ = folder_of(target_) / (stem + std::to_string(files++) + ".tmp");
        descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC,
                             fs::exists(status) ? 0600 : 0666);
        if (descriptor_ < 0 && errno != EEXIST) fail(errno);
    }
    if (fs::exists(status)) keep_permissions(target_, descriptor_);
}

AtomicFile::~AtomicFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
    if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

void AtomicFile::write(const void* data, std::size_t bytes) {
    const char* next = static_cast<const char*>(data);
    while (bytes > 0) {
        const ssize_t written = ::write(descriptor_, next, bytes);
        if (written < 0) {
            if (errno == EINTR) continue;
            fail(errno);
        }
        next += written;
        bytes -= static_cast<std::size_t>(written);
    }
}

void AtomicFile::seek(std::uint64_t offset) {
    if (::lseek(descriptor_, static_cast<off_t>(offset), SEEK_SET) < 0) fail(errno);
}

void AtomicFile::finish() {
    const int descriptor = std::exchange(descriptor_, -1);
    const int error = ::fsync(descriptor) == 0 ? 0 : errno;
    if (::close(descriptor) != 0 && error == 0) fail(errno);
    if (error != 0) fail(error);
    finished_ = true;
}

void AtomicFile::commit() {
    if (!finished_) finish();
    if (::rename(temporary_.c_str(), target_.c_str()) != 0) fail(errno);
    temporary_.clear();
    if (const int error = flush_folder(folder_of(target_))) fail(error);
}

void AtomicFile::fail(int error) const {
    std::string reason = std::generic_category().message(error);
    for (const fs::path& file : {target_, named_}) {
        std::error_code ignored;
        if (error == ENOENT && !fs::exists(folder_of(file), ignored))
            reason = "there is no folder " + quoted(folder_of(file)) + "; create it first";
    }
    throw IoError("cannot write " + quoted(named_) + ": " + reason);
}

}  // namespace marrow
