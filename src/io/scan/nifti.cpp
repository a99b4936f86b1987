// Reads NIfTI-1 and NIfTI-2 headers: single files (.nii) and pairs (.hdr, .img), also gzipped. See
// https://nifti.nimh.nih.gov.
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include <marrow/error.h>

#include "io/bytes/byte_stream.h"
#include "io/bytes/text.h"
#include "raw_image.h"

namespace marrow::internal::io {

namespace {

// The fields that are used, for both versions.
struct Header {
    std::filesystem::path path;
    bool big_endian = false;
    bool pair = false;      // the samples are in an .img file
    std::int64_t size = 0;  // with the four bytes for extensions; the samples of a single file come after it
    std::array<std::int64_t, 8> dim{};
    std::array<double, 8> pixdim{};
    std::int64_t datatype = 0;
    double vox_offset = 0, slope = 0, intercept = 0;
    std::int64_t qform_code = 0, sform_code = 0, units = 0;
    Vec3d quaternion{}, qoffset{};
    std::array<std::array<double, 4>, 3> srow{};

    [[noreturn]] void refuse(std::string_view why) const { fail<InputError>(path, "NIfTI header: {}", why); }
};

// Extracts numbers from the header's bytes, in their byte order.
struct Bytes {
    const std::string& bytes;
    bool swap;

