// Reads the private headers of Siemens mosaics.
#include "mosaic.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>
#include <vector>

#include <marrow/vector.h>

#include "io/bytes/text.h"
#include "tags.h"

namespace marrow::internal::io {

namespace {

using CsaEntries = std::map<std::string, std::vector<std::string>, std::less<>>;

// Takes a little-endian number off the bytes; 0 at their end.
std::uint32_t take_number(std::string_view& bytes) {
    const std::size_t size = std::min<std::size_t>(4, bytes.size());
    const std::uint32_t out = number_at(bytes, 0, size, false);
    bytes.remove_prefix(size);
    return out;
}

// Takes text that ends at its first zero off the bytes.
std::string take_text(std::string_view& bytes, std::size_t size) {
    const std::string_view all = bytes.substr(0, size);
    bytes.remove_prefix(all.size());
    return std::string(trimmed(all.substr(0, all.find('\0'))));
}

// The entries of a CSA header. The format has no specification; nibabel.nicom and dcm2niix describe
// it: "SV10", 4 bytes, the number of entries, 4 bytes, and for each entry a name of 64 bytes, the
// number of values, a type of 4 bytes, a number, the number of items, 4 bytes; for each item four
// numbers, the second its length, and the text, padded to a multiple of 4 bytes. Without "SV10", it
// begins with the number of entries.
CsaEntries read_csa(std::string_view bytes) {
    constexpr std::uint32_t kMostEntries = 1000, kMostItems = 1000;
    CsaEntries out;
    if (bytes.starts_with("SV10")) bytes.remove_prefix(8);
    const std::uint32_t entries = take_number(bytes);
    take_number(bytes);
    if (entries > kMostEntries) return out;
    for (std::uint32_t e = 0; e < entries && !bytes.empty(); ++e) {
        std::vector<std::string>& values = out[take_text(bytes, 64)];
        bytes.remove_prefix(std::min<std::size_t>(12, bytes.size()));
        const std::uint32_t items = take_number(bytes);
        take_number(bytes);
        if (items > kMostItems) return out;
        for (std::uint32_t i = 0; i < items && !bytes.empty(); ++i) {
            take_number(bytes);
            const std::uint32_t size = take_number(bytes);
            take_number(bytes);
            take_number(bytes);
            if (size > bytes.size()) return out;
            values.push_back(take_text(bytes, size));
            bytes.remove_prefix(std::min<std::size_t>((4 - size % 4) % 4, bytes.size()));
        }
    }
    return out;
}

// The CSA header of an image, in the block of private elements that its creator has reserved (PS3.5, 7.8).
CsaEntries csa_of(const DicomDataSet& data_set) {
    for (DicomTag block = 0x10; block <= 0xff; ++block) {
        if (data_set.text(0x00290000 | block) == "SIEMENS CSA HEADER")
            return read_csa(data_set.bytes(0x00290010 | block << 8));
    }
    return {};
}

std::vector<double> numbers_of(const CsaEntries& csa, std::string_view name) {
    std::vector<double> out;
    const auto at = csa.find(name);
    if (at == csa.end()) return out;
    for (const std::string& value : at->second) {
        const auto number = parse_double(value);
        if (number && std::isfinite(*number)) out.push_back(*number);
    }
    return out;
}

}  // namespace

std::optional<DicomMosaic> read_mosaic(const DicomDataSet& data_set) {
    if (data_set.text(tag::kImageType).find("MOSAIC") == std::string::npos) return {};
    DicomMosaic out;
    const CsaEntries csa = csa_of(data_set);
    const std::vector<double> slices = numbers_of(csa, "NumberOfImagesInMosaic"),
                              normal = numbers_of(csa, "SliceNormalVector");
    constexpr double kMost = 4096;
    if (slices.empty() || !(slices[0] >= 1 && slices[0] <= kMost) || normal.size() < 3) {
        out.lacks = "a private CSA header with the number of its slices and their normal";
        return out;
    }
    const Vec3d direction{normal[0], normal[1], normal[2]};
    const auto spacing = data_set.decimal(tag::kSpacingBetweenSlices);
    if (!spacing || !(*spacing > 0) || !(std::abs(length(direction) - 1) < 1e-3)) {
        out.lacks = "SpacingBetweenSlices, or a normal of length 1";
        return out;
    }
    out.slices = static_cast<std::size_t>(slices[0]);
    while (static_cast<std::size_t>(out.tiles * out.tiles) < out.slices) ++out.tiles;
    out.step = *spacing * direction;
    return out;
}

}  // namespace marrow::internal::io
