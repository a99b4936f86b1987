// The elements of a DICOM file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <marrow/buffer.h>

namespace marrow {

/// A tag as one number: (0028,0010) is 0x00280010.
using DicomTag = std::uint32_t;

/// How numbers and elements are written.
struct DicomEncoding {
    bool explicit_vr = true;
    bool big_endian = false;
};

/// A data set: elements by tag, their values as views into the file's bytes.
class DicomSet {
  public:
    /// An element's bytes; empty where it is absent.
    std::string_view bytes(DicomTag tag) const;
    bool has(DicomTag tag) const { return elements_.contains(tag); }
    /// Text without padding.
    std::string text(DicomTag tag) const;
    /// The number of an element of VR US.
    std::optional<int> unsigned_short(DicomTag tag) const;
    /// The numbers of a decimal string "1\2\3"; nothing where there are not exactly `count` finite ones.
    std::optional<std::vector<double>> decimals(DicomTag tag, std::size_t count) const;
    std::optional<double> decimal(DicomTag tag) const;
    /// The items of a sequence. \throw InputError where it is damaged.
    std::vector<DicomSet> items(DicomTag tag) const;

  private:
    friend class DicomParser;
    struct Element {
        std::string_view value;
        DicomEncoding encoding;
    };
    std::map<DicomTag, Element> elements_;
};

/// A file. Moves, but does not copy: the set looks into its bytes.
struct DicomBytes {
    DicomBytes() = default;
    DicomBytes(DicomBytes&&) = default;
    DicomBytes& operator=(DicomBytes&&) = default;

    Buffer<char> bytes;  ///< of the file, or what a deflated file inflates to
    std::string transfer_syntax;
    DicomEncoding encoding;
    DicomSet set;
    /// Where the pixel data begin in `bytes`, as far as they are there; 0: nowhere.
    std::size_t pixels_at = 0;
    /// Their bytes; nothing where they come in fragments, as compressed ones do.
    std::optional<std::size_t> pixels_size;
    bool pixels_are_words = false;  ///< of 16 bits, in the file's byte order
};

/// True where the first bytes (132 where there are so many) look like DICOM, with or without a preamble.
bool is_dicom(std::string_view head);

/// Parses a file up to its pixel data. \throw IoError; InputError where it is not DICOM or damaged.
DicomBytes parse_dicom_header(const std::filesystem::path& path);

/// Parses a file; `bytes` holds all of it, in `memory` that had another use before.
/// \throw as parse_dicom_header.
DicomBytes parse_dicom(const std::filesystem::path& path, Buffer<char> memory = {});

/// The compressed streams of `frames` frames, put together from their fragments.
/// \throw InputError where they are damaged, in words that go after the file's name.
std::vector<std::string> compressed_frames(const DicomBytes& file, std::size_t frames);

}  // namespace marrow
