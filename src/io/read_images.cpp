#include "read_images.h"

#include <fmt/format.h>
#include <itkBMPImageIO.h>
#include <itkJPEGImageIO.h>
#include <itkPNGImageIO.h>
#include <itkTIFFImageIO.h>

#include <marrow/error.h>

#include "byte_stream.h"
#include "header_text.h"
#include "parallel_slices.h"

namespace marrow {

namespace {

using Picture = itk::ImageIOBase::Pointer;

// What ITK throws, as our error about `path`. \pre called in a catch block
[[noreturn]] void rethrow(const std::filesystem::path& path) {
    try {
        throw;
    } catch (const Error&) {
        throw;
    } catch (const itk::ExceptionObject&) {
        throw InputError(fmt::format(
            "{}: the picture cannot be decoded; it is damaged or of a kind that is not read", shown(path)));
    } catch (const std::bad_alloc&) {
        throw LimitError(fmt::format("{}: the picture does not fit in memory", shown(path)));
    }
}

std::string_view format_of(std::string_view head) {
    if (head.starts_with("\x89PNG\r\n\x1a\n")) return "PNG";
    if (is_tiff(head)) return "TIFF";
    if (head.starts_with("\xff\xd8\xff")) return "JPEG";
    if (head.starts_with("BM")) return "BMP";
    return "";
}

// A reader that knows the picture's header.
Picture open(const std::filesystem::path& path) {
    const std::string head = head_of(path, 16);
    const std::string_view format = format_of(head);
    Picture picture;
    if (format == "PNG")
        picture = itk::PNGImageIO::New();
    else if (format == "TIFF")
        picture = itk::TIFFImageIO::New();
    else if (format == "JPEG")
        picture = itk::JPEGImageIO::New();
    else if (format == "BMP")
        picture = itk::BMPImageIO::New();
    else
        throw InputError(fmt::format("{}: is not a PNG, TIFF, JPEG or BMP picture", shown(path)));
    try {
        picture->SetFileName(path.native());
        picture->ReadImageInformation();
    } catch (...) {
        rethrow(path);
    }
    if (picture->GetNumberOfComponents() != 1 || picture->GetPixelType() != itk::ImageIOBase::SCALAR) {
        throw InputError(
            fmt::format("{}: is in colour; only grey pictures are read, convert it first", shown(path)));
    }
    return picture;
}

SampleType type_of(const Picture& picture, const std::filesystem::path& path) {
    using IO = itk::ImageIOBase;
    switch (picture->GetComponentType()) {
        case IO::UCHAR:
            return SampleType::uint8;
        case IO::CHAR:
            return SampleType::int8;
        case IO::USHORT:
            return SampleType::uint16;
        case IO::SHORT:
            return SampleType::int16;
        case IO::INT:
            return SampleType::int32;
        case IO::FLOAT:
            return SampleType::float32;
        case IO::DOUBLE:
            return SampleType::float64;
        default:
            throw InputError(
                fmt::format("{}: samples of this type are not read; save it with 8 or 16 bits", shown(path)));
    }
}

std::array<std::int64_t, 3> dims_of(const Picture& picture) {
    std::array<std::int64_t, 3> dims{1, 1, 1};
    for (unsigned axis = 0; axis < std::min(picture->GetNumberOfDimensions(), 3u); ++axis) {
        dims[axis] = static_cast<std::int64_t>(picture->GetDimensions(axis));
    }
    return dims;
}

void decode(const Picture& picture, const std::filesystem::path& path, void* to) {
    itk::ImageIORegion all(picture->GetNumberOfDimensions());
    for (unsigned axis = 0; axis < picture->GetNumberOfDimensions(); ++axis) {
        all.SetIndex(axis, 0);
        all.SetSize(axis, picture->GetDimensions(axis));
    }
    try {
        picture->SetIORegion(all);
        picture->Read(to);
    } catch (...) {
        rethrow(path);
    }
}

}  // namespace

bool is_tiff(std::string_view head) {
    using namespace std::string_view_literals;
    return head.starts_with("II*\0"sv) || head.starts_with("MM\0*"sv) || head.starts_with("II+\0"sv) ||
           head.starts_with("MM\0+"sv);
}

bool is_picture(std::string_view head) {
    return !format_of(head).empty();
}

bool natural_less(const std::filesystem::path& left, const std::filesystem::path& right) {
    const std::string& a = left.native();
    const std::string& b = right.native();
    const auto digit = [](char c) { return c >= '0' && c <= '9'; };
    const auto number_at = [&](const std::string& s, std::size_t& at) {  // without leading zeros
        std::size_t end = at;
        while (end < s.size() && digit(s[end])) ++end;
        while (at + 1 < end && s[at] == '0') ++at;
        const std::string_view digits(s.data() + at, end - at);
        at = end;
        return digits;
    };
    std::size_t i = 0, j = 0;
    while (i < a.size() && j < b.size()) {
        if (digit(a[i]) && digit(b[j])) {
            const auto x = number_at(a, i), y = number_at(b, j);
            if (x.size() != y.size()) return x.size() < y.size();
            if (x != y) return x < y;
        } else {
            if (a[i] != b[j]) return a[i] < b[j];
            ++i, ++j;
        }
    }
    if (i < a.size() || j < b.size()) return i == a.size();
    return a < b;  // "01" and "1"
}

PictureStack read_picture_headers(std::vector<std::filesystem::path> files, const ScanOptions& options) {
    itk::Object::GlobalWarningDisplayOff();  // warnings would go to stderr
    PictureStack stack{std::move(files), {}, {}};
    const Picture first = open(stack.files.front());
    stack.type = type_of(first, stack.files.front());
    stack.geometry.dims = dims_of(first);
    if (stack.files.size() > 1) {
        if (stack.geometry.dims[2] != 1)
            throw InputError(
                fmt::format("{}: has several pages; name this file alone", shown(stack.files.front())));
        stack.geometry.dims[2] = static_cast<std::int64_t>(stack.files.size());
    }
    if (options.spacing) stack.geometry.spacing = *options.spacing;
    check_geometry(stack.geometry);
    return stack;
}

Volume load_pictures(const PictureStack& stack, const ScanOptions& options) {
    Volume volume(stack.geometry, stack.type);
    const std::size_t slice_bytes = volume.bytes() / stack.files.size();
    for_each_slice(stack.files.size(), options.threads, options.progress, 0, 1, [&](std::size_t i) {
        const auto& path = stack.files[i];
        const Picture picture = open(path);
        auto expected = stack.geometry.dims;
        if (stack.files.size() > 1) expected[2] = 1;
        if (dims_of(picture) != expected || type_of(picture, path) != stack.type) {
            throw InputError(
                fmt::format("{}: differs in size or sample type from {}; the slices of a volume are alike",
                            shown(path), shown(stack.files.front())));
        }
        decode(picture, path, static_cast<std::byte*>(volume.data()) + i * slice_bytes);
    });
    return volume;
}

}  // namespace marrow
