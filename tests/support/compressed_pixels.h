/// Small encoders for the compressed pixels of DICOM. They share no code with the readers.
#pragma once

#include <charls/charls.h>
#include <openjpeg.h>
#include <openjph/ojph_arch.h>
#include <openjph/ojph_codestream.h>
#include <openjph/ojph_file.h>
#include <openjph/ojph_mem.h>
#include <openjph/ojph_params.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "scan_files.h"

namespace marrow::test {

/// The bits of a JPEG stream: highest first, with a zero byte after each 0xff.
class JpegBits {
  public:
    void put(std::uint32_t bits, int count) {
        for (int i = count - 1; i >= 0; --i) {
            byte_ = static_cast<unsigned char>(byte_ << 1 | (bits >> i & 1));
            if (++filled_ < 8) continue;
            out_ += static_cast<char>(byte_);
            if (byte_ == 0xff) out_ += '\0';
            filled_ = 0;
        }
    }
    /// Appends a difference: its size as a code of five bits, then its bits.
    void put_difference(int value) {
        int size = 0;
        while (std::abs(value) >> size) ++size;
        put(static_cast<std::uint32_t>(size), 5);
        if (size < 16) put(static_cast<std::uint32_t>(value < 0 ? value + (1 << size) - 1 : value), size);
    }
    std::string bytes() {
        while (filled_ != 0) put(1, 1);
        return std::exchange(out_, {});
    }

