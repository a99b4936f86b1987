/// Writers of small scans that share no code with the library.
#pragma once

#include <zlib.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "temporary_folder.h"

namespace marrow::test {

namespace fs = std::filesystem;

/// The bytes of a number, little-endian by default.
template <class T>
std::string bytes_of(T value, bool big_endian = false) {
    std::string out(reinterpret_cast<const char*>(&value), sizeof value);
    return big_endian ? std::string(out.rbegin(), out.rend()) : out;
}

template <class T>
std::string bytes_of(const std::vector<T>& values, bool big_endian = false) {
    std::string out;
    for (const T v : values) out += bytes_of(v, big_endian);
    return out;
}

/// Compresses bytes. `window_bits`: 31 for gzip, 15 for zlib, -15 for bare deflate.
inline std::string deflated(const std::string& bytes, int window_bits) {
    z_stream zip{};
    deflateInit2(&zip, Z_BEST_COMPRESSION, Z_DEFLATED, window_bits, 8, Z_DEFAULT_STRATEGY);
    std::string out(deflateBound(&zip, bytes.size()) + 64, '\0');
    zip.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
    zip.avail_in = static_cast<uInt>(bytes.size());
    zip.next_out = reinterpret_cast<Bytef*>(out.data());
    zip.avail_out = static_cast<uInt>(out.size());
    deflate(&zip, Z_FINISH);
    out.resize(zip.total_out);
    deflateEnd(&zip);
    return out;
}

inline std::string gzipped(const std::string& bytes) {
    return deflated(bytes, 31);
}

/// Writes one DICOM file. Set its elements first.
struct DicomWriter {
    enum class Form { explicit_little, implicit_little, explicit_big, deflated, run_length, no_preamble };

    Form form = Form::explicit_little;
    std::map<std::uint32_t, std::pair<std::string, std::string>>
        elements;                        ///< tag -> VR, value in little-endian
    std::string compressed_syntax;       ///< if not empty, the pixels are `fragments`
    std::string offset_table;            ///< of the fragments
    std::vector<std::string> fragments;  ///< each has an even number of bytes

    DicomWriter() {
        text(0x00080008, "CS", "ORIGINAL\\PRIMARY\\AXIAL");
        text(0x00080016, "UI", "1.2.840.10008.5.1.4.1.1.2");
        text(0x00080060, "CS", "CT");
        text(0x0008103e, "LO", "thin slices");
        text(0x00100010, "PN", "SECRET^NAME");
        text(0x0020000e, "UI", "1.2.3");
        text(0x00200052, "UI", "1.2.9");
        number(0x00280002, 1);
        text(0x00280004, "CS", "MONOCHROME2");
        pixel_format(16, 16, true);
        orientation("1\\0\\0\\0\\1\\0");
        position("0\\0\\0");
        spacing("1\\1");
        rescale("1", "0");
    }

    void text(std::uint32_t tag, const std::string& vr, std::string value) {
        if (value.size() % 2 != 0) value += vr == "UI" ? '\0' : ' ';
        elements[tag] = {vr, std::move(value)};
    }
    void number(std::uint32_t tag, int value) {
        elements[tag] = {"US", bytes_of(static_cast<std::uint16_t>(value))};
    }
    void orientation(const std::string& value) { text(0x00200037, "DS", value); }
    void position(const std::string& value) { text(0x00200032, "DS", value); }
    void spacing(const std::string& value) { text(0x00280030, "DS", value); }
    void rescale(const std::string& slope, const std::string& intercept) {
        text(0x00281053, "DS", slope);
        text(0x00281052, "DS", intercept);
    }
    void pixel_format(int allocated, int stored, bool is_signed) {
        number(0x00280100, allocated);
        number(0x00280101, stored);
        number(0x00280102, stored - 1);
        number(0x00280103, is_signed ? 1 : 0);
    }
    template <class T>
    void pixels(int columns, int rows, const std::vector<T>& values) {
        number(0x00280010, rows);
        number(0x00280011, columns);
        elements[0x7fe00010] = {sizeof(T) == 1 ? "OB" : "OW", bytes_of(values)};
    }

