// Makes the n-th system call of a kind fail, for files below one folder. fault_test preloads it into the
// program.
//
// MARROW_FAULT_FOLDER  the folder
// MARROW_FAULT_CALL    open, read, write, fsync, close (of files open for writing) or rename
// MARROW_FAULT_AT      n, from 1
// MARROW_FAULT_ERRNO   the error; 0: the n-th read or write transfers one byte only, and succeeds
// MARROW_FAULT_FIRED   a file that is created when the call fails
#include <dlfcn.h>
#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace {

enum Kind : char { other, reading, writing };
std::array<std::atomic<char>, 4096> descriptors;
std::atomic<int> calls{0};

const char* setting(const char* name) {
    const char* value = std::getenv(name);
    return value ? value : "";
}

bool is_ours(const char* path) {
    static const char* const folder = setting("MARROW_FAULT_FOLDER");
    return *folder && std::strncmp(path, folder, std::strlen(folder)) == 0;
}

Kind kind_of(int descriptor) {
    if (descriptor < 0 || descriptor >= static_cast<int>(descriptors.size())) return other;
    return static_cast<Kind>(descriptors[static_cast<std::size_t>(descriptor)].load());
}

template <class F>
F next(const char* name) {
    return reinterpret_cast<F>(dlsym(RTLD_NEXT, name));
}

using Open = int (*)(const char*, int, ...);
using OpenAt = int (*)(int, const char*, int, ...);

// Whether this call must fail; then errno is set.
bool is_the_one(const char* call) {
    static const char* const wanted = setting("MARROW_FAULT_CALL");
    static const int at = std::atoi(setting("MARROW_FAULT_AT"));
    static const int error = std::atoi(setting("MARROW_FAULT_ERRNO"));
    if (std::strcmp(call, wanted) != 0 || ++calls != at) return false;
    static const auto open = next<Open>("open");
    static const auto close = next<int (*)(int)>("close");
    close(open(setting("MARROW_FAULT_FIRED"), O_WRONLY | O_CREAT, 0666));
    errno = error;
    return true;
}

int remember(int descriptor, const char* path, int flags) {
    if (descriptor >= 0 && descriptor < static_cast<int>(descriptors.size()))
        descriptors[static_cast<std::size_t>(descriptor)] = !is_ours(path)                    ? other
                                                            : (flags & O_ACCMODE) == O_RDONLY ? reading
                                                                                              : writing;
    return descriptor;
}

mode_t mode_of(int flags, va_list arguments) {
    return flags & O_CREAT ? va_arg(arguments, mode_t) : 0;
}

int open_through(const char* name, const char* path, int flags, mode_t mode) {
    if (is_ours(path) && is_the_one("open")) return -1;
    return remember(next<Open>(name)(path, flags, mode), path, flags);
}

// The number of bytes to transfer: a short transfer is one byte.
bool fails(const char* call, std::size_t& size) {
    if (!is_the_one(call)) return false;
    if (errno != 0) return true;
    if (size > 1) size = 1;
    return false;
}

}  // namespace

extern "C" {

int open(const char* path, int flags, ...) {
    va_list arguments;
    va_start(arguments, flags);
    const mode_t mode = mode_of(flags, arguments);
    va_end(arguments);
    return open_through("open", path, flags, mode);
}

int open64(const char* path, int flags, ...) {
    va_list arguments;
    va_start(arguments, flags);
    const mode_t mode = mode_of(flags, arguments);
    va_end(arguments);
    return open_through("open64", path, flags, mode);
}

ssize_t read(int descriptor, void* to, size_t size) {
    if (kind_of(descriptor) != other && fails("read", size)) return -1;
    return next<ssize_t (*)(int, void*, size_t)>("read")(descriptor, to, size);
}

ssize_t write(int descriptor, const void* from, size_t size) {
    if (kind_of(descriptor) != other && fails("write", size)) return -1;
    return next<ssize_t (*)(int, const void*, size_t)>("write")(descriptor, from, size);
}

int fsync(int descriptor) {
    if (kind_of(descriptor) != other && is_the_one("fsync")) return -1;
    return next<int (*)(int)>("fsync")(descriptor);
}

int close(int descriptor) {
    const Kind kind = kind_of(descriptor);
    const bool failing = kind == writing && is_the_one("close");
    const int error = errno;
    if (kind != other) descriptors[static_cast<std::size_t>(descriptor)] = other;
    const int result = next<int (*)(int)>("close")(descriptor);
    if (!failing) return result;
    errno = error;
    return -1;
}

int rename(const char* from, const char* to) {
    if (is_ours(to) && is_the_one("rename")) return -1;
    return next<int (*)(const char*, const char*)>("rename")(from, to);
}

}  // extern "C"
