#include "file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include <marrow/error.h>

#include "io/bytes/byte_stream.h"
#include "codec.h"
#include "data_set.h"
#include "io/bytes/text.h"

namespace marrow {

namespace {

// Takes what the sets say about a frame: the file itself, or the frame's functional groups.
void read_frame(DicomFrame& frame, const DicomSet& position, const DicomSet& orientation,
                const DicomSet& measures, const DicomSet& rescale) {
    if (const auto p = position.decimals(0x00200032, 3)) frame.position = Vec3d{(*p)[0], (*p)[1], (*p)[2]};
    if (const auto o = orientation.decimals(0x00200037, 6)) {
        frame.along_row = Vec3d{(*o)[0], (*o)[1], (*o)[2]};
        frame.along_column = Vec3d{(*o)[3], (*o)[4], (*o)[5]};
    }
    // PixelSpacing is row spacing \ column spacing: the step down comes first
    if (const auto s = measures.decimals(0x00280030, 2)) frame.spacing = {(*s)[1], (*s)[0]};
    frame.thickness = measures.decimal(0x00180050);
    const auto present = [&](DicomTag tag) -> std::optional<double> {
        if (rescale.text(tag).empty()) return {};
        return rescale.decimal(tag).value_or(NAN);
    };
    frame.intercept = present(0x00281052);
    frame.slope = present(0x00281053);
}

// Each frame's own functional groups go before the shared ones, and those before the file itself.
void read_frames(DicomFile& file, const DicomSet& set) {
    const std::vector<DicomSet> per_frame = set.items(0x52009230);
    const std::vector<DicomSet> shared = set.items(0x52009229);
    if (!per_frame.empty() && per_frame.size() != file.frames.size()) {
        throw InputError(
            fmt::format("it describes {} frames and has {}", per_frame.size(), file.frames.size()));
    }
    constexpr std::array<DicomTag, 4> tags = {0x00209113, 0x00209116, 0x00289110, 0x00289145};
    std::array<DicomSet, 4> common;
    for (std::size_t i = 0; i < tags.size(); ++i) {
        const auto items = shared.empty() ? std::vector<DicomSet>() : shared[0].items(tags[i]);
        common[i] = items.empty() ? set : items[0];
    }
    for (std::size_t i = 0; i < file.frames.size(); ++i) {
        std::array<std::vector<DicomSet>, 4> own;
        std::array<const DicomSet*, 4> groups;
        for (std::size_t t = 0; t < tags.size(); ++t) {
            if (!per_frame.empty()) own[t] = per_frame[i].items(tags[t]);
            groups[t] = own[t].empty() ? &common[t] : own[t].data();
        }
        read_frame(file.frames[i], *groups[0], *groups[1], *groups[2], *groups[3]);
        // one place for all frames is none
        if (file.frames.size() > 1 && per_frame.empty()) file.frames[i].position.reset();
    }
}

// Text that may end up in messages: no control characters; letters beyond ASCII only where they are UTF-8.
std::string readable(const DicomSet& set, DicomTag tag) {
    const bool utf8 = set.text(0x00080005) == "ISO_IR 192";
    std::string out = set.text(tag);
    for (char& c : out) {
        const auto byte = static_cast<unsigned char>(c);
        if (byte < 0x20 || byte == 0x7f || (byte > 0x7f && !utf8)) c = '?';
    }
    return out;
}

const char* const deflated_syntax = "1.2.840.10008.1.2.1.99";

bool is_plain_syntax(const std::string& uid) {
    return uid.empty() || uid == "1.2.840.10008.1.2" || uid == "1.2.840.10008.1.2.1" ||
           uid == "1.2.840.10008.1.2.2" || uid == deflated_syntax;
}

// The syntaxes that people meet and that are not read, by name.
std::string named_syntax(const std::string& uid) {
    static constexpr std::pair<std::string_view, const char*> names[] = {
        {"1.2.840.10008.1.2.4.92", "JPEG 2000 of several components"},
        {"1.2.840.10008.1.2.4.93", "JPEG 2000 of several components"},
        {"1.2.840.10008.1.2.4.94", "JPIP"},
        {"1.2.840.10008.1.2.4.95", "JPIP"},
        {"1.2.840.10008.1.2.4.100", "MPEG-2 video"},
        {"1.2.840.10008.1.2.4.101", "MPEG-2 video"},
        {"1.2.840.10008.1.2.4.102", "MPEG-4 video"},
        {"1.2.840.10008.1.2.4.103", "MPEG-4 video"},
        {"1.2.840.10008.1.2.4.104", "MPEG-4 video"},
        {"1.2.840.10008.1.2.4.105", "MPEG-4 video"},
        {"1.2.840.10008.1.2.4.106", "MPEG-4 video"},
        {"1.2.840.10008.1.2.4.107", "HEVC video"},
        {"1.2.840.10008.1.2.4.108", "HEVC video"},
        {"1.2.840.10008.1.2.4.201", "high-throughput JPEG 2000"},
        {"1.2.840.10008.1.2.4.202", "high-throughput JPEG 2000"},
        {"1.2.840.10008.1.2.4.203", "high-throughput JPEG 2000"}};
    for (const auto& [known, name] : names) {
        if (uid == known) return fmt::format("{} ({})", name, uid);
    }
    return shown(uid);
}

// How many bytes of pixels a byte of the file can become; 0 where the syntax is not read.
double inflation_of(const std::string& transfer_syntax) {
    if (transfer_syntax == deflated_syntax) return 1032;
    return is_plain_syntax(transfer_syntax) ? 1 : most_inflation(transfer_syntax);
}

// What is wrong with so many frames; empty where the file can hold them.
std::string overclaim(const DicomFile& file, double frames) {
    const double claimed =
        static_cast<double>(file.columns * file.rows) * frames * static_cast<double>(file.bits_allocated) / 8;
    if (claimed <= inflation_of(file.transfer_syntax) * static_cast<double>(size_of_file(file.path)))
        return {};
    return fmt::format("claims {:.0f} bytes of pixels and is too small for them; it is truncated", claimed);
}

// Why the pixels of a file cannot be read; empty where they can.
std::string refusal(const DicomFile& file, const DicomSet& set) {
    const std::string photometric = set.text(0x00280004);
    if (set.unsigned_short(0x00280002).value_or(1) != 1 ||
        (!photometric.empty() && photometric != "MONOCHROME1" && photometric != "MONOCHROME2")) {
        return fmt::format("is in colour ({}); only grey scans are read", shown(photometric));
    }
    if (set.has(0x00283000)) return "has a modality lookup table, which is not read";
    if (file.bits_allocated != 8 && file.bits_allocated != 16 && file.bits_allocated != 32) {
        return fmt::format("has {} bits per sample; 8, 16 or 32 are read", file.bits_allocated);
    }
    if (file.bits_stored < 1 || file.bits_stored > file.bits_allocated ||
        file.high_bit < file.bits_stored - 1 || file.high_bit >= file.bits_allocated) {
        return "has a pixel format that contradicts itself (BitsAllocated, BitsStored, HighBit)";
    }
    if (inflation_of(file.transfer_syntax) == 0) {
        return fmt::format("has pixels in the transfer syntax {}, which is not read",
                           named_syntax(file.transfer_syntax));
    }
    return overclaim(file, 1);
}

// By what a data set says that it is. One that ends before it says so is no report either.
bool should_have_pixels(const DicomSet& set) {
    static constexpr std::string_view images[] = {
        "1.2.840.10008.5.1.4.1.1.2",   "1.2.840.10008.5.1.4.1.1.2.1", "1.2.840.10008.5.1.4.1.1.2.2",
        "1.2.840.10008.5.1.4.1.1.4",   "1.2.840.10008.5.1.4.1.1.4.1", "1.2.840.10008.5.1.4.1.1.4.4",
        "1.2.840.10008.5.1.4.1.1.128", "1.2.840.10008.5.1.4.1.1.130", "1.2.840.10008.5.1.4.1.1.20",
        "1.2.840.10008.5.1.4.1.1.7"};  // CT, MR, PET, NM, secondary capture
    constexpr DicomTag sop_class = 0x00080016, directory_records = 0x00041220;
    if (set.has(directory_records)) return false;
    const std::string uid = set.text(sop_class);
    return uid.empty() || std::find(std::begin(images), std::end(images), uid) != std::end(images);
}

}  // namespace

std::optional<DicomFile> read_dicom_header(const std::filesystem::path& path) {
    const DicomBytes parsed = parse_dicom_header(path);
    const DicomSet& set = parsed.set;
    DicomFile file;
    file.path = path;
    file.columns = set.unsigned_short(0x00280011).value_or(0);
    file.rows = set.unsigned_short(0x00280010).value_or(0);
    if (file.columns == 0 || file.rows == 0 || parsed.pixels_at == 0) {
        if (should_have_pixels(set))
            throw InputError(fmt::format("{}: the DICOM file has no pixels; it is truncated", shown(path)));
        return {};
    }
    file.series_uid = readable(set, 0x0020000e);
    file.frame_of_reference = set.text(0x00200052);
    file.description = readable(set, 0x0008103e);
    file.modality = readable(set, 0x00080060);
    file.patient_name = readable(set, 0x00100010);
    file.echo = set.text(0x00180086);
    if (const auto instance = integer(set.text(0x00200013)); instance && std::abs(*instance) < 1000000000)
        file.instance = static_cast<int>(*instance);
    file.transfer_syntax = parsed.transfer_syntax;
    file.localizer = set.text(0x00080008).find("LOCALIZER") != std::string::npos;
    file.bits_allocated = set.unsigned_short(0x00280100).value_or(0);
    file.bits_stored = set.unsigned_short(0x00280101).value_or(file.bits_allocated);
    file.high_bit = set.unsigned_short(0x00280102).value_or(file.bits_stored - 1);
    file.is_signed = set.unsigned_short(0x00280103).value_or(0) == 1;

    file.refusal = refusal(file, set);
    const double frames = set.decimal(0x00280008).value_or(1);
    // no memory for frames that cannot be there
    if (!(frames >= 1) || frames > static_cast<double>(size_of_file(path)))
        throw InputError(fmt::format("{}: claims {} frames", shown(path), frames));
    if (const std::string why = overclaim(file, frames); file.refusal.empty() && !why.empty())
        throw InputError(fmt::format("{}: {}", shown(path), why));
    file.frames.resize(static_cast<std::size_t>(frames));
    try {
        read_frames(file, set);
    } catch (const InputError& error) {
        throw InputError(fmt::format("{}: {}", shown(path), error.what()));
    }
    return file;
}

namespace {

// Takes the stored bits out of each cell of type T, and extends the sign: the other bits can hold anything.
template <class T>
void unpack(const char* cells, std::size_t count, int bits, int high_bit, bool is_signed, std::int32_t* out) {
    const int drop = high_bit + 1 - bits;
    const std::uint32_t mask = bits == 32 ? ~0u : (1u << bits) - 1;
    const std::uint32_t sign = 1u << (bits - 1);
    std::uint32_t beyond = 0;
    for (std::size_t i = 0; i < count; ++i) {
        T cell;
        std::memcpy(&cell, cells + i * sizeof(T), sizeof(T));
        std::uint32_t value = (static_cast<std::uint32_t>(cell) >> drop) & mask;
        if (is_signed)
            value = (value ^ sign) - sign;
        else
            beyond |= value >> 31;
        out[i] = static_cast<std::int32_t>(value);
    }
    if (beyond) throw InputError("has samples beyond 2^31, which are not read");
}

void unpack_cells(const char* cells, std::size_t count, int cell_size, int bits, int high_bit, bool is_signed,
                  std::int32_t* out) {
    if (cell_size == 1)
        unpack<std::uint8_t>(cells, count, bits, high_bit, is_signed, out);
    else if (cell_size == 2)
        unpack<std::uint16_t>(cells, count, bits, high_bit, is_signed, out);
    else
        unpack<std::uint32_t>(cells, count, bits, high_bit, is_signed, out);
}

void decode_plain(const DicomFile& file, DicomBytes& parsed, Buffer<std::int32_t>& out) {
    const std::size_t cell_size = static_cast<std::size_t>(file.bits_allocated) / 8;
    const std::size_t needed = out.size() * cell_size;
    const std::size_t held = std::min(parsed.bytes.size() - parsed.pixels_at, parsed.pixels_size.value_or(0));
    if (held < needed)
        throw InputError(fmt::format("has {} bytes of pixels instead of {}; it is truncated", held, needed));
    char* cells = parsed.bytes.data() + parsed.pixels_at;
    if (parsed.encoding.big_endian && parsed.pixels_are_words) {
        for (std::size_t i = 0; i + 1 < held; i += 2) std::swap(cells[i], cells[i + 1]);
    }
    unpack_cells(cells, out.size(), static_cast<int>(cell_size), file.bits_stored, file.high_bit,
                 file.is_signed, out.data());
}

void decode_compressed(const DicomFile& file, const DicomBytes& parsed, Buffer<std::int32_t>& out,
                       const Step& step) {
    if (file.high_bit != file.bits_stored - 1)
        throw InputError("has compressed samples whose high bit is not the top one");
    const std::size_t frames = file.frames.size(), area = out.size() / frames;
    const std::vector<std::string> streams = compressed_frames(parsed, frames);
    for_each_part(frames, [&](std::size_t i) {
        const DecodedFrame frame = decode_frame(file.transfer_syntax, streams[i], file.columns, file.rows,
                                                file.bits_allocated, file.bits_stored);
        unpack_cells(frame.cells.data(), area, frame.cell_size, frame.bits, frame.bits - 1, file.is_signed,
                     out.data() + i * area);
        step(1 / static_cast<double>(frames));
    });
}

}  // namespace

const std::int32_t* decode_dicom(const DicomFile& file, DicomWorkspace& workspace, const Step& step) {
    if (!file.refusal.empty()) throw InputError(fmt::format("{}: {}", shown(file.path), file.refusal));
    DicomBytes parsed = parse_dicom(file.path, std::move(workspace.bytes));
    try {
        workspace.stored.resize(static_cast<std::size_t>(file.columns * file.rows) * file.frames.size());
        if (parsed.pixels_size.has_value() == !is_plain_syntax(file.transfer_syntax))
            throw InputError("its pixel data are not in the form that its transfer syntax says");
        if (parsed.pixels_size) {
            decode_plain(file, parsed, workspace.stored);
            step(1);
        } else {
            decode_compressed(file, parsed, workspace.stored, step);
        }
    } catch (const InputError& error) {
        throw InputError(fmt::format("{}: {}", shown(file.path), error.what()));
    } catch (const std::bad_alloc&) {
        throw LimitError(fmt::format("{}: does not fit in memory", shown(file.path)));
    }
    workspace.bytes = std::move(parsed.bytes);
    return workspace.stored.data();
}

}  // namespace marrow