    /// The bytes of an element. US and OW are swapped if the form is big-endian.
    static std::string element(std::uint32_t tag, const std::string& vr, std::string value, Form form) {
        const bool big = form == Form::explicit_big;
        if (big && (vr == "US" || vr == "OW")) {
            for (std::size_t i = 0; i + 1 < value.size(); i += 2) std::swap(value[i], value[i + 1]);
        }
        std::string out = bytes_of(static_cast<std::uint16_t>(tag >> 16), big) +
                          bytes_of(static_cast<std::uint16_t>(tag), big);
        const auto size = static_cast<std::uint32_t>(value.size());
        if (form == Form::implicit_little) return out + bytes_of(size) + value;
        out += vr;
        if (vr == "OB" || vr == "OW" || vr == "SQ" || vr == "UN")
            return out + std::string(2, '\0') + bytes_of(size, big) + value;
        return out + bytes_of(static_cast<std::uint16_t>(size), big) + value;
    }

    static std::string item(const std::string& content) {
        return bytes_of(std::uint16_t{0xfffe}) + bytes_of(std::uint16_t{0xe000}) +
               bytes_of(static_cast<std::uint32_t>(content.size())) + content;
    }

    std::string data_set() const {
        std::string out;
        for (const auto& [tag, e] : elements) {
            if (tag == 0x7fe00010 && !compressed_syntax.empty())
                out += encapsulated(offset_table, fragments);
            else if (tag == 0x7fe00010 && form == Form::run_length)
                out += run_length_pixels(e.second);
            else
                out += element(tag, e.first, e.second, form);
        }
        return out;
    }

    std::string bytes() const {
        if (form == Form::no_preamble) {
            DicomWriter plain = *this;
            plain.form = Form::implicit_little;
            return plain.data_set();
        }
        static const std::map<Form, std::string> syntax = {{Form::explicit_little, "1.2.840.10008.1.2.1"},
                                                           {Form::implicit_little, "1.2.840.10008.1.2"},
                                                           {Form::explicit_big, "1.2.840.10008.1.2.2"},
                                                           {Form::deflated, "1.2.840.10008.1.2.1.99"},
                                                           {Form::run_length, "1.2.840.10008.1.2.5"}};
        std::string uid = compressed_syntax.empty() ? syntax.at(form) : compressed_syntax;
        if (uid.size() % 2 != 0) uid += '\0';
        const std::string set = data_set();
        return std::string(128, '\0') + "DICM" + element(0x00020010, "UI", uid, Form::explicit_little) +
               (form == Form::deflated ? deflated(set, -15) : set);
    }

    fs::path write(const fs::path& path) const { return write_file(path, bytes()); }

  private:
    // 16-bit samples in two segments, with runs of one to three samples.
    static std::string run_length_pixels(const std::string& cells) {
        std::array<std::string, 2> segments;
        for (const int high : {1, 0}) {
            std::string& out = segments[1 - high];
            for (std::size_t i = high; i < cells.size();) {
                std::size_t run = 1;
                while (run < 3 && i + 2 * run < cells.size() && cells[i + 2 * run] == cells[i]) ++run;
                if (run > 1)
                    out += static_cast<char>(1 - static_cast<int>(run));
                else
                    out += '\0';
                out += cells[i];
                i += 2 * run;
            }
        }
        if (segments[0].size() % 2 != 0) segments[0] += static_cast<char>(-128);
        std::string stream = bytes_of(std::uint32_t{2}) + bytes_of(std::uint32_t{64}) +
                             bytes_of(static_cast<std::uint32_t>(64 + segments[0].size()));
        stream.resize(64);
        stream += segments[0] + segments[1];
        if (stream.size() % 2 != 0) stream += '\0';
        return encapsulated("", {stream});
    }

    static std::string encapsulated(const std::string& offset_table,
                                    const std::vector<std::string>& fragments) {
        std::string out = bytes_of(std::uint16_t{0x7fe0}) + bytes_of(std::uint16_t{0x0010}) + "OB" +
                          std::string(2, '\0') + std::string(4, '\xff') + item(offset_table);
        for (const auto& fragment : fragments) out += item(fragment);
        return out + bytes_of(std::uint16_t{0xfffe}) + bytes_of(std::uint16_t{0xe0dd}) + std::string(4, '\0');
    }
};

/// Writes a NIfTI-1 header; all other fields are zero.
struct NiftiWriter {
    std::vector<std::int16_t> dim{3, 1, 1, 1};
    std::array<float, 4> pixdim{1, 1, 1, 1};
    std::int16_t datatype = 4, qform_code = 0, sform_code = 0;
    float slope = 0, intercept = 0;
    std::array<float, 3> quaternion{}, offset{};
    std::array<std::array<float, 4>, 3> srow{};
    bool big_endian = false;
    bool pair = false;
    std::uint8_t units = 2;