  private:
    std::string out_;
    unsigned char byte_ = 0;
    int filled_ = 0;
};

inline std::string jpeg_segment(int marker, const std::string& content) {
    return std::string("\xff") + static_cast<char>(marker) +
           bytes_of(static_cast<std::uint16_t>(content.size() + 2), true) + content;
}

/// The start of a grey JPEG. Sizes from 0 to 16, or less, have codes of five bits. The only AC code
/// is one zero bit: end of block.
inline std::string jpeg_start(int frame_marker, int bits, int columns, int rows, char most = 16) {
    std::string dc = std::string(5, '\0') + static_cast<char>(most + 1) + std::string(11, '\0');
    for (char size = 0; size <= most; ++size) dc += size;
    const std::string ac = std::string("\x10\x01", 2) + std::string(15, '\0') + '\0';
    return "\xff\xd8" + jpeg_segment(0xc4, dc) + jpeg_segment(0xc4, ac) +
           jpeg_segment(frame_marker, static_cast<char>(bits) +
                                          bytes_of(static_cast<std::uint16_t>(rows), true) +
                                          bytes_of(static_cast<std::uint16_t>(columns), true) +
                                          std::string("\x01\x01\x11\x00", 4));
}

inline std::string jpeg_scan(int first, int last, int approximation, const std::string& bits) {
    return jpeg_segment(0xda, std::string("\x01\x01\x00", 3) + static_cast<char>(first) +
                                  static_cast<char>(last) + static_cast<char>(approximation)) +
           bits;
}

/// Lossless JPEG with one of the seven predictors, perhaps with a restart after each row.
inline std::string lossless_jpeg(int columns, int rows, const std::vector<std::uint16_t>& samples, int bits,
                                 int predictor, bool restarts) {
    std::string out = jpeg_start(0xc3, bits, columns, rows);
    if (restarts) out += jpeg_segment(0xdd, bytes_of(static_cast<std::uint16_t>(columns), true));
    JpegBits code;
    std::string coded;
    for (int y = 0; y < rows; ++y) {
        if (restarts && y > 0) coded += code.bytes() + "\xff" + static_cast<char>(0xd0 + (y - 1) % 8);
        const bool first_row = y == 0 || restarts;
        for (int x = 0; x < columns; ++x) {
            const auto at = [&](int i, int j) {
                return static_cast<int>(samples[static_cast<std::size_t>(j * columns + i)]);
            };
            int p = 1 << (bits - 1);
            if (first_row && x > 0) {
                p = at(x - 1, y);
            } else if (!first_row && x == 0) {
                p = at(x, y - 1);
            } else if (!first_row) {
                const int a = at(x - 1, y), b = at(x, y - 1), c = at(x - 1, y - 1);
                const int predictions[] = {
                    a, b, c, a + b - c, a + ((b - c) >> 1), b + ((a - c) >> 1), (a + b) / 2};
                p = predictions[predictor - 1];
            }
            const auto difference = static_cast<std::int16_t>(at(x, y) - p);
            code.put_difference(difference);
        }
    }
    coded += code.bytes();
    return out + jpeg_scan(predictor, 0, 0, coded) + "\xff\xd9";
}

/// Lossy JPEG of an image that is constant in each block of 8 x 8, so that the `values` of the blocks are
/// exact. If progressive, the lowest bit is in a scan of its own at the end.
inline std::string flat_jpeg(int columns, int rows, const std::vector<int>& values, int bits,
                             bool progressive) {
    // With quantization 1, the first coefficient is 8 times the difference from the middle value.
    std::string out = jpeg_start(progressive ? 0xc2 : 0xc1, bits, columns, rows);
    out.insert(2, jpeg_segment(0xdb, std::string(1, '\0') + std::string(64, '\1')));
    JpegBits code, rest, ends;
    int last = 0;
    for (const int value : values) {
        const int c = 8 * (value - (1 << (bits - 1))) + 1;  // + 1 sets the lowest bit, which rounding removes
        const int sent = progressive ? c >> 1 : c;
        code.put_difference(sent - last);
        last = sent;
        if (progressive) rest.put(static_cast<std::uint32_t>(c & 1), 1);
        (progressive ? ends : code).put(0, 1);
    }
    if (!progressive) return out + jpeg_scan(0, 63, 0, code.bytes()) + "\xff\xd9";
    return out + jpeg_scan(0, 0, 0x01, code.bytes()) + jpeg_scan(1, 63, 0, ends.bytes()) +
           jpeg_scan(0, 0, 0x10, rest.bytes()) + "\xff\xd9";
}

/// A progressive JPEG of 16 x 8 samples, all 128, with this number of scans, at most 883. Each makes a
/// decoder process the whole image.
inline std::string jpeg_of_many_scans(int scans) {
    std::string out = jpeg_start(0xc2, 8, 16, 8, 11);  // libjpeg knows no larger sizes
    out.insert(2, jpeg_segment(0xdb, std::string(1, '\0') + std::string(64, '\1')));
    out += jpeg_scan(0, 0, 0, std::string("\0\x3f", 2));  // two differences of 0
    for (int i = 1; i < scans; ++i) {  // one bit of one coefficient, which is 0 in both blocks
        const int coefficient = 1 + (i - 1) / 14, bit = 13 - (i - 1) % 14;
        out += jpeg_scan(coefficient, coefficient, (bit == 13 ? 0 : (bit + 1) << 4) | bit, "\x3f");
    }
    return out + "\xff\xd9";
}

inline std::string jpeg_ls(int columns, int rows, const std::vector<std::uint16_t>& samples, int bits) {
    charls::jpegls_encoder encoder;
    encoder.frame_info({static_cast<std::uint32_t>(columns), static_cast<std::uint32_t>(rows), bits, 1});
    std::string out(encoder.estimated_destination_size(), '\0');
    encoder.destination(out.data(), out.size());
    out.resize(encoder.encode(samples.data(), samples.size() * sizeof(std::uint16_t)));
    return out;
}

inline std::string jpeg_2000(int columns, int rows, const std::vector<std::uint16_t>& samples, int bits) {
    opj_image_cmptparm_t form{};
    form.dx = form.dy = 1;
    form.w = static_cast<OPJ_UINT32>(columns);
    form.h = static_cast<OPJ_UINT32>(rows);
    form.prec = static_cast<OPJ_UINT32>(bits);
    opj_image_t* image = opj_image_create(1, &form, OPJ_CLRSPC_GRAY);
    image->x1 = form.w;
    image->y1 = form.h;
    std::copy(samples.begin(), samples.end(), image->comps[0].data);
    opj_cparameters_t parameters;
    opj_set_default_encoder_parameters(&parameters);
    parameters.numresolution = 1;  // images of a few samples
    parameters.tcp_numlayers = 1;
    parameters.cp_disto_alloc = 1;
    opj_codec_t* codec = opj_create_compress(OPJ_CODEC_J2K);
    opj_setup_encoder(codec, &parameters, image);
    std::string out;
    opj_stream_t* stream = opj_stream_default_create(OPJ_FALSE);
    opj_stream_set_user_data(stream, &out, nullptr);
    opj_stream_set_write_function(stream, [](void* from, OPJ_SIZE_T size, void* to) {
        static_cast<std::string*>(to)->append(static_cast<const char*>(from), size);
        return size;
    });
    opj_start_compress(codec, image, stream);
    opj_encode(codec, stream);
    opj_end_compress(codec, stream);
    opj_stream_destroy(stream);
    opj_destroy_codec(codec);
    opj_image_destroy(image);
    return out;
}

/// High-throughput JPEG 2000 by OpenJPH; without loss if `reversible`. RPCL is the progression order that the
/// transfer syntax 1.2.840.10008.1.2.4.202 asks for.
inline std::string htj2k(int columns, int rows, const std::vector<std::uint16_t>& samples, int bits,
                         bool reversible = true) {
    const auto width = static_cast<ojph::ui32>(columns), height = static_cast<ojph::ui32>(rows);
    ojph::codestream stream;
    ojph::param_siz size = stream.access_siz();
    size.set_image_extent(ojph::point(width, height));
    size.set_num_components(1);
    size.set_component(0, ojph::point(1, 1), static_cast<ojph::ui32>(bits), false);
    ojph::param_cod coding = stream.access_cod();
    coding.set_num_decomposition(columns < 32 ? 0 : 3);
    coding.set_reversible(reversible);
    coding.set_progression_order("RPCL");
    if (!reversible) stream.access_qcd().set_irrev_quant(0.0001f);
    ojph::mem_outfile out;
    out.open();
    stream.write_headers(&out);
    ojph::ui32 component = 0;
    ojph::line_buf* line = stream.exchange(nullptr, component);
    for (auto at = samples.begin(); at != samples.end(); at += columns) {
        std::copy_n(at, columns, line->i32);
        line = stream.exchange(line, component);
    }
    stream.flush();
    std::string bytes(reinterpret_cast<const char*>(out.get_data()), static_cast<std::size_t>(out.tell()));
    stream.close();
    return bytes;
}

/// Pads to an even number of bytes, as fragments require.
inline std::string even(std::string stream) {
    if (stream.size() % 2 != 0) stream += '\0';
    return stream;
}

}  // namespace marrow::test
