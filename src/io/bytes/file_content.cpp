// Reads whole files into memory.
#include "file_content.h"

#include <marrow/error.h>

#include "base/checked_size.h"
#include "text.h"

namespace marrow::internal::io {

void FileContent::refuse(const std::string& why) const {
    throw InputError(quoted(path) + ": " + why);
}

FileContent read_content(const std::filesystem::path& path, Compression compression) {
    FileContent content{path, {}};
    std::string& bytes = content.bytes;
    ByteStream stream(path, compression);
    if (compression == Compression::none) {
        bytes.resize(checked_size(regular_file_size(path)));
        stream.read(bytes.data(), bytes.size());
        return content;
    }
    constexpr std::size_t kChunk = std::size_t{1} << 20;
    std::size_t size = 0, read = 0;
    do {
        bytes.resize(size + kChunk);
        read = stream.read_some(bytes.data() + size, kChunk);
        size += read;
        if (size > most_expanded(stream.file_size()))
            content.refuse("expands to more than 100 times the size of the file");
    } while (read > 0);
    bytes.resize(size);
    stream.verify_end();
    return content;
}

}  // namespace marrow::internal::io
