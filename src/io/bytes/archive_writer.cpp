// Writes ZIP archives and gzip files by libarchive.
#include "archive_writer.h"

#include <new>
#include <utility>

#include <archive.h>
#include <archive_entry.h>

#include <marrow/error.h>

namespace marrow::internal::io {

// What libarchive calls.
struct ArchiveWriter::Callbacks {
    static la_ssize_t write(archive*, void* self, const void* data, std::size_t bytes) {
        auto& zip = *static_cast<ArchiveWriter*>(self);
        try {
            if (!zip.thrown_) zip.file_.write(data, bytes);
        } catch (...) {
            zip.thrown_ = std::current_exception();
        }
        return zip.thrown_ ? -1 : static_cast<la_ssize_t>(bytes);
    }
};

void ArchiveWriter::Close::operator()(archive* opened) const {
    archive_write_fail(opened);  // so that nothing more is written where an error ended the archive
    archive_write_free(opened);
}

ArchiveWriter::ArchiveWriter(AtomicFile& file, Format format) : file_(file), opened_(archive_write_new()) {
    if (!opened_) throw std::bad_alloc();
    // Higher levels hardly compress meshes better but take several times as long.
    if (format == Format::zip) {
        check(archive_write_set_format_zip(opened_.get()));
        check(archive_write_set_options(opened_.get(), "zip:compression=deflate,zip:compression-level=3"));
    } else {
        check(archive_write_set_format_raw(opened_.get()));
        check(archive_write_add_filter_gzip(opened_.get()));
        check(archive_write_set_options(opened_.get(), "gzip:compression-level=3,gzip:!timestamp"));
    }
    archive_write_set_bytes_in_last_block(opened_.get(), 1);  // no padding
    check(archive_write_open2(opened_.get(), this, nullptr, Callbacks::write, nullptr, nullptr));
}

void ArchiveWriter::begin(const std::string& name) {
    const std::unique_ptr<archive_entry, decltype(&archive_entry_free)> entry(archive_entry_new(),
                                                                              archive_entry_free);
    if (!entry) throw std::bad_alloc();
    archive_entry_set_pathname(entry.get(), name.c_str());
    archive_entry_set_filetype(entry.get(), AE_IFREG);
    archive_entry_set_perm(entry.get(), 0644);
    // ZIP has local time from 1980 on. Without a time it is the same in all time zones.
    archive_entry_unset_mtime(entry.get());
    check(archive_write_header(opened_.get(), entry.get()));
}

void ArchiveWriter::write(const void* data, std::size_t bytes) {
    check(archive_write_data(opened_.get(), data, bytes));
}

void ArchiveWriter::finish() {
    check(archive_write_close(opened_.get()));
}

void ArchiveWriter::check(long result) {
    if (thrown_) std::rethrow_exception(std::exchange(thrown_, nullptr));
    if (result < ARCHIVE_OK)
        throw IoError(std::string("cannot write a compressed file: ") + archive_error_string(opened_.get()));
}

}  // namespace marrow::internal::io
