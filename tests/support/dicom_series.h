/// Small DICOM series whose samples encode their position.
#pragma once

#include "scan_files.h"

namespace marrow::test {

using Form = DicomWriter::Form;

inline constexpr int columns = 3, rows = 2;

/// The samples of slice k: 100 k + 10 j + i.
inline std::vector<std::int16_t> slice_samples(int k) {
    std::vector<std::int16_t> out;
    for (int j = 0; j < rows; ++j) {
        for (int i = 0; i < columns; ++i) out.push_back(static_cast<std::int16_t>(100 * k + 10 * j + i));
    }
    return out;
}

inline DicomWriter slice(int k, double z) {
    DicomWriter out;
    out.pixels(columns, rows, slice_samples(k));
    out.position("10\\20\\" + std::to_string(z));
    return out;
}

inline std::vector<std::int16_t> volume_samples(int slices) {
    std::vector<std::int16_t> out;
    for (int k = 0; k < slices; ++k) {
        const auto s = slice_samples(k);
        out.insert(out.end(), s.begin(), s.end());
    }
    return out;
}

/// Writes `count` slices with a spacing of 2 mm.
inline void write_series(const TemporaryFolder& folder, int count, const std::string& prefix = "slice",
                         const std::function<void(DicomWriter&, int)>& change = {}) {
    for (int k = 0; k < count; ++k) {
        DicomWriter s = slice(k, 2.0 * k);
        if (change) change(s, k);
        s.write(folder / (prefix + std::to_string(k)));
    }
}

/// An enhanced multi-frame file: positions and rescale are in functional groups, and frames are not in order.
/// `groups`: the form of the groups
inline DicomWriter enhanced(int frames, Form groups = Form::explicit_little) {
    const auto sequence = [=](std::uint32_t tag, const std::string& items) {
        return DicomWriter::element(tag, "SQ", items, groups);
    };
    const auto text = [=](std::uint32_t tag, std::string value) {
        if (value.size() % 2 != 0) value += ' ';
        return DicomWriter::element(tag, "DS", value, groups);
    };
    DicomWriter out;
    for (const std::uint32_t tag : {0x00200032u, 0x00200037u, 0x00280030u, 0x00281052u, 0x00281053u})
        out.elements.erase(tag);
    std::string items;
    std::vector<std::int16_t> all;
    for (int n = 0; n < frames; ++n) {
        const int k = (n * 2 + 1) % frames;
        items += DicomWriter::item(
            sequence(0x00209113, DicomWriter::item(text(0x00200032, "10\\20\\" + std::to_string(2 * k)))) +
            sequence(0x00289145,
                     DicomWriter::item(text(0x00281052, std::to_string(1000 * k)) + text(0x00281053, "1"))));
        const auto samples = slice_samples(k);
        all.insert(all.end(), samples.begin(), samples.end());
    }
    out.elements[0x52009229] = {
        "SQ",
        DicomWriter::item(sequence(0x00209116, DicomWriter::item(text(0x00200037, "1\\0\\0\\0\\1\\0"))) +
                          sequence(0x00289110, DicomWriter::item(text(0x00280030, "3\\4"))))};
    out.elements[0x52009230] = {"SQ", items};
    out.text(0x00280008, "IS", std::to_string(frames));
    out.pixels(columns, rows, all);
    return out;
}

}  // namespace marrow::test