    template <class T>
    T get(std::size_t offset) const {
        std::array<char, sizeof(T)> raw;
        std::memcpy(raw.data(), bytes.data() + offset, sizeof(T));
        if (swap) std::reverse(raw.begin(), raw.end());
        return std::bit_cast<T>(raw);
    }
};

bool is_gzip(const std::filesystem::path& path) {
    return read_head(path, 2) == "\x1f\x8b";
}

// Where the fields are.
struct Layout {
    std::size_t dim, pixdim, datatype, vox_offset, slope, intercept, units, qform_code, sform_code,
        quaternion, qoffset, srow;
};
constexpr Layout kVersion1{40, 76, 70, 108, 112, 116, 123, 252, 254, 256, 268, 280};
constexpr Layout kVersion2{16, 104, 12, 168, 176, 184, 500, 344, 348, 352, 376, 400};

// Reads the fields, whose types are those of a version.
template <class Size, class Real, class Offset, class Code, class Unit>
void read_fields(const Bytes& in, const Layout& at, Header& header) {
    for (std::size_t i = 0; i < 8; ++i) {
        header.dim[i] = in.get<Size>(at.dim + i * sizeof(Size));
        header.pixdim[i] = in.get<Real>(at.pixdim + i * sizeof(Real));
    }
    header.datatype = in.get<std::int16_t>(at.datatype);
    header.vox_offset = static_cast<double>(in.get<Offset>(at.vox_offset));
    header.slope = in.get<Real>(at.slope);
    header.intercept = in.get<Real>(at.intercept);
    header.units = in.get<Unit>(at.units);
    header.qform_code = in.get<Code>(at.qform_code);
    header.sform_code = in.get<Code>(at.sform_code);
    for (std::size_t i = 0; i < 3; ++i) {
        header.quaternion[i] = in.get<Real>(at.quaternion + i * sizeof(Real));
        header.qoffset[i] = in.get<Real>(at.qoffset + i * sizeof(Real));
        for (std::size_t j = 0; j < 4; ++j)
            header.srow[i][j] = in.get<Real>(at.srow + (4 * i + j) * sizeof(Real));
    }
}

Header parse(const std::filesystem::path& path) {
    constexpr std::size_t size1 = 348, size2 = 540;
    const auto compression = is_gzip(path) ? Compression::zlib : Compression::none;
    std::string bytes(size2, '\0');
    bytes.resize(ByteStream(path, compression).read_some(bytes.data(), bytes.size()));

    Header header{path};
    const auto is_not_nifti = [&](const char* why) {
        return InputError(fmt::format("{}: is not a NIfTI file: {}", quoted(path), why));
    };
    if (bytes.size() < size1) throw is_not_nifti("it is too short for a header");
    const auto little = Bytes{bytes, std::endian::native != std::endian::little}.get<std::int32_t>(0);
    const auto big = Bytes{bytes, std::endian::native != std::endian::big}.get<std::int32_t>(0);
    header.big_endian = big == size1 || big == size2;
    const bool second = little == size2 || big == size2;
    if (!header.big_endian && !second && little != size1)
        throw is_not_nifti("it does not begin with the size of a header");
    if (second && bytes.size() < size2) throw is_not_nifti("it is too short for a header");
    const std::string magic = bytes.substr(second ? 4 : 344, 4);
    if (magic != "n+1" + std::string(1, '\0') && magic != "n+2" + std::string(1, '\0') &&
        magic != "ni1" + std::string(1, '\0') && magic != "ni2" + std::string(1, '\0')) {
        throw is_not_nifti(
            "its magic number is missing (an Analyze 7.5 file does not state the orientation; convert it to "
            "NIfTI)");
    }
    header.pair = magic[1] == 'i';

    const Bytes in{bytes, header.big_endian != (std::endian::native == std::endian::big)};
    header.size = second ? 544 : 352;
    if (second)
        read_fields<std::int64_t, double, std::int64_t, std::int32_t, std::int32_t>(in, kVersion2, header);
    else
        read_fields<std::int16_t, float, float, std::int16_t, std::uint8_t>(in, kVersion1, header);
    return header;
}

StoredType stored_type(const Header& header) {
    static constexpr std::pair<std::int64_t, StoredType> kTypes[] = {
        {2, StoredType::uint8},    {4, StoredType::int16},    {8, StoredType::int32},
        {16, StoredType::float32}, {64, StoredType::float64}, {256, StoredType::int8},
        {512, StoredType::uint16}, {768, StoredType::uint32}, {1024, StoredType::int64},
        {1280, StoredType::uint64}};
    const std::int64_t code = header.datatype;
    for (const auto& [known, type] : kTypes) {
        if (known == code) return type;
    }
    if (code == 32 || code == 1792 || code == 2048) header.refuse("complex samples are not supported");
    if (code == 128 || code == 2304) header.refuse("colour samples are not supported");
    header.refuse(fmt::format("samples of type {} are not supported", code));
}

// The rotation by the quaternion: "method 2" in nifti1.h.
Mat3d rotation(const Header& header) {
    const double b = header.quaternion[0], c = header.quaternion[1], d = header.quaternion[2];
    const double rest = 1 - (b * b + c * c + d * d);
    if (!(rest > -1e-5)) header.refuse("the quaternion of the qform is longer than 1");
    const double a = std::sqrt(std::max(rest, 0.0));
    return {{{a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)},
             {2 * (b * c + a * d), a * a + c * c - b * b - d * d, 2 * (c * d - a * b)},
             {2 * (b * d - a * c), 2 * (c * d + a * b), a * a + d * d - c * c - b * b}}};
}

// Index to RAS: sform if its code is > 0, else qform, else the spacing alone.
void read_geometry(const Header& header, RawImage& image) {
    Mat3d m{};
    Vec3d origin{};
    if (header.sform_code > 0) {
        for (int row = 0; row < 3; ++row) {
            for (int axis = 0; axis < 3; ++axis) m[row][axis] = header.srow[row][axis];
            origin[row] = header.srow[row][3];
        }
    } else {
        for (int axis = 1; axis <= 3; ++axis) {
            if (!(header.pixdim[axis] > 0))
                header.refuse(
                    fmt::format("pixdim[{}] is {}, which is not a spacing", axis, header.pixdim[axis]));
        }
        if (header.qform_code > 0) {
            m = rotation(header);
            origin = header.qoffset;
        } else {
            m = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
            image.oriented = false;
            image.warnings.push_back(
                "the NIfTI header has neither sform nor qform; position and orientation are unknown");
        }
        const double mirrored = header.qform_code > 0 && header.pixdim[0] < 0 ? -1 : 1;  // qfac
        for (int row = 0; row < 3; ++row) {
            for (int axis = 0; axis < 3; ++axis)
                m[row][axis] *= header.pixdim[axis + 1] * (axis == 2 ? mirrored : 1);
        }
    }
    constexpr int length_bits = 7;
    const std::int64_t unit = header.units & length_bits;
    const double mm = unit == 1 ? 1e3 : unit == 3 ? 1e-3 : 1;
    const Vec3d to_lps{-mm, -mm, mm};
    for (int row = 0; row < 3; ++row) {
        for (int axis = 0; axis < 3; ++axis) m[row][axis] *= to_lps[row];
        image.geometry.origin[row] = origin[row] * to_lps[row];
    }
    set_columns(image.geometry, m);
}

// The other file of a pair: the same name with another extension, perhaps in capitals or gzipped.
std::filesystem::path partner(const std::filesystem::path& path, const char* wanted) {
    std::filesystem::path stem = path;
    if (to_lower(stem.extension().native()) == ".gz") stem.replace_extension();
    std::string upper = wanted;
    for (char& c : upper) c = static_cast<char>(std::toupper(c));
    for (const std::string& end : {std::string(wanted), wanted + std::string(".gz"), upper, upper + ".GZ"}) {
        std::filesystem::path other = stem;
        other.replace_extension(end);
        if (std::filesystem::exists(other)) return other;
    }
    fail<IoError>(path, "the {} file that belongs to it is missing; put both into one folder", wanted);
}

}  // namespace

