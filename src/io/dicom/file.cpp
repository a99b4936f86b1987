// Reads the header and the pixels of one DICOM file.
#include "file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include <marrow/error.h>
#include <marrow/vector.h>

#include "base/checked_size.h"
#include "character_set.h"
#include "codec.h"
#include "data_set.h"
#include "io/bytes/text.h"
#include "mosaic.h"
#include "segmentation.h"
#include "tags.h"

namespace marrow::internal::io {

std::string readable_text(const DicomDataSet& data_set, DicomTag tag, const DicomDataSet& file) {
    std::string out = data_set.text(tag);
    const auto is_ascii = [](char c) { return static_cast<unsigned char>(c) < 0x80 && c != '\x1b'; };
    const std::string character_set = file.text(tag::kSpecificCharacterSet);
    bool utf8 = character_set == "ISO_IR 192";
    if (!utf8 && !std::all_of(out.begin(), out.end(), is_ascii)) {
        if (const auto converted = to_utf8(out, character_set)) {
            out = *converted;
            utf8 = true;
        }
    }
    for (char& c : out) {
        const auto byte = static_cast<unsigned char>(c);
        if (byte < 0x20 || byte == 0x7f || (byte > 0x7f && !utf8)) c = '?';
    }
    return out;
}

namespace {

// Reads the attributes of a frame from these data sets: the file itself, or the functional groups of the
// frame.
void read_frame(DicomFrame& frame, const DicomDataSet& position, const DicomDataSet& orientation,
                const DicomDataSet& measures, const DicomDataSet& rescale) {
    if (const auto p = position.decimals(tag::kImagePosition, 3))
        frame.position = Vec3d{(*p)[0], (*p)[1], (*p)[2]};
    if (const auto o = orientation.decimals(tag::kImageOrientation, 6)) {
        frame.along_row = Vec3d{(*o)[0], (*o)[1], (*o)[2]};
        frame.along_column = Vec3d{(*o)[3], (*o)[4], (*o)[5]};
    }
    // PixelSpacing is "between rows \ between columns".
    if (const auto s = measures.decimals(tag::kPixelSpacing, 2)) frame.spacing = {(*s)[1], (*s)[0]};
    frame.thickness = measures.decimal(tag::kSliceThickness);
    frame.between = measures.decimal(tag::kSpacingBetweenSlices);
    const auto present = [&](DicomTag tag) -> std::optional<double> {
        if (rescale.text(tag).empty()) return {};
        return rescale.decimal(tag).value_or(NAN);
    };
    frame.intercept = present(tag::kRescaleIntercept);
    frame.slope = present(tag::kRescaleSlope);
    frame.rescale_type = rescale.text(tag::kRescaleType);
}

// The segment that a frame of a segmentation belongs to; 0 if it is not stated.
int segment_of(const DicomDataSet* frame, const std::vector<DicomDataSet>& shared) {
    for (const DicomDataSet* groups : {frame, shared.empty() ? nullptr : shared.data()}) {
        if (!groups) continue;
        const std::vector<DicomDataSet> items = groups->items(tag::kSegmentIdentification);
        if (!items.empty()) return items[0].unsigned_short(tag::kReferencedSegmentNumber).value_or(0);
    }
    return 0;
}

// The functional groups of a frame take precedence over the shared ones, and these over the file itself.
void read_frames(DicomFile& file, const DicomDataSet& data_set) {
    const std::vector<DicomDataSet> per_frame = data_set.items(tag::kPerFrameFunctionalGroups);
    const std::vector<DicomDataSet> shared = data_set.items(tag::kSharedFunctionalGroups);
    if (!per_frame.empty() && per_frame.size() != file.frames.size()) {
        throw InputError(fmt::format("its functional groups describe {} frames, but it has {}",
                                     per_frame.size(), file.frames.size()));
    }
    constexpr std::array<DicomTag, 4> tags = {tag::kPlanePosition, tag::kPlaneOrientation,
                                              tag::kPixelMeasures, tag::kPixelValueTransformation};
    std::array<DicomDataSet, 4> common;
    for (std::size_t i = 0; i < tags.size(); ++i) {
        const auto items = shared.empty() ? std::vector<DicomDataSet>() : shared[0].items(tags[i]);
        common[i] = items.empty() ? data_set : items[0];
    }
    std::vector<VolumeAttributes> volumes =
        read_volume_attributes(data_set, per_frame, shared, file.frames.size());
    for (std::size_t i = 0; i < file.frames.size(); ++i) {
        file.frames[i].volume = std::move(volumes[i]);
        std::array<std::vector<DicomDataSet>, 4> own;
        std::array<const DicomDataSet*, 4> groups;
        for (std::size_t t = 0; t < tags.size(); ++t) {
            if (!per_frame.empty()) own[t] = per_frame[i].items(tags[t]);
            groups[t] = own[t].empty() ? &common[t] : own[t].data();
        }
        if (file.segmentation)
            file.frames[i].segment = segment_of(per_frame.empty() ? nullptr : &per_frame[i], shared);
        read_frame(file.frames[i], *groups[0], *groups[1], *groups[2], *groups[3]);
        // One position for all frames is not a position of any frame.
        if (file.frames.size() > 1 && per_frame.empty()) file.frames[i].position.reset();
    }
}

// Makes a frame of each tile of a Siemens mosaic. The stated position is that of an image of the mosaic's
// size around the centre of the first slice.
void divide_mosaic(DicomFile& file, const DicomDataSet& data_set) {
    const std::optional<DicomMosaic> mosaic = read_mosaic(data_set);
    if (!mosaic || file.refusal) return;
    if (!mosaic->lacks.empty()) {
        file.refusal = fmt::format("is a Siemens mosaic without {}", mosaic->lacks);
        return;
    }
    if (file.frames.size() != 1 || file.columns % mosaic->tiles != 0 || file.rows % mosaic->tiles != 0) {
        file.refusal =
            fmt::format("is a Siemens mosaic of {} slices, which do not fit its size", mosaic->slices);
        return;
    }
    DicomFrame frame = file.frames[0];
    const std::int64_t columns = file.columns / mosaic->tiles, rows = file.rows / mosaic->tiles;
    if (frame.position && frame.along_row && frame.along_column && frame.spacing) {
        const auto half = [](std::int64_t whole, std::int64_t part) {
            return static_cast<double>(whole - part) / 2;
        };
        frame.position = *frame.position +
                         half(file.columns, columns) * (*frame.spacing)[0] * *frame.along_row +
                         half(file.rows, rows) * (*frame.spacing)[1] * *frame.along_column;
    }
    file.columns = columns;
    file.rows = rows;
    file.tiles = mosaic->tiles;
    file.frames.assign(mosaic->slices, frame);
    for (std::size_t k = 0; frame.position && k < file.frames.size(); ++k)
        file.frames[k].position = *frame.position + static_cast<double>(k) * mosaic->step;
}

// Sets the scale of an RT dose, and the positions of its frames: PS3.3, C.8.8.3.2.
void place_dose(DicomFile& file, const DicomDataSet& data_set) {
    if (data_set.text(tag::kSopClassUid) != "1.2.840.10008.5.1.4.1.1.481.2") return;
    const auto position = data_set.decimals(tag::kImagePosition, 3);
    const auto offsets = data_set.decimals(tag::kGridFrameOffsets, file.frames.size());
    for (DicomFrame& frame : file.frames) {
        frame.slope = data_set.decimal(tag::kDoseGridScaling).value_or(NAN);
        frame.intercept = 0;
    }
    const DicomFrame& first = file.frames[0];
    if (!position || !offsets || !first.along_row || !first.along_column) return;
    const Vec3d normal = cross(*first.along_row, *first.along_column);
    // The offsets begin with 0, or they are coordinates of axial frames.
    const bool absolute = (*offsets)[0] != 0;
    if (absolute && ((*offsets)[0] != (*position)[2] || std::abs(normal[2]) < 1 - 1e-6)) {
        file.refusal = "is an RT dose whose GridFrameOffsetVector begins neither with 0 nor at its position";
        return;
    }
    const Vec3d origin{(*position)[0], (*position)[1], (*position)[2]};
    for (std::size_t k = 0; k < file.frames.size(); ++k) {
        const double offset = (*offsets)[k] - (*offsets)[0];
        file.frames[k].position = origin + offset * (absolute ? Vec3d{0, 0, 1} : normal);
    }
}

std::string readable(const DicomDataSet& data_set, DicomTag tag) {
    return readable_text(data_set, tag, data_set);
}

const char* const kDeflatedSyntax = "1.2.840.10008.1.2.1.99";

bool is_plain_syntax(const std::string& uid) {
    return uid.empty() || uid == "1.2.840.10008.1.2" || uid == "1.2.840.10008.1.2.1" ||
           uid == "1.2.840.10008.1.2.2" || uid == kDeflatedSyntax;
}

// The names of common transfer syntaxes that are not supported, by the starts of their UIDs.
std::string syntax_name(const std::string& uid) {
    static constexpr std::pair<std::string_view, const char*> names[] = {
        {"1.2.840.10008.1.2.4.92", "JPEG 2000 of several components"},
        {"1.2.840.10008.1.2.4.93", "JPEG 2000 of several components"},
        {"1.2.840.10008.1.2.4.94", "JPIP"},
        {"1.2.840.10008.1.2.4.95", "JPIP"},
        {"1.2.840.10008.1.2.4.100", "MPEG-2 video"},
        {"1.2.840.10008.1.2.4.101", "MPEG-2 video"},
        {"1.2.840.10008.1.2.4.107", "HEVC video"},
        {"1.2.840.10008.1.2.4.108", "HEVC video"},
        {"1.2.840.10008.1.2.4.10", "MPEG-4 video"},
        {"1.2.840.10008.1.2.4.20", "high-throughput JPEG 2000"}};
    for (const auto& [start, name] : names) {
        if (uid.starts_with(start)) return fmt::format("{} ({})", name, uid);
    }
    return quoted(uid);
}

// The most bytes of pixels that a byte of the file can become; 0 if the syntax is not supported.
double inflation_of(const std::string& transfer_syntax) {
    if (transfer_syntax == kDeflatedSyntax) return 1032;
    return is_plain_syntax(transfer_syntax) ? 1 : most_inflation(transfer_syntax);
}

// Why the file cannot hold this number of frames, if so.
std::optional<std::string> overclaim(const DicomFile& file, double frames) {
    const double claimed =
        static_cast<double>(file.columns * file.rows) * frames * static_cast<double>(file.bits_allocated) / 8;
    if (claimed <= inflation_of(file.transfer_syntax) * static_cast<double>(file.size)) return {};
    return fmt::format("is too small for the {:.0f} bytes of pixels that it claims; it is truncated",
                       claimed);
}

// Why the pixels of a file cannot be read, if so.
std::optional<std::string> refusal(const DicomFile& file, const DicomDataSet& data_set) {
    const std::string photometric = data_set.text(tag::kPhotometricInterpretation);
    const bool palette = file.segmentation && photometric == "PALETTE COLOR";  // the labels' colours
    if (data_set.unsigned_short(tag::kSamplesPerPixel).value_or(1) != 1 ||
        (!photometric.empty() && photometric != "MONOCHROME1" && photometric != "MONOCHROME2" && !palette)) {
        return fmt::format("is in colour ({}); only grey scans are supported", quoted(photometric));
    }
    if (data_set.has(tag::kModalityLookupTable)) return "has a modality lookup table, which is not supported";
    const bool packed =
        file.segmentation && file.bits_allocated == 1 && is_plain_syntax(file.transfer_syntax);
    if (file.bits_allocated != 8 && file.bits_allocated != 16 && file.bits_allocated != 32 && !packed) {
        return fmt::format("has {} bits per sample; 8, 16 or 32 are supported", file.bits_allocated);
    }
    if (file.bits_stored < 1 || file.bits_stored > file.bits_allocated ||
        file.high_bit < file.bits_stored - 1 || file.high_bit >= file.bits_allocated) {
        return "has an inconsistent pixel format (BitsAllocated, BitsStored, HighBit)";
    }
    if (inflation_of(file.transfer_syntax) == 0) {
        return fmt::format("has pixels in the transfer syntax {}, which is not supported",
                           syntax_name(file.transfer_syntax));
    }
    return overclaim(file, 1);
}

// Whether the pixels are floating-point, as in parametric maps.
bool has_float_pixels(const DicomDataSet& data_set) {
    return data_set.has(tag::kFloatPixelData) || data_set.has(tag::kDoublePixelData);
}

// Whether the SOP class is an image. A data set that is cut off before its SOP class may be one.
bool should_have_pixels(const DicomDataSet& data_set) {
    static constexpr std::string_view
        images[] = {"1.2.840.10008.5.1.4.1.1.2",    "1.2.840.10008.5.1.4.1.1.2.1",
                    "1.2.840.10008.5.1.4.1.1.2.2",  "1.2.840.10008.5.1.4.1.1.4",
                    "1.2.840.10008.5.1.4.1.1.4.1",  "1.2.840.10008.5.1.4.1.1.4.4",
                    "1.2.840.10008.5.1.4.1.1.128",  "1.2.840.10008.5.1.4.1.1.130",
                    "1.2.840.10008.5.1.4.1.1.20",   "1.2.840.10008.5.1.4.1.1.7",
                    "1.2.840.10008.5.1.4.1.1.481.2"};  // CT, MR, PET, NM, secondary capture, RT dose
    if (data_set.has(tag::kDirectoryRecords) || has_float_pixels(data_set)) return false;
    const std::string uid = data_set.text(tag::kSopClassUid);
    return uid.empty() || std::find(std::begin(images), std::end(images), uid) != std::end(images);
}

}  // namespace

std::optional<DicomFile> read_dicom_header(const std::filesystem::path& path) {
    const ParsedDicom parsed = parse_dicom_header(path);
    const DicomDataSet& data_set = parsed.data_set;
    DicomFile file;
    file.path = path;
    file.size = parsed.file_size;
    file.columns = data_set.unsigned_short(tag::kColumns).value_or(0);
    file.rows = data_set.unsigned_short(tag::kRows).value_or(0);
    if (file.columns == 0 || file.rows == 0 || parsed.pixels_at == 0) {
        if (should_have_pixels(data_set))
            fail<InputError>(path, "the DICOM file has no pixels; it is truncated");
        return {};
    }
    file.series_uid = readable(data_set, tag::kSeriesInstanceUid);
    file.frame_of_reference = data_set.text(tag::kFrameOfReferenceUid);
    file.description = readable(data_set, tag::kSeriesDescription);
    file.modality = readable(data_set, tag::kModality);
    file.patient_name = readable(data_set, tag::kPatientName);
    if (const auto instance = parse_integer(data_set.text(tag::kInstanceNumber));
        instance && std::abs(*instance) < 1000000000)
        file.instance = static_cast<int>(*instance);
    file.transfer_syntax = parsed.transfer_syntax;
    file.image_type = readable(data_set, tag::kImageType);
    file.localizer = file.image_type.find("LOCALIZER") != std::string::npos;
    file.kernel = readable(data_set, tag::kConvolutionKernel);
    file.date = readable(data_set, tag::kSeriesDate);
    file.series_number = parse_integer(data_set.text(tag::kSeriesNumber));
    file.echo_time = data_set.decimal(tag::kEchoTime);
    file.bits_allocated = data_set.unsigned_short(tag::kBitsAllocated).value_or(0);
    file.bits_stored = data_set.unsigned_short(tag::kBitsStored).value_or(file.bits_allocated);
    file.high_bit = data_set.unsigned_short(tag::kHighBit).value_or(file.bits_stored - 1);
    file.is_signed = data_set.unsigned_short(tag::kPixelRepresentation).value_or(0) == 1;
    file.padding = data_set.unsigned_short(tag::kPixelPaddingValue);
    if (file.padding && file.is_signed) file.padding = static_cast<std::int16_t>(*file.padding);

    try {
        file.segmentation = read_segmentation(data_set);
        file.refusal = refusal(file, data_set);
        const double frames = data_set.decimal(tag::kNumberOfFrames).value_or(1);
        // Allocate no memory for frames that cannot exist.
        if (!(frames >= 1) || frames > static_cast<double>(file.size))
            throw InputError(fmt::format("claims {} frames", frames));
        if (const auto why = overclaim(file, frames); why && !file.refusal) throw InputError(*why);
        file.frames.resize(static_cast<std::size_t>(frames));
        read_frames(file, data_set);
        divide_mosaic(file, data_set);
        place_dose(file, data_set);
    } catch (const InputError& error) {
        fail<InputError>(path, "{}", error.what());
    }
    return file;
}

std::string reason_without_image(const std::filesystem::path& path) {
    static constexpr std::pair<std::string_view, const char*> names[] = {
        {"1.2.840.10008.5.1.4.1.1.481.3", "an RT structure set, which holds contours"},
        {"1.2.840.10008.5.1.4.1.1.481.5", "an RT plan"},
        {"1.2.840.10008.5.1.4.1.1.88", "a structured report"},
        {"1.2.840.10008.5.1.4.1.1.66", "a registration or other spatial data"},
        {"1.2.840.10008.5.1.4.1.1.104", "an encapsulated document"},
        {"1.2.840.10008.5.1.4.1.1.11", "a presentation state"}};
    const ParsedDicom parsed = parse_dicom_header(path);
    if (has_float_pixels(parsed.data_set)) return "has floating-point pixels, which are not supported";
    const std::string uid = parsed.data_set.text(tag::kSopClassUid);
    std::string what = "DICOM without an image";
    for (const auto& [start, name] : names) {
        if (uid == start || uid.starts_with(std::string(start) + ".")) what = name;
    }
    return fmt::format("is {}; a scan has images", what);
}

namespace {

// Extracts the stored bits of each cell and extends their sign. The other bits of a cell may be set.
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
    if (beyond) throw InputError("has samples beyond 2^31, which are not supported");
}

void unpack_cells(const char* cells, std::size_t count, int cell_size, int bits, int high_bit, bool is_signed,
                  std::int32_t* out) {
    const auto as = [&](auto cell) { unpack<decltype(cell)>(cells, count, bits, high_bit, is_signed, out); };
    cell_size == 1 ? as(std::uint8_t{}) : cell_size == 2 ? as(std::uint16_t{}) : as(std::uint32_t{});
}

void decode_plain(const DicomFile& file, ParsedDicom& parsed, Buffer<std::int32_t>& out) {
    const std::size_t cell_size = static_cast<std::size_t>(file.bits_allocated) / 8;
    const std::size_t needed = file.bits_allocated == 1 ? (out.size() + 7) / 8 : out.size() * cell_size;
    const std::size_t held = std::min(parsed.bytes.size() - parsed.pixels_at, parsed.pixels_size.value_or(0));
    if (held < needed)
        throw InputError(fmt::format("has {} bytes of pixels instead of {}; it is truncated", held, needed));
    char* cells = parsed.bytes.data() + parsed.pixels_at;
    if (parsed.encoding.big_endian && parsed.pixels_are_words) {
        const std::size_t word = std::max<std::size_t>(cell_size, 2);
        for (std::size_t i = 0; i + word <= held; i += word) std::reverse(cells + i, cells + i + word);
    }
    if (file.bits_allocated == 1) {  // without padding between rows or frames
        for (std::size_t i = 0; i < out.size(); ++i) out[i] = cells[i / 8] >> i % 8 & 1;
        return;
    }
    unpack_cells(cells, out.size(), static_cast<int>(cell_size), file.bits_stored, file.high_bit,
                 file.is_signed, out.data());
}

// The number of frames that the file holds; a mosaic is one.
std::size_t stored_frames(const DicomFile& file) {
    return file.tiles > 1 ? 1 : file.frames.size();
}

void decode_compressed(const DicomFile& file, const ParsedDicom& parsed, Buffer<std::int32_t>& out,
                       const Step& step) {
    if (file.high_bit != file.bits_stored - 1)
        throw InputError("has compressed samples whose high bit is not the highest stored bit");
    const std::size_t frames = stored_frames(file), area = out.size() / frames;
    const std::vector<std::string> streams = compressed_frames(parsed, frames);
    for_each_part(frames, [&](std::size_t i) {
        const DecodedFrame frame =
            decode_frame(file.transfer_syntax, streams[i], file.tiles * file.columns, file.tiles * file.rows,
                         file.bits_allocated, file.bits_stored);
        // Some encoders state all bits of a cell, also those above the stored ones. Unsigned samples that
        // state another precision may have it. Lossy samples may exceed the stored bits by a little.
        const bool ends_at_stored =
            is_lossless(file.transfer_syntax) && (file.is_signed || frame.bits == file.bits_allocated);
        const int bits = ends_at_stored ? std::min(frame.bits, file.bits_stored) : frame.bits;
        unpack_cells(frame.cells.data(), area, frame.cell_size, bits, bits - 1, file.is_signed,
                     out.data() + i * area);
        step(1 / static_cast<double>(frames));
    });
}

// Takes the tiles of a mosaic apart.
Buffer<std::int32_t> tiles_of(const DicomFile& file, const Buffer<std::int32_t>& mosaic) {
    const auto columns = static_cast<std::size_t>(file.columns), rows = static_cast<std::size_t>(file.rows),
               tiles = static_cast<std::size_t>(file.tiles);
    Buffer<std::int32_t> out;
    out.resize(columns * rows * file.frames.size());
    for (std::size_t k = 0; k < file.frames.size(); ++k) {
        for (std::size_t row = 0; row < rows; ++row) {
            const std::int32_t* from =
                mosaic.data() + ((k / tiles * rows + row) * tiles + k % tiles) * columns;
            std::copy_n(from, columns, out.data() + (k * rows + row) * columns);
        }
    }
    return out;
}

}  // namespace

