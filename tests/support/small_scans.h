/// A small valid scan of each format, as the start for damaged files, faults and fuzzing.
#pragma once

#include <limits>

#include <turbojpeg.h>

#include "compressed_pixels.h"
#include "dicom_objects.h"
#include "scan_files.h"

namespace marrow::test {

/// A scan of 4 x 4 x 4 samples (images: 16 x 16 with one or two pages) with values on both sides of 0.5.
struct SmallScan {
    std::string name;                          ///< name of the file or folder to read
    std::map<std::string, std::string> files;  ///< name -> bytes
    bool needs_spacing = false;
    /// Number of bytes at the end that hold no samples: checksums, end marks, padding.
    std::size_t tail = 0;

    void write(const fs::path& folder) const {
        for (const auto& [file, bytes] : files) write_file(folder / file, bytes);
    }
};

/// An 8-bit JPEG: grey (1 channel) or RGB (3 channels).
inline std::string jpeg_8(int columns, int rows, const std::vector<std::uint8_t>& samples, int channels = 1,
                          int flags = 0) {
    const tjhandle encoder = tjInitCompress();
    unsigned char* bytes = nullptr;
    unsigned long size = 0;
    const bool grey = channels == 1;
    tjCompress2(encoder, samples.data(), columns, 0, rows, grey ? TJPF_GRAY : TJPF_RGB, &bytes, &size,
                grey ? TJSAMP_GRAY : TJSAMP_420, 75, flags);
    std::string whole(reinterpret_cast<char*>(bytes), size);
    tjDestroy(encoder);
    tjFree(bytes);
    return whole;
}

/// A BMP with rows from the bottom: 8 bits with a grey palette, or 24 or 32 bits with equal channels. With
/// `colour` it is green.
inline std::string bmp(int columns, int rows, const std::vector<std::uint8_t>& samples, bool colour = false,
                       int bits = 8) {
    const auto shade = [&](int grey) {
        return bytes_of(static_cast<std::uint32_t>(grey * (colour ? 0x000100 : 0x010101)));
    };
    std::string palette, lines;
    for (int i = 0; bits == 8 && i < 256; ++i) palette += shade(i);
    for (int r = rows - 1; r >= 0; --r) {
        std::string line;
        for (int i = r * columns; i < (r + 1) * columns; ++i) {
            const std::uint8_t grey = samples[static_cast<std::size_t>(i)];
            line += bits == 8 ? std::string(1, static_cast<char>(grey))
                              : shade(grey).substr(0, static_cast<std::size_t>(bits / 8));
        }
        line.resize((line.size() + 3) / 4 * 4);
        lines += line;
    }
    const auto data = static_cast<std::uint32_t>(14 + 40 + palette.size());
    return "BM" + bytes_of(static_cast<std::uint32_t>(data + lines.size())) + bytes_of(std::uint32_t{0}) +
           bytes_of(data) + bytes_of(std::uint32_t{40}) + bytes_of(columns) + bytes_of(rows) +
           bytes_of(std::uint16_t{1}) + bytes_of(static_cast<std::uint16_t>(bits)) + std::string(24, '\0') +
           palette + lines;
}

/// Grey samples in several equal channels. The last of an even number is opacity.
template <class T>
std::vector<T> in_channels(const std::vector<T>& grey, int channels) {
    std::vector<T> out;
    for (const T sample : grey) {
        for (int c = 0; c < channels; ++c) {
            const bool is_opacity = channels % 2 == 0 && c == channels - 1;
            out.push_back(is_opacity ? std::numeric_limits<T>::max() : sample);
        }
    }
    return out;
}

/// The 4 x 4 x 4 samples of the volumes.
inline std::vector<std::int16_t> small_samples() {
    constexpr int n = 4;
    std::vector<std::int16_t> samples;
    for (int i = 0; i < n * n * n; ++i) {
        const bool inside = i % n % 3 && i / n % n % 3 && i / n / n % 3;
        samples.push_back(static_cast<std::int16_t>(inside ? 900 + i : 0));
    }
    return samples;
}

/// The 16 x 16 samples of the images.
template <class T>
std::vector<T> small_image() {
    constexpr int wide = 16;
    std::vector<T> image;
    for (int i = 0; i < wide * wide; ++i)
        image.push_back(static_cast<T>(i % wide > 5 && i / wide > 5 ? 200 + i % 50 : 0));
    return image;
}

inline void add_volume_files(std::vector<SmallScan>& out) {
    const std::string data = bytes_of(small_samples());
    const std::string nrrd =
        "NRRD0004\ntype: short\ndimension: 3\nsizes: 4 4 4\nendian: little\nspacings: 1 1 1\n";
    const std::string meta =
        "ObjectType = Image\nNDims = 3\nDimSize = 4 4 4\nElementType = MET_SHORT\nElementSpacing = 1 1 1\n";
    NiftiWriter nifti, pair;
    nifti.dim = pair.dim = {3, 4, 4, 4};
    pair.pair = true;
    out.push_back({"a.nii", {{"a.nii", nifti.header() + data}}});
    out.push_back({"b.nii.gz", {{"b.nii.gz", gzipped(nifti.header() + data)}}});
    out.push_back({"c.hdr", {{"c.hdr", pair.header()}, {"c.img", data}}});
    out.push_back({"d.nrrd", {{"d.nrrd", nrrd + "encoding: raw\n\n" + data}}});
    out.push_back({"e.nrrd", {{"e.nrrd", nrrd + "encoding: gzip\n\n" + gzipped(data)}}});
    out.push_back({"f.nhdr", {{"f.nhdr", nrrd + "encoding: raw\ndata file: f.raw\n"}, {"f.raw", data}}});
    out.push_back({"g.mha", {{"g.mha", meta + "ElementDataFile = LOCAL\n" + data}}});
    out.push_back({"h.mhd",
                   {{"h.mhd", meta + "CompressedData = True\nElementDataFile = h.zraw\n"},
                    {"h.zraw", deflated(data, 15)}}});
}

/// A folder with a DICOM file for each slice.
inline SmallScan dicom_folder(const std::string& name, DicomWriter::Form form) {
    constexpr int n = 4;
    const std::vector<std::int16_t> samples = small_samples();
    SmallScan out{name, {}};
    for (int k = 0; k < n; ++k) {
        DicomWriter s;
        s.pixels<std::int16_t>(n, n, {samples.begin() + k * n * n, samples.begin() + (k + 1) * n * n});
        s.position("0\\0\\" + std::to_string(k));
        s.form = form;
        out.files[name + "/" + std::to_string(k)] = s.bytes();
    }
    return out;
}

/// A scan of one file, which needs a spacing.
inline SmallScan single_file(const std::string& name, const std::string& bytes, std::size_t tail) {
    return SmallScan{name, {{name, bytes}}, true, tail};
}

inline void add_compressed_dicom(std::vector<SmallScan>& out) {
    constexpr int wide = 16;
    const auto image = small_image<std::uint16_t>();
    const auto add = [&](const std::string& name, const std::string& syntax, const std::string& stream,
                         int bits) {
        DicomWriter s;
        s.pixel_format(bits > 8 ? 16 : 8, bits, false);
        s.pixels(wide, wide, image);
        s.compressed_syntax = "1.2.840.10008.1.2.4." + syntax;
        s.fragments = {even(stream)};
        out.push_back(single_file(name, s.bytes(), 0));
    };
    add("jpeg.dcm", "50", jpeg_8(wide, wide, small_image<std::uint8_t>()), 8);
    add("progressive.dcm", "55", flat_jpeg(wide, wide, {1, 4000, 0, 900}, 12, true), 12);
    add("lossless.dcm", "57", lossless_jpeg(wide, wide, image, 12, 4, true), 12);
    add("jpegls.dcm", "80", jpeg_ls(wide, wide, image, 12), 12);
    add("j2k.dcm", "90", jpeg_2000(wide, wide, image, 12), 12);
}

/// DICOM of other kinds: frames with functional groups, segmentations, a Siemens mosaic. They have 3 x 2
/// samples a slice.
inline void add_dicom_objects(std::vector<SmallScan>& out) {
    const std::vector<SegmentFrame> frames = {{2, 0.5, {0, 0, 1, 0, 1, 1}}, {1, 0, {1, 1, 0, 0, 0, 1}}};
    const auto add = [&](const std::string& name, const DicomWriter& object, std::size_t tail) {
        out.push_back({name, {{name, object.bytes()}}, false, tail});
    };
    add("enhanced.dcm", enhanced(4), 0);
    add("binary.dcm", segmentation(frames, "BINARY"), 0);
    DicomWriter fractional = segmentation(frames, "FRACTIONAL");
    fractional.number(0x0062000e, 1);  // the largest fraction
    add("fractional.dcm", fractional, 0);
    add("labelmap.dcm", segmentation(frames, "LABELMAP"), 0);
    add("mosaic.dcm", mosaic(0), 0);
}

inline void add_image_files(std::vector<SmallScan>& out) {
    constexpr int wide = 16;
    constexpr std::size_t kPngTail = 16;  // a checksum and an end mark
    const auto image = small_image<std::uint16_t>();
    const auto image8 = small_image<std::uint8_t>();
    out.push_back(single_file("i.png", png(wide, wide, image), kPngTail));
    out.push_back(single_file("j.tif", tiff(wide, wide, {image, image}), 0));
    out.push_back(single_file("k.jpg", jpeg_8(wide, wide, image8), 0));
    out.push_back(single_file("l.bmp", bmp(wide, wide, image8), 0));
    out.push_back(single_file("m.bmp", bmp(wide, wide, image8, false, 24), 0));
    out.push_back(single_file("n.png", png(wide, wide, in_channels(image8, 3), 3), kPngTail));
    out.push_back(single_file("o.jpg", jpeg_8(wide, wide, in_channels(image8, 3), 3), 0));
}

inline std::vector<SmallScan> small_scans() {
    using Form = DicomWriter::Form;
    std::vector<SmallScan> out;
    add_volume_files(out);
    out.push_back(dicom_folder("dicom", Form::explicit_little));
    out.push_back(dicom_folder("implicit", Form::implicit_little));
    out.push_back(dicom_folder("big", Form::explicit_big));
    out.push_back(dicom_folder("deflated", Form::deflated));
    out.push_back(dicom_folder("rle", Form::run_length));
    add_compressed_dicom(out);
    add_dicom_objects(out);
    add_image_files(out);
    return out;
}

}  // namespace marrow::test
