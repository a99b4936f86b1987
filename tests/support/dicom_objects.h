/// Small DICOM objects that are more than a series of slices: segmentations and Siemens mosaics.
#pragma once

#include "dicom_series.h"

namespace marrow::test {

// A frame of a segment: its samples, row by row.
struct SegmentFrame {
    int segment;
    double z;
    std::vector<std::uint8_t> samples;  // 3 x 2
};

inline std::string sequence_of(std::uint32_t tag, const std::string& content) {
    return DicomWriter::element(tag, "SQ", DicomWriter::item(content), Form::explicit_little);
}

inline std::string text_of(std::uint32_t tag, const char* vr, std::string value) {
    if (value.size() % 2 != 0) value += ' ';
    return DicomWriter::element(tag, vr, value, Form::explicit_little);
}

inline std::string number_of(std::uint32_t tag, int value) {
    return DicomWriter::element(tag, "US", bytes_of(static_cast<std::uint16_t>(value)),
                                Form::explicit_little);
}

inline std::string segment_item(int number, const std::string& label, const std::vector<std::uint16_t>& lab) {
    return DicomWriter::item(number_of(0x00620004, number) + text_of(0x00620005, "LO", label) +
                             DicomWriter::element(0x0062000d, "US", bytes_of(lab), Form::explicit_little));
}

// A segmentation of 3 x 2 samples a frame, with slices of 0.25 mm.
inline DicomWriter segmentation(const std::vector<SegmentFrame>& frames, const std::string& type,
                                const std::string& between = "0.25", const std::string& thickness = {}) {
    DicomWriter out;
    for (const std::uint32_t tag : {0x00200032u, 0x00200037u, 0x00280030u, 0x00281052u, 0x00281053u})
        out.elements.erase(tag);
    out.text(0x00080016, "UI",
             type == "LABELMAP" ? "1.2.840.10008.5.1.4.1.1.66.7" : "1.2.840.10008.5.1.4.1.1.66.4");
    out.text(0x00080060, "CS", "SEG");
    out.text(0x00280008, "IS", std::to_string(frames.size()));
    out.text(0x00620001, "CS", type);
    const std::vector<std::uint16_t> red{35000, 53000, 50000}, grey{32768, 32896, 32896};
    out.elements[0x00620002] = {"SQ", segment_item(1, "liver", red) + segment_item(2, "left kidney", grey)};
    std::string items, bytes;
    std::vector<bool> bits;
    for (const SegmentFrame& frame : frames) {
        std::string groups =
            sequence_of(0x00209113, text_of(0x00200032, "DS", "10\\20\\" + std::to_string(frame.z)));
        if (type != "LABELMAP") groups += sequence_of(0x0062000a, number_of(0x0062000b, frame.segment));
        items += DicomWriter::item(groups);
        for (const std::uint8_t sample : frame.samples) {
            bits.push_back(sample != 0);
            bytes += static_cast<char>(sample);
        }
    }
    std::string measures;
    if (!thickness.empty()) measures += text_of(0x00180050, "DS", thickness);
    if (!between.empty()) measures += text_of(0x00180088, "DS", between);
    measures += text_of(0x00280030, "DS", "3\\4");
    out.elements[0x52009229] = {
        "SQ", DicomWriter::item(sequence_of(0x00209116, text_of(0x00200037, "DS", "1\\0\\0\\0\\1\\0")) +
                                sequence_of(0x00289110, measures))};
    out.elements[0x52009230] = {"SQ", items};
    out.pixels<std::uint8_t>(columns, rows, {});
    out.pixel_format(8, 8, false);
    if (type == "BINARY") {  // the bits of all frames, one after the other
        out.pixel_format(1, 1, false);
        bytes.assign((bits.size() + 7) / 8, '\0');
        for (std::size_t i = 0; i < bits.size(); ++i)
            bytes[i / 8] = static_cast<char>(bytes[i / 8] | bits[i] << i % 8);
    }
    if (bytes.size() % 2 != 0) bytes += '\0';
    out.elements[0x7fe00010] = {"OB", bytes};
    return out;
}

// An entry of Siemens' private header.
inline std::string csa_entry(std::string name, const std::vector<std::string>& values) {
    name.resize(64);
    std::string out = name + bytes_of(static_cast<std::uint32_t>(values.size())) + std::string("FD\0\0", 4) +
                      bytes_of(std::uint32_t{4}) + bytes_of(std::uint32_t{6}) + bytes_of(std::uint32_t{77});
    for (std::size_t i = 0; i < 6; ++i) {
        std::string value = i < values.size() ? values[i] : "";
        const auto size = static_cast<std::uint32_t>(value.size());
        value.resize((value.size() + 3) / 4 * 4);
        out += bytes_of(size) + bytes_of(size) + bytes_of(std::uint32_t{77}) + bytes_of(size) + value;
    }
    return out;
}

inline std::string csa_header(const std::vector<std::string>& slices,
                              const std::vector<std::string>& normal) {
    return "SV10\4\3\2\1" + bytes_of(std::uint32_t{3}) + bytes_of(std::uint32_t{77}) +
           csa_entry("EchoLinePosition", {"32"}) + csa_entry("NumberOfImagesInMosaic", slices) +
           csa_entry("SliceNormalVector", normal);
}

// Five slices in 3 x 3 tiles. Each tile is a slice of three columns and two rows.
inline DicomWriter mosaic(int volume) {
    constexpr int tiles = 3, slices = 5;
    std::vector<std::int16_t> all(static_cast<std::size_t>(tiles * columns * tiles * rows), -1);
    for (int k = 0; k < slices; ++k) {
        const auto samples = slice_samples(10 * volume + k);
        for (int j = 0; j < rows; ++j) {
            for (int i = 0; i < columns; ++i) {
                const int row = k / tiles * rows + j, column = k % tiles * columns + i;
                all[static_cast<std::size_t>(row * tiles * columns + column)] =
                    samples[static_cast<std::size_t>(j * columns + i)];
            }
        }
    }
    DicomWriter out;
    out.text(0x00080008, "CS", "ORIGINAL\\PRIMARY\\M\\ND\\MOSAIC");
    out.text(0x00180088, "DS", "2.5");
    out.text(0x00200012, "IS", std::to_string(volume + 1));
    out.text(0x00290011, "LO", "SIEMENS CSA HEADER");
    out.elements[0x00291110] = {"OB", csa_header({"5"}, {"0.0", "0.0", "-1.0"})};
    out.pixels(tiles * columns, tiles * rows, all);
    out.position("10\\20\\30");
    out.spacing("0.5\\0.25");
    return out;
}

}  // namespace marrow::test