const std::int32_t* decode_dicom(const DicomFile& file, DicomWorkspace& workspace, const Step& step) {
    if (file.refusal) fail<InputError>(file.path, "{}", *file.refusal);
    ParsedDicom parsed = parse_dicom(file.path, std::move(workspace.bytes));
    try {
        const std::int64_t area = file.tiles * file.columns * file.tiles * file.rows;
        workspace.stored.resize(
            checked_size(static_cast<std::uint64_t>(area) * stored_frames(file), sizeof(std::int32_t)));
        if (parsed.pixels_size.has_value() == !is_plain_syntax(file.transfer_syntax))
            throw InputError("its pixel data do not have the form of its transfer syntax");
        if (parsed.pixels_size) {
            decode_plain(file, parsed, workspace.stored);
            step(1);
        } else {
            decode_compressed(file, parsed, workspace.stored, step);
        }
        if (file.tiles > 1) workspace.stored = tiles_of(file, workspace.stored);
    } catch (const InputError& error) {
        fail<InputError>(file.path, "{}", error.what());
    } catch (const std::bad_alloc&) {
        fail<LimitError>(file.path, "does not fit in memory");
    }
    workspace.bytes = std::move(parsed.bytes);
    return workspace.stored.data();
}

}  // namespace marrow::internal::io
