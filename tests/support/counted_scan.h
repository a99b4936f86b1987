/// A scan of 4 x 3 x 2 samples that count up, and its headers in the formats of volume files.
#pragma once

#include <cstdint>
#include <numeric>
#include <string>
#include <vector>

#include "scan_files.h"

namespace marrow::test {

inline constexpr int nx = 4, ny = 3, nz = 2;

inline std::vector<std::int16_t> samples() {
    std::vector<std::int16_t> out(nx * ny * nz);
    std::iota(out.begin(), out.end(), std::int16_t{-7});
    return out;
}

inline NiftiWriter nifti() {
    NiftiWriter out;
    out.dim = {3, nx, ny, nz};
    return out;
}

inline std::string nrrd(const std::string& fields, const std::string& encoding = "raw") {
    return "NRRD0004\n# made by a test\ntype: short\ndimension: 3\nsizes: 4 3 2\nendian: little\nencoding: " +
           encoding + "\n" + fields;
}

inline std::string metaimage(const std::string& fields, const std::string& file = "LOCAL") {
    return "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nDimSize = 4 3 "
           "2\n"
           "ElementType = MET_SHORT\n" +
           fields + "ElementDataFile = " + file + "\n";
}

}  // namespace marrow::test
