// Detects the format of an image file and calls its decoder.
#include "image_file.h"

#include <fmt/format.h>

#include <marrow/error.h>

#include "base/checked_size.h"
#include "image_decoders.h"
#include "io/bytes/byte_stream.h"
#include "io/bytes/text.h"

namespace marrow::internal::io {

namespace {

bool is_png(std::string_view head) {
    return head.starts_with("\x89PNG\r\n\x1a\n");
}
bool is_jpeg(std::string_view head) {
    return head.starts_with("\xff\xd8\xff");
}
bool is_bmp(std::string_view head) {
    using namespace std::string_view_literals;
    return head.starts_with("BM") && head.size() >= 10 && head.substr(6, 4) == "\0\0\0\0"sv;
}

}  // namespace

bool is_tiff(std::string_view head) {
    using namespace std::string_view_literals;
    return head.starts_with("II*\0"sv) || head.starts_with("MM\0*"sv) || head.starts_with("II+\0"sv) ||
           head.starts_with("MM\0+"sv);
}

bool is_image_file(std::string_view head) {
    return is_png(head) || is_tiff(head) || is_jpeg(head) || is_bmp(head);
}

void keep_grey(const Bytes& from, std::size_t count, int channels, SampleType type, unsigned char* to) {
    if (type == SampleType::uint8)
        keep_grey(from.data(), count, channels, to);
    else
        keep_grey(reinterpret_cast<const std::uint16_t*>(from.data()), count, channels,
                  reinterpret_cast<std::uint16_t*>(to));
}

Bytes file_bytes(const std::filesystem::path& path) {
    Bytes out(checked_size(regular_file_size(path)));
    ByteStream(path, Compression::none).read(out.data(), out.size());
    return out;
}

namespace {

ImageHeader read_image(const std::filesystem::path& path, const ImageTarget& target) {
    const std::string head = read_head(path, 16);
    try {
        ImageHeader out;
        if (is_png(head))
            out = read_png(path, target);
        else if (is_tiff(head))
            out = read_tiff(path, target);
        else if (is_jpeg(head))
            out = read_jpeg(path, target);
        else if (is_bmp(head))
            out = read_bmp(path, target);
        else
            throw UnreadableImage{"is not a PNG, TIFF, JPEG or BMP image"};
        // No supported compression turns one byte into more than 2000, and uint32 becomes twice as long.
        if (static_cast<double>(out.columns) * static_cast<double>(out.rows) *
                static_cast<double>(out.pages) * static_cast<double>(sample_size(out.type)) >
            4000.0 * static_cast<double>(regular_file_size(path))) {
            throw UnreadableImage{"claims more samples than it can hold"};
        }
        return out;
    } catch (const UnreadableImage& error) {
        fail<InputError>(path, "{}", error.why);
    } catch (const std::bad_alloc&) {
        fail<LimitError>(path, "the image does not fit in memory");
    }
}

}  // namespace

ImageHeader read_image_header(const std::filesystem::path& path) {
    return read_image(path, {});
}

bool read_image(const std::filesystem::path& path, const ImageHeader& expected, void* to, const Step& step) {
    bool paged = false;
    const Step page = [&](double part) {
        paged = true;
        step(part);
    };
    if (read_image(path, {&expected, to, &page}) != expected) return false;
    if (!paged) step(1);
    return true;
}

}  // namespace marrow::internal::io
