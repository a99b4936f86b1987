#include "read_dicom_file.h"

#include <fmt/format.h>
#include <gdcmPixmapReader.h>
#include <gdcmReader.h>
#include <gdcmSequenceOfItems.h>
#include <gdcmTrace.h>

#include <algorithm>
#include <cstring>
#include <set>

#include <marrow/error.h>

#include "byte_stream.h"
#include "header_text.h"

namespace marrow {

namespace {

using gdcm::DataSet;
using gdcm::Tag;

const Tag pixel_data(0x7fe0, 0x0010);

// GDCM writes its warnings to stderr; what matters becomes an exception here.
void silence_gdcm() {
    static const bool once = [] {
        gdcm::Trace::DebugOff();
        gdcm::Trace::WarningOff();
        gdcm::Trace::ErrorOff();
        return true;
    }();
    static_cast<void>(once);
}

// The bytes of an element; nothing where it is absent or empty.
std::string_view bytes(const DataSet& set, const Tag& tag) {
    if (!set.FindDataElement(tag)) return {};
    const gdcm::ByteValue* value = set.GetDataElement(tag).GetByteValue();
    return value ? std::string_view(value->GetPointer(), value->GetLength()) : std::string_view();
}

std::string text(const DataSet& set, const Tag& tag) {
    std::string_view value = bytes(set, tag);
    while (!value.empty() && value.back() == '\0') value.remove_suffix(1);
    return std::string(trimmed(value));
}

std::optional<int> unsigned_short(const DataSet& set, const Tag& tag) {
    const std::string_view value = bytes(set, tag);
    std::uint16_t number = 0;
    if (value.size() < sizeof number) return {};
    std::memcpy(&number, value.data(), sizeof number);
    return number;
}

// The numbers of a decimal string "1\2\3"; nothing where there are not exactly `count`.
std::optional<std::vector<double>> decimals(const DataSet& set, const Tag& tag, std::size_t count) {
    const std::string value = text(set, tag);
    std::vector<double> out;
    for (std::size_t at = 0; !value.empty() && at <= value.size();) {
        const std::size_t end = std::min(value.find('\\', at), value.size());
        const auto one = number(std::string_view(value).substr(at, end - at));
        if (!one) return {};
        out.push_back(*one);
        at = end + 1;
    }
    if (out.size() != count) return {};
    return out;
}

std::optional<double> decimal(const DataSet& set, const Tag& tag) {
    const auto one = decimals(set, tag, 1);
    return one ? std::optional((*one)[0]) : std::nullopt;
}

gdcm::SmartPointer<gdcm::SequenceOfItems> sequence(const DataSet& set, const Tag& tag) {
    return set.FindDataElement(tag) ? set.GetDataElement(tag).GetValueAsSQ() : nullptr;
}

// Item `i` of a sequence; nothing where it is absent.
const DataSet* item(const DataSet* set, const Tag& tag, std::size_t i = 1) {
    if (!set) return nullptr;
    const auto items = sequence(*set, tag);
    return items && items->GetNumberOfItems() >= i ? &items->GetItem(i).GetNestedDataSet() : nullptr;
}

// Takes what the sets say about a frame: the file itself, or the frame's functional groups.
void read_frame(DicomFrame& frame, const DataSet& position, const DataSet& orientation,
                const DataSet& measures, const DataSet& rescale) {
    if (const auto p = decimals(position, Tag(0x0020, 0x0032), 3))
        frame.position = Vec3d{(*p)[0], (*p)[1], (*p)[2]};
    if (const auto o = decimals(orientation, Tag(0x0020, 0x0037), 6)) {
        frame.along_row = Vec3d{(*o)[0], (*o)[1], (*o)[2]};
        frame.along_column = Vec3d{(*o)[3], (*o)[4], (*o)[5]};
    }
    // PixelSpacing is row spacing \ column spacing: the step down comes first
    if (const auto s = decimals(measures, Tag(0x0028, 0x0030), 2)) frame.spacing = {(*s)[1], (*s)[0]};
    frame.thickness = decimal(measures, Tag(0x0018, 0x0050));
    frame.intercept = decimal(rescale, Tag(0x0028, 0x1052));
    frame.slope = decimal(rescale, Tag(0x0028, 0x1053));
}

// A series' description for a message: no control characters; letters beyond ASCII only where they are UTF-8.
std::string description(const DataSet& set) {
    const bool utf8 = text(set, Tag(0x0008, 0x0005)) == "ISO_IR 192";
    std::string out = text(set, Tag(0x0008, 0x103e));
    for (char& c : out) {
        const auto byte = static_cast<unsigned char>(c);
        if (byte < 0x20 || byte == 0x7f || (byte > 0x7f && !utf8)) c = '?';
    }
    return out;
}

// Why the pixels of a file cannot be read; empty where they can.
std::string refusal(const DicomFile& file, const DataSet& set, const gdcm::TransferSyntax& syntax,
                    std::size_t frames) {
    if (unsigned_short(set, Tag(0x0028, 0x0002)).value_or(1) != 1)
        return "is in colour; only grey scans are read";
    const std::string photometric = text(set, Tag(0x0028, 0x0004));
    if (!photometric.empty() && photometric != "MONOCHROME1" && photometric != "MONOCHROME2") {
        return fmt::format("is in colour ({}); only grey scans are read", photometric);
    }
    if (set.FindDataElement(Tag(0x0028, 0x3000))) return "has a modality lookup table, which is not read";
    if (file.bits_allocated != 8 && file.bits_allocated != 16 && file.bits_allocated != 32) {
        return fmt::format("has {} bits per sample; 8, 16 or 32 are read", file.bits_allocated);
    }
    if (file.bits_stored < 1 || file.bits_stored > file.bits_allocated ||
        file.high_bit < file.bits_stored - 1 || file.high_bit >= file.bits_allocated) {
        return "has a pixel format that contradicts itself (BitsAllocated, BitsStored, HighBit)";
    }
    using Syntax = gdcm::TransferSyntax;
    for (const auto video :
         {Syntax::MPEG2MainProfile, Syntax::MPEG2MainProfileHighLevel,
          Syntax::MPEG4AVCH264HighProfileLevel4_1, Syntax::MPEG4AVCH264BDcompatibleHighProfileLevel4_1}) {
        if (syntax == video)
            return fmt::format("is a video (transfer syntax {}), which is not read", syntax.GetString());
    }
    if (frames > 1 && !set.FindDataElement(Tag(0x5200, 0x9230))) {
        return fmt::format("holds {} frames without a position for each", frames);
    }
    return {};
}

}  // namespace

bool is_dicom(std::string_view head) {
    if (head.size() >= 132 && head.substr(128, 4) == "DICM") return true;
    // Without a preamble a data set begins with group 0002 or 0008, in either byte order, and a small element
    // number.
    using namespace std::string_view_literals;
    if (head.size() < 8) return false;
    const std::string_view group = head.substr(0, 2);
    const bool little = (group == "\x08\0"sv || group == "\x02\0"sv) && head[3] == '\0';
    const bool big = (group == "\0\x08"sv || group == "\0\x02"sv) && head[2] == '\0';
    return little || big;
}

std::optional<DicomFile> read_dicom_header(const std::filesystem::path& path) {
    silence_gdcm();
    size_of_file(path);
    gdcm::Reader reader;
    reader.SetFileName(path.c_str());
    bool parsed = false;
    try {
        // the pixels are left out
        parsed = reader.ReadUpToTag(pixel_data, {pixel_data});
    } catch (const std::exception&) {
    }
    if (!parsed) throw InputError(fmt::format("{}: is not a DICOM file, or a damaged one", shown(path)));

    const DataSet& set = reader.GetFile().GetDataSet();
    const gdcm::TransferSyntax syntax = reader.GetFile().GetHeader().GetDataSetTransferSyntax();
    DicomFile file;
    file.path = path;
    file.columns = unsigned_short(set, Tag(0x0028, 0x0011)).value_or(0);
    file.rows = unsigned_short(set, Tag(0x0028, 0x0010)).value_or(0);
    if (file.columns == 0 || file.rows == 0) return {};
    file.series_uid = text(set, Tag(0x0020, 0x000e));
    file.frame_of_reference = text(set, Tag(0x0020, 0x0052));
    file.description = description(set);
    file.modality = text(set, Tag(0x0008, 0x0060));
    file.echo = text(set, Tag(0x0018, 0x0086));
    file.rescale_type = text(set, Tag(0x0028, 0x1054));
    file.transfer_syntax = syntax.GetString() ? syntax.GetString() : "unknown";
    file.localizer = text(set, Tag(0x0008, 0x0008)).find("LOCALIZER") != std::string::npos;
    file.bits_allocated = unsigned_short(set, Tag(0x0028, 0x0100)).value_or(0);
    file.bits_stored = unsigned_short(set, Tag(0x0028, 0x0101)).value_or(file.bits_allocated);
    file.high_bit = unsigned_short(set, Tag(0x0028, 0x0102)).value_or(file.bits_stored - 1);
    file.is_signed = unsigned_short(set, Tag(0x0028, 0x0103)).value_or(0) == 1;

    const double claimed = decimal(set, Tag(0x0028, 0x0008)).value_or(1);
    if (!(claimed >= 1) || claimed > 1e6)
        throw InputError(fmt::format("{}: claims {} frames", shown(path), claimed));
    file.frames.resize(static_cast<std::size_t>(claimed));
    file.refusal = refusal(file, set, syntax, file.frames.size());

    const auto per_frame = sequence(set, Tag(0x5200, 0x9230));
    const DataSet* shared = item(&set, Tag(0x5200, 0x9229));
    if (per_frame && per_frame->GetNumberOfItems() != file.frames.size()) {
        throw InputError(fmt::format("{}: describes {} of its {} frames", shown(path),
                                     per_frame->GetNumberOfItems(), file.frames.size()));
    }
    for (std::size_t i = 0; i < file.frames.size(); ++i) {
        const DataSet* own = per_frame ? &per_frame->GetItem(i + 1).GetNestedDataSet() : nullptr;
        const auto group = [&](const Tag& tag) -> const DataSet& {
            if (const DataSet* found = item(own, tag)) return *found;
            if (const DataSet* found = item(shared, tag)) return *found;
            return set;
        };
        read_frame(file.frames[i], group(Tag(0x0020, 0x9113)), group(Tag(0x0020, 0x9116)),
                   group(Tag(0x0028, 0x9110)), group(Tag(0x0028, 0x9145)));
    }
    return file;
}

namespace {

// Takes the stored bits out of each cell of type T, and extends the sign: the other bits can hold anything.
template <class T>
void unpack(const char* cells, std::size_t count, int bits, int high_bit, bool is_signed,
            std::vector<std::int32_t>& out, const std::filesystem::path& path) {
    const int drop = high_bit + 1 - bits;
    const std::uint32_t mask = bits == 32 ? ~0u : (1u << bits) - 1;
    const std::uint32_t sign = 1u << (bits - 1);
    out.resize(count);
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
    if (beyond) throw InputError(fmt::format("{}: has samples beyond 2^31, which are not read", shown(path)));
}

}  // namespace

std::vector<std::int32_t> decode_dicom(const DicomFile& file) {
    silence_gdcm();
    const auto damaged = [&](std::string_view why) {
        return InputError(fmt::format("{}: its pixels cannot be decoded: {}", shown(file.path), why));
    };
    if (!file.refusal.empty()) throw InputError(fmt::format("{}: {}", shown(file.path), file.refusal));

    const std::size_t count = static_cast<std::size_t>(file.columns * file.rows) * file.frames.size();
    const std::size_t size = static_cast<std::size_t>(file.bits_allocated) / 8;
    std::string decoded;  // of a compressed file
    std::string_view cells;
    int bits = file.bits_stored, high_bit = file.high_bit;
    bool is_signed = file.is_signed;

    gdcm::Reader plain;
    gdcm::PixmapReader compressed;
    const gdcm::TransferSyntax syntax(gdcm::TransferSyntax::GetTSType(file.transfer_syntax.c_str()));
    try {
        if (!syntax.IsEncapsulated()) {
            plain.SetFileName(file.path.c_str());
            if (!plain.Read()) throw damaged("the file is truncated or damaged");
            cells = bytes(plain.GetFile().GetDataSet(), pixel_data);
        } else {
            compressed.SetFileName(file.path.c_str());
            if (!compressed.Read()) throw damaged(fmt::format("transfer syntax {}", file.transfer_syntax));
            const gdcm::Pixmap& pixmap = compressed.GetPixmap();
            decoded.resize(pixmap.GetBufferLength());
            if (!pixmap.GetBuffer(decoded.data()))
                throw damaged(fmt::format("transfer syntax {}", file.transfer_syntax));
            // What was compressed may differ from what the header says: believe the codec.
            const gdcm::PixelFormat& format = pixmap.GetPixelFormat();
            if (format.GetBitsAllocated() != file.bits_allocated || format.GetSamplesPerPixel() != 1) {
                throw damaged("they are not what the header describes");
            }
            bits = format.GetBitsStored();
            high_bit = format.GetHighBit();
            is_signed = format.GetPixelRepresentation() == 1;
            cells = decoded;
        }
    } catch (const Error&) {
        throw;
    } catch (const std::bad_alloc&) {
        throw LimitError(fmt::format("{}: does not fit in memory", shown(file.path)));
    } catch (const std::exception& error) {
        throw damaged(error.what());
    }
    if (cells.size() < count * size) {
        throw damaged(fmt::format("{} bytes are there, {} are needed; the file is truncated", cells.size(),
                                  count * size));
    }
    std::vector<std::int32_t> out;
    if (size == 1)
        unpack<std::uint8_t>(cells.data(), count, bits, high_bit, is_signed, out, file.path);
    else if (size == 2)
        unpack<std::uint16_t>(cells.data(), count, bits, high_bit, is_signed, out, file.path);
    else
        unpack<std::uint32_t>(cells.data(), count, bits, high_bit, is_signed, out, file.path);
    return out;
}

}  // namespace marrow