    std::string header() const {
        std::string out(352, '\0');
        const auto put = [&](std::size_t at, auto value) {
            const std::string b = bytes_of(value, big_endian);
            out.replace(at, b.size(), b);
        };
        put(0, std::int32_t{348});
        for (std::size_t i = 0; i < dim.size(); ++i) put(40 + 2 * i, dim[i]);
        for (std::size_t i = 0; i < 4; ++i) put(76 + 4 * i, pixdim[i]);
        put(70, datatype);
        put(108, pair ? 0.0f : 352.0f);
        put(112, slope);
        put(116, intercept);
        put(123, units);
        put(252, qform_code);
        put(254, sform_code);
        for (std::size_t i = 0; i < 3; ++i) {
            put(256 + 4 * i, quaternion[i]);
            put(268 + 4 * i, offset[i]);
            for (std::size_t j = 0; j < 4; ++j) put(280 + 16 * i + 4 * j, srow[i][j]);
        }
        out.replace(344, 4, std::string(pair ? "ni1" : "n+1") + '\0');
        return pair ? out.substr(0, 348) : out;
    }
};

/// A PNG with 8 or 16 bits: grey (1 channel), grey and opacity (2), RGB (3), RGB and opacity (4).
template <class T>
std::string png(int columns, int rows, const std::vector<T>& samples, int channels = 1) {
    const auto chunk = [](const std::string& type, const std::string& data) {
        const std::string body = type + data;
        const auto crc =
            crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size()));
        return bytes_of(static_cast<std::uint32_t>(data.size()), true) + body +
               bytes_of(static_cast<std::uint32_t>(crc), true);
    };
    std::string header = bytes_of(columns, true) + bytes_of(rows, true);
    header += static_cast<char>(8 * sizeof(T));
    header += "\0\4\2\6"[channels - 1];
    header += std::string(3, '\0');
    std::string lines;
    const std::size_t line = static_cast<std::size_t>(columns * channels);
    for (int r = 0; r < rows; ++r) {
        lines += '\0';
        for (std::size_t i = 0; i < line; ++i)
            lines += bytes_of(samples[static_cast<std::size_t>(r) * line + i], true);
    }
    return "\x89PNG\r\n\x1a\n" + chunk("IHDR", header) + chunk("IDAT", deflated(lines, 15)) +
           chunk("IEND", "");
}

/// A TIFF of 16-bit grey pages, with a private tag that libraries warn about.
inline std::string tiff(int columns, int rows, const std::vector<std::vector<std::uint16_t>>& pages) {
    std::string out = std::string("II*") + '\0' + bytes_of(std::uint32_t{8});
    for (std::size_t p = 0; p < pages.size(); ++p) {
        const auto directory = static_cast<std::uint32_t>(out.size());
        const std::uint16_t tags = 10;
        const std::uint32_t data = directory + 2 + 12 * tags + 4;
        const auto size = static_cast<std::uint32_t>(pages[p].size() * 2);
        const auto entry = [](int tag, int type, std::uint32_t value) {
            return bytes_of(static_cast<std::uint16_t>(tag)) + bytes_of(static_cast<std::uint16_t>(type)) +
                   bytes_of(std::uint32_t{1}) + bytes_of(value);
        };
        out += bytes_of(tags) + entry(256, 4, static_cast<std::uint32_t>(columns)) +
               entry(257, 4, static_cast<std::uint32_t>(rows)) + entry(258, 3, 16) + entry(259, 3, 1) +
               entry(262, 3, 1) + entry(273, 4, data) + entry(277, 3, 1) +
               entry(278, 4, static_cast<std::uint32_t>(rows)) + entry(279, 4, size) + entry(60000, 4, 7);
        out += bytes_of(p + 1 < pages.size() ? data + size : std::uint32_t{0}) + bytes_of(pages[p]);
    }
    return out;
}

}  // namespace marrow::test
