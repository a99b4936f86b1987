// Reads ZIP archives after PKWARE's APPNOTE 6.3: the directory at the end lists the files.
#include "zip_reader.h"

#include <algorithm>
#include <limits>

#include <zlib.h>

#include <marrow/error.h>

#include "text.h"

namespace marrow::internal::io {

namespace {

constexpr std::uint64_t kFileHeader = 0x04034b50, kDirectoryEntry = 0x02014b50, kEnd = 0x06054b50,
                        kLargeEnd = 0x06064b50, kLargeEndLocator = 0x07064b50;
constexpr std::uint64_t kLarge =
    std::numeric_limits<std::uint32_t>::max();  // the value is in a ZIP64 record instead

}  // namespace

std::uint64_t ZipReader::number(std::uint64_t at, int bytes) const {
    const std::string& all = archive_.bytes;
    const auto size = static_cast<std::uint64_t>(bytes);
    if (at > all.size() || all.size() - at < size) archive_.refuse("the ZIP archive is damaged");
    std::uint64_t value = 0;
    for (std::uint64_t i = size; i-- > 0;) value = value << 8 | static_cast<unsigned char>(all[at + i]);
    return value;
}

ZipReader::ZipReader(const FileContent& archive) : archive_(archive) {
    constexpr std::uint64_t kEndSize = 22, kLongestComment = 65535;
    const std::uint64_t size = archive.bytes.size();
    std::uint64_t end = size < kEndSize ? 0 : size - kEndSize + 1;
    const std::uint64_t first = end > kLongestComment ? end - kLongestComment : 0;
    do {
        if (end-- <= first)
            archive.refuse("is not a complete ZIP archive, as a .3mf file should be; it may be cut off");
    } while (number(end, 4) != kEnd);
    std::uint64_t count = number(end + 10, 2), at = number(end + 16, 4);
    if (at == kLarge && end >= 20 && number(end - 20, 4) == kLargeEndLocator) {
        const std::uint64_t large_end = number(end - 12, 8);
        if (number(large_end, 4) != kLargeEnd) archive.refuse("the ZIP archive is damaged");
        count = number(large_end + 32, 8);
        at = number(large_end + 48, 8);
    }
    for (std::uint64_t i = 0; i < count; ++i) {
        if (number(at, 4) != kDirectoryEntry) archive.refuse("the ZIP archive is damaged");
        Entry entry{{},
                    number(at + 10, 2),
                    number(at + 8, 2),
                    number(at + 16, 4),
                    number(at + 20, 4),
                    number(at + 24, 4),
                    number(at + 42, 4)};
        const std::uint64_t name_size = number(at + 28, 2), more = at + 46 + name_size;
        const std::uint64_t more_end = more + number(at + 30, 2), comment_size = number(at + 32, 2);
        if (more_end > size) archive.refuse("the ZIP archive is damaged");
        entry.name = to_lower(std::string_view(archive.bytes).substr(at + 46, name_size));
        read_zip64_sizes(entry, more, more_end);
        entries_.push_back(std::move(entry));
        at = more_end + comment_size;
    }
}

// In ZIP64, values that do not fit into 32 bits are among the extra fields, from `at` to `end`.
void ZipReader::read_zip64_sizes(Entry& entry, std::uint64_t at, std::uint64_t end) const {
    constexpr std::uint64_t kZip64 = 1;
    while (at + 4 <= end) {
        const std::uint64_t field = number(at, 2), next = at + 4 + number(at + 2, 2);
        at += 4;
        for (std::uint64_t* value : {&entry.size, &entry.compressed_size, &entry.offset}) {
            if (field != kZip64 || *value != kLarge || at + 8 > std::min(next, end)) continue;
            *value = number(at, 8);
            at += 8;
        }
        at = next;
    }
}

std::string ZipReader::file(std::string_view name) const {
    const auto entry = std::find_if(entries_.begin(), entries_.end(),
                                    [&](const Entry& e) { return e.name == to_lower(name); });
    if (entry == entries_.end()) archive_.refuse("the ZIP archive has no file " + quoted(name));
    const auto refuse = [&](const char* why) {
        archive_.refuse(quoted(name) + " in the ZIP archive " + why);
    };
    constexpr std::uint64_t kEncrypted = 1, kStored = 0, kDeflated = 8, kMostDeflated = 1032;
    if (entry->flags & kEncrypted) refuse("is encrypted");
    if (entry->method != kStored && entry->method != kDeflated)
        refuse("is compressed by a method that is not supported");
    if (number(entry->offset, 4) != kFileHeader) refuse("is damaged");
    const std::uint64_t begin =
        entry->offset + 30 + number(entry->offset + 26, 2) + number(entry->offset + 28, 2);
    const std::uint64_t size = archive_.bytes.size();
    if (begin > size || entry->compressed_size > size - begin) refuse("is cut off");
    if (entry->size >= kLarge) refuse("has more than 4 GiB");
    if (entry->size / kMostDeflated > entry->compressed_size) refuse("is damaged");

    const char* packed = archive_.bytes.data() + begin;
    std::string bytes;
    if (entry->method == kStored) {
        bytes.assign(packed, entry->compressed_size);
    } else {
        bytes.resize(entry->size);
        z_stream stream{};
        if (inflateInit2(&stream, -15) != Z_OK) throw LimitError("not enough memory for zlib");
        stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed));
        stream.avail_in = static_cast<uInt>(std::min(entry->compressed_size, kLarge));
        stream.next_out = reinterpret_cast<Bytef*>(bytes.data());
        stream.avail_out = static_cast<uInt>(bytes.size());
        const int result = inflate(&stream, Z_FINISH);
        inflateEnd(&stream);
        if (result != Z_STREAM_END || stream.avail_out > 0) refuse("is damaged");
    }
    const uLong checksum = crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
    if (bytes.size() != entry->size || checksum != entry->checksum) refuse("is damaged");
    return bytes;
}

}  // namespace marrow::internal::io
