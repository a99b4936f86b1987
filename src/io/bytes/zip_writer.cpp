// Writes ZIP archives by libarchive.
#include "zip_writer.h"

#include <new>
#include <utility>

#include <archive.h>
#include <archive_entry.h>

#include <marrow/error.h>

namespace marrow::internal::io {

// What libarchive calls.
struct ZipWriter::Callbacks {
    static la_ssize_t write(archive*, void* self, const void* data, std::size_t bytes) {
        auto& zip = *static_cast<ZipWriter*>(self);
        try {
            if (!zip.thrown_) zip.file_.write(data, bytes);
        } catch (...) {
            zip.thrown_ = std::current_exception();
        }
        return zip.thrown_ ? -1 : static_cast<la_ssize_t>(bytes);
    }
};

void ZipWriter::Close::operator()(archive* opened) const {
    archive_write_fail(opened);  // so that no directory is written where an error ended the archive
    archive_write_free(opened);
}

ZipWriter::ZipWriter(AtomicFile& file) : file_(file), opened_(archive_write_new()) {
    if (!opened_) throw std::bad_alloc();
    check(archive_write_set_format_zip(opened_.get()));
    // Higher levels hardly compress meshes better but take several times as long.
    check(archive_write_set_options(opened_.get(), "zip:compression=deflate,zip:compression-level=3"));
    archive_write_set_bytes_in_last_block(opened_.get(), 1);  // no padding
    check(archive_write_open2(opened_.get(), this, nullptr, Callbacks::write, nullptr, nullptr));
}

void ZipWriter::begin(const std::string& name) {
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

void ZipWriter::write(const void* data, std::size_t bytes) {
    check(archive_write_data(opened_.get(), data, bytes));
}

void ZipWriter::finish() {
    check(archive_write_close(opened_.get()));
}

void ZipWriter::check(long result) {
    if (thrown_) std::rethrow_exception(std::exchange(thrown_, nullptr));
    if (result < ARCHIVE_OK)
        throw IoError(std::string("cannot write a ZIP archive: ") + archive_error_string(opened_.get()));
}

}  // namespace marrow::internal::io
