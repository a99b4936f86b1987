/// The decoders of the image formats, and what they share.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "image_file.h"

namespace marrow::internal::io {

using Bytes = std::vector<unsigned char>;

/// The decoders throw this; read_image makes it an InputError with the file's name.
struct UnreadableImage {
    std::string why;
};
inline const UnreadableImage kDamaged{"the image is damaged or truncated"};
inline const UnreadableImage kInColour{"is in colour; only grey images are supported, so convert it first"};
inline const UnreadableImage kTransparent{"is partly transparent; save it without transparency"};
inline const UnreadableImage kOddSamples{"has an unsupported sample type; save it in grey with 8 or 16 bits"};

/// Where a decoder writes samples. Without memory it only reads the header.
struct ImageTarget {
    const ImageHeader* expected = nullptr;
    void* to = nullptr;
    const Step* step = nullptr;  ///< called after each page of a TIFF file

    /// Whether to decode. A file that changed since its header was read must not be written beyond the
    /// memory.
    bool takes(const ImageHeader& header) const { return to && header == *expected; }
    unsigned char* bytes() const { return static_cast<unsigned char*>(to); }
};

/// Copies one of several equal channels; many programs save grey images like this. The last of an even number
/// of channels is opacity. \throw UnreadableImage the channels differ, or the image is transparent
template <class T>
void keep_grey(const T* from, std::size_t count, int channels, T* to) {
    for (std::size_t i = 0; i < count; ++i, from += channels) {
        if (channels >= 3 && (from[1] != from[0] || from[2] != from[0])) throw kInColour;
        if (channels % 2 == 0 && from[channels - 1] != std::numeric_limits<T>::max()) throw kTransparent;
        to[i] = from[0];
    }
}
void keep_grey(const Bytes& from, std::size_t count, int channels, SampleType type, unsigned char* to);

/// The bytes of a file. \throw IoError
Bytes file_bytes(const std::filesystem::path& path);

/// Each returns the header, and writes the samples if the target takes them.
/// \throw UnreadableImage; IoError; LimitError not enough memory
ImageHeader read_png(const std::filesystem::path& path, const ImageTarget& target);
ImageHeader read_jpeg(const std::filesystem::path& path, const ImageTarget& target);
ImageHeader read_tiff(const std::filesystem::path& path, const ImageTarget& target);
ImageHeader read_bmp(const std::filesystem::path& path, const ImageTarget& target);

}  // namespace marrow::internal::io
