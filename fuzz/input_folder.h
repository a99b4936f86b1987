/// The folder of the file that a fuzz target reads.
#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>

/// A temporary folder, in memory if possible.
struct InputFolder {
    std::filesystem::path path = [] {
        std::string name =
            (std::filesystem::exists("/dev/shm") ? "/dev/shm" : "/tmp") + std::string("/marrow-fuzz-XXXXXX");
        if (!mkdtemp(name.data())) std::abort();
        return name;
    }();
    InputFolder() = default;
    InputFolder(const InputFolder&) = delete;
    InputFolder& operator=(const InputFolder&) = delete;
    ~InputFolder() { std::filesystem::remove_all(path); }
};

/// Writes a file without buffering; aborts if the system reports an error.
inline void put_file(const std::filesystem::path& path, std::string_view bytes) {
    const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    const bool written =
        file >= 0 && write(file, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size());
    if (!written || close(file) != 0) std::abort();
}