RawImage read_nifti_header(const std::filesystem::path& given, std::optional<std::int64_t> volume) {
    regular_file_size(given);
    const bool is_img = extension(given) == ".img" || extension(given) == ".img.gz";
    const Header header = parse(is_img ? partner(given, ".hdr") : given);
    RawImage image;
    image.type = stored_type(header);
    image.big_endian = header.big_endian;

    if (header.dim[0] < 1 || header.dim[0] > 7)
        header.refuse(fmt::format("dim[0] is {}, not a number from 1 to 7", header.dim[0]));
    double volumes = 1;
    for (std::int64_t axis = 1; axis <= header.dim[0]; ++axis) {
        const std::int64_t size = header.dim[static_cast<std::size_t>(axis)];
        if (size <= 0) header.refuse(fmt::format("dim[{}] is {}, which is not a size", axis, size));
        if (axis > 3) volumes *= static_cast<double>(size);
    }
    if (header.dim[0] < 3) header.refuse("it is not three-dimensional");
    for (std::size_t axis = 0; axis < 3; ++axis) image.geometry.dims[axis] = header.dim[axis + 1];
    read_geometry(header, image);

    // A slope of 0 means that the samples are not scaled. Some libraries write NaN instead.
    if (header.slope != 0 && !std::isnan(header.slope)) {
        if (!std::isfinite(header.slope) || !std::isfinite(header.intercept))
            header.refuse("scl_slope or scl_inter is not finite");
        image.rescale.slope = header.slope;
        image.rescale.intercept = header.intercept;
    }

    image.files = {header.pair ? partner(header.path, ".img") : header.path};
    image.compressed = is_gzip(image.files[0]);
    if (header.vox_offset != std::floor(header.vox_offset) || !(std::abs(header.vox_offset) < 1e15))
        header.refuse("vox_offset is not a number of bytes");
    image.data_offset = static_cast<std::int64_t>(header.vox_offset);
    if (!header.pair && image.data_offset == 0) image.data_offset = header.size;  // not stated
    if (image.data_offset < (header.pair ? 0 : header.size))
        header.refuse(
            fmt::format("vox_offset is {}, which is before the end of the header", image.data_offset));
    choose_volume(image, volumes, volume);
    return image;
}

}  // namespace marrow::internal::io
