// Reads ZIP archives by libarchive, whose reader goes by the directory at the archive's end.
#include "zip_reader.h"

#include <algorithm>
#include <functional>
#include <new>

#include <archive.h>
#include <archive_entry.h>

#include "text.h"

namespace marrow::internal::io {

void ZipReader::Close::operator()(archive* opened) const {
    archive_read_free(opened);
}

ZipReader::ZipReader(const FileContent& archive) : archive_(archive), opened_(archive_read_new()) {
    if (!opened_) throw std::bad_alloc();
    archive_read_support_format_zip_seekable(opened_.get());
    if (archive_read_open_memory(opened_.get(), archive.bytes.data(), archive.bytes.size()) != ARCHIVE_OK)
        archive.refuse("is not a complete ZIP archive, as a .3mf file should be; it may be cut off");
}

bool ZipReader::next() {
    ahead_ = {};  // waits for the rest of a file that is left early
    archive_entry* entry = nullptr;
    const int result = archive_read_next_header(opened_.get(), &entry);
    if (result == ARCHIVE_EOF) return false;
    if (result != ARCHIVE_OK && result != ARCHIVE_WARN) archive_.refuse("the ZIP archive is damaged");
    // A warning, such as of a directory that contradicts the file's own header, counts if the file is read.
    fault_ = result == ARCHIVE_WARN ? "is damaged: " + reason() : std::string();
    const char* name = archive_entry_pathname_utf8(entry);
    name_ = to_lower(name ? name : "");
    if (archive_entry_is_encrypted(entry)) fault_ = "is encrypted";
    return true;
}

std::string_view ZipReader::piece() {
    if (!fault_.empty()) refuse(fault_);
    piece_ = ahead_.valid() ? ahead_.get() : decompress();
    // A std::function, because the names of the types that std::async makes of a member's would be exported.
    if (!piece_.empty()) ahead_ = std::async(std::function<std::string()>([this] { return decompress(); }));
    return piece_;
}

std::string ZipReader::decompress() {
    std::string piece(std::size_t{1} << 20, '\0');
    const la_ssize_t size = archive_read_data(opened_.get(), piece.data(), piece.size());
    if (size < 0) refuse("is damaged or not supported: " + reason());
    read_ += static_cast<std::uint64_t>(size);
    if (read_ > most_expanded(archive_.bytes.size()))
        refuse("expands to more than 100 times the size of the archive");
    piece.resize(static_cast<std::size_t>(size));
    return piece;
}

std::string ZipReader::reason() const {
    const char* text = archive_error_string(opened_.get());
    return text ? text : "no reason is known";
}

void ZipReader::refuse(const std::string& why) const {
    archive_.refuse(quoted(name_) + " in the ZIP archive " + why);
}

}  // namespace marrow::internal::io
