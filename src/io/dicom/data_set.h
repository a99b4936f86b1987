/// Parses DICOM files into data elements.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <marrow/buffer.h>

namespace marrow::internal::io {

/// The number in `size` bytes, at most four, from `at` on. \pre the bytes are there
inline std::uint32_t number_at(std::string_view bytes, std::size_t at, std::size_t size, bool big_endian) {
    std::uint32_t out = 0;
    for (std::size_t i = 0; i < size; ++i) {
        const auto byte = static_cast<unsigned char>(bytes[at + (big_endian ? i : size - 1 - i)]);
        out = out << 8 | byte;
    }
    return out;
}

/// The values of text with several: "a\b\c". They point into the text.
std::vector<std::string_view> values_of(std::string_view text);

/// A tag as one number: (0028,0010) is 0x00280010.
using DicomTag = std::uint32_t;

/// How elements and numbers are encoded.
struct DicomEncoding {
    bool explicit_vr = true;
    bool big_endian = false;
};

/// A data set: elements by tag. Their values are views into the file's bytes.
class DicomDataSet {
  public:
    /// An element's bytes; empty if it is absent.
    std::string_view bytes(DicomTag tag) const;
    bool has(DicomTag tag) const { return elements_.contains(tag); }
    /// Text without padding.
    std::string text(DicomTag tag) const;
    /// The number in an element with VR US.
    std::optional<int> unsigned_short(DicomTag tag) const;
    /// The numbers in an element with VR US or AT, UL, FL or FD, after the type.
    template <class T>
    std::vector<T> numbers(DicomTag tag) const;
    /// The numbers in a decimal string "1\2\3". No value unless there are exactly `count` finite numbers.
    std::optional<std::vector<double>> decimals(DicomTag tag, std::size_t count) const;
    std::optional<double> decimal(DicomTag tag) const;
    /// The items of a sequence. \throw InputError it is damaged
    std::vector<DicomDataSet> items(DicomTag tag) const;

  private:
    friend class DicomParser;
    struct Element {
        std::string_view value;
        DicomEncoding encoding;
    };
    std::map<DicomTag, Element> elements_;
};

/// A parsed file. It cannot be copied: the data set points into its bytes.
struct ParsedDicom {
    ParsedDicom() = default;
    ParsedDicom(ParsedDicom&&) = default;
    ParsedDicom& operator=(ParsedDicom&&) = default;

    std::uint64_t file_size = 0;
    Buffer<char> bytes;  ///< of the file; inflated if it was deflated
    std::string transfer_syntax;
    DicomEncoding encoding;
    DicomDataSet data_set;
    /// Offset of the pixel data in `bytes`; 0 if there are none.
    std::size_t pixels_at = 0;
    /// Size of the pixel data. No value if they are compressed, in fragments.
    std::optional<std::size_t> pixels_size;
    bool pixels_are_words = false;  ///< 16-bit words in the file's byte order
};

/// Whether a file with these first bytes (132, or all if it is shorter) looks like DICOM. The preamble may be
/// missing.
bool is_dicom(std::string_view head);

/// Parses a file up to its pixel data. \throw IoError; InputError it is not DICOM, or damaged
ParsedDicom parse_dicom_header(const std::filesystem::path& path);

/// Parses a file; the result holds all its bytes, in `memory` of an earlier file.
/// \throw the errors of parse_dicom_header
ParsedDicom parse_dicom(const std::filesystem::path& path, Buffer<char> memory = {});

/// Joins the fragments of the compressed streams of all frames.
/// \throw InputError they are damaged; the message continues a file name
std::vector<std::string> compressed_frames(const ParsedDicom& file, std::size_t frames);

}  // namespace marrow::internal::io
