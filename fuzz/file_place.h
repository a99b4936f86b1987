/// Where the file that a fuzz target reads stands.
#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>

/// A folder in memory where there is one, gone at the end.
struct FilePlace {
    std::filesystem::path folder = [] {
        std::string name =
            (std::filesystem::exists("/dev/shm") ? "/dev/shm" : "/tmp") + std::string("/marrow-fuzz-XXXXXX");
        if (!mkdtemp(name.data())) std::abort();
        return name;
    }();
    FilePlace() = default;
    FilePlace(const FilePlace&) = delete;
    FilePlace& operator=(const FilePlace&) = delete;
    ~FilePlace() { std::filesystem::remove_all(folder); }
};

inline void put_file(const std::filesystem::path& path, std::string_view bytes) {
    const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    const bool written =
        file >= 0 && write(file, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size());
    if (!written || close(file) != 0) std::abort();
}
