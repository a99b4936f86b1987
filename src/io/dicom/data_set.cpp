// Parses DICOM files without trusting any length in them.
#include "data_set.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include <marrow/error.h>

#include "base/checked_size.h"
#include "io/bytes/byte_stream.h"
#include "io/bytes/text.h"
#include "tags.h"

namespace marrow::internal::io {

namespace {

constexpr DicomTag kItem = 0xfffee000, kItemEnd = 0xfffee00d, kSequenceEnd = 0xfffee0dd;
constexpr std::uint32_t kUndefinedLength = 0xffffffff;
constexpr int kDeepestNesting = 32;

struct Damaged {};              // the bytes are not a data set
struct NeedsMore : Damaged {};  // the bytes end before the data set

bool is_vr(std::string_view two) {
    return two.size() == 2 && two[0] >= 'A' && two[0] <= 'Z' && two[1] >= 'A' && two[1] <= 'Z';
}

}  // namespace

// Iterates over elements and checks each length.
class DicomParser {
  public:
    DicomParser(std::string_view bytes, DicomEncoding encoding, std::size_t at = 0)
        : bytes_(bytes), encoding_(encoding), at_(at) {}

    struct Header {
        DicomTag tag = 0;
        std::string_view vr;
        std::uint32_t length = 0;
    };

    bool at_end() const { return at_ == bytes_.size(); }
    std::size_t at() const { return at_; }

    Header header() {
        Header h;
        need(8);
        h.tag = number(2) << 16;
        h.tag |= number(2);
        if (h.tag >> 16 == 0xfffe || !encoding_.explicit_vr) {
            h.length = number(4);
            return h;
        }
        h.vr = bytes_.substr(at_, 2);
        if (!is_vr(h.vr)) throw Damaged();
        at_ += 2;
        static constexpr std::array long_vrs = {"OB", "OD", "OF", "OL", "OV", "OW", "SQ",
                                                "SV", "UC", "UN", "UR", "UT", "UV"};
        if (std::find(long_vrs.begin(), long_vrs.end(), h.vr) == long_vrs.end()) {
            h.length = number(2);
        } else {
            need(6);
            at_ += 2;
            h.length = number(4);
        }
        return h;
    }

    // Returns the value of an element of known or undefined length, and moves past it.
    DicomDataSet::Element value(const Header& h, int depth) {
        DicomDataSet::Element out{{}, encoding_};
        const std::size_t begin = at_;
        // A value of unknown VR is encoded without VRs, in any transfer syntax: PS3.5, 6.2.2.
        if (h.vr == "UN") out.encoding = {false, false};
        if (h.length == kUndefinedLength) {
            DicomParser inner(bytes_, out.encoding, at_);
            at_ = inner.skip_items(depth + 1);
            out.value = bytes_.substr(begin, at_ - begin);
        } else {
            need(h.length);
            at_ += h.length;
            out.value = bytes_.substr(begin, h.length);
        }
        return out;
    }

    // Returns the elements up to the end, the pixel data, the end of an item, or the end of the group
    // `only_group`.
    DicomDataSet data_set(int depth, std::optional<std::uint32_t> only_group = {}) {
        if (depth > kDeepestNesting) throw Damaged();
        DicomDataSet out;
        while (!at_end()) {
            if (only_group) {  // the next group may have another encoding
                need(2);
                if (number_at(bytes_, at_, 2, encoding_.big_endian) != *only_group) break;
            }
            const std::size_t begin = at_;
            const Header h = header();
            if (h.tag == kItemEnd && depth > 0) break;
            if (h.tag == tag::kPixelData && depth == 0) {
                pixels_ = h;
                break;
            }
            if (h.tag >> 16 == 0xfffe) {
                if (depth == 0) throw Damaged();
                at_ = begin;
                break;
            }
            out.elements_.emplace(h.tag, value(h, depth));
        }
        return out;
    }

    // Calls `f` for each item of a sequence, with a parser at its first element.
    template <class F>
    void items(int depth, F&& f) {
        while (!at_end()) {
            const Header h = header();
            if (h.tag == kSequenceEnd) return;
            if (h.tag != kItem) throw Damaged();
            if (h.length == kUndefinedLength) {
                f(*this, depth);
            } else {
                need(h.length);
                DicomParser inner(bytes_.substr(0, at_ + h.length), encoding_, at_);
                f(inner, depth);
                at_ += h.length;
            }
        }
    }

    const std::optional<Header>& pixels() const { return pixels_; }

  private:
    // Returns the offset after the delimiter of a sequence of undefined length.
    std::size_t skip_items(int depth) {
        if (depth > kDeepestNesting) throw Damaged();
        for (;;) {
            const Header h = header();
            if (h.tag == kSequenceEnd) return at_;
            if (h.tag != kItem) throw Damaged();
            if (h.length != kUndefinedLength) {
                need(h.length);
                at_ += h.length;
                continue;
            }
            for (;;) {
                const Header e = header();
                if (e.tag == kItemEnd) break;
                value(e, depth);
            }
        }
    }

    void need(std::size_t count) const {
        if (bytes_.size() - at_ < count) throw NeedsMore();
    }
    std::uint32_t number(std::size_t size) {
        const std::uint32_t out = number_at(bytes_, at_, size, encoding_.big_endian);
        at_ += size;
        return out;
    }

    std::string_view bytes_;
    DicomEncoding encoding_;
    std::size_t at_;
    std::optional<Header> pixels_;
};

std::vector<std::string_view> values_of(std::string_view text) {
    std::vector<std::string_view> out;
    for (std::size_t at = 0; at <= text.size(); at += out.back().size() + 1)
        out.push_back(text.substr(at, text.find('\\', at) - at));
    return out;
}

std::string_view DicomDataSet::bytes(DicomTag tag) const {
    const auto at = elements_.find(tag);
    return at == elements_.end() ? std::string_view() : at->second.value;
}

std::string DicomDataSet::text(DicomTag tag) const {
    std::string_view value = bytes(tag);
    while (!value.empty() && value.back() == '\0') value.remove_suffix(1);
    return std::string(trimmed(value));
}

template <class T>
std::vector<T> DicomDataSet::numbers(DicomTag tag) const {
    const auto at = elements_.find(tag);
    if (at == elements_.end()) return {};
    std::string_view value = at->second.value;
    std::vector<T> out;
    for (; value.size() >= sizeof(T); value.remove_prefix(sizeof(T))) {
        std::array<char, sizeof(T)> bytes;
        std::copy_n(value.begin(), sizeof(T), bytes.begin());
        if (at->second.encoding.big_endian != (std::endian::native == std::endian::big))
            std::reverse(bytes.begin(), bytes.end());
        out.push_back(std::bit_cast<T>(bytes));
    }
    return out;
}
template std::vector<std::uint16_t> DicomDataSet::numbers(DicomTag tag) const;
template std::vector<std::uint32_t> DicomDataSet::numbers(DicomTag tag) const;
template std::vector<float> DicomDataSet::numbers(DicomTag tag) const;
template std::vector<double> DicomDataSet::numbers(DicomTag tag) const;

std::optional<int> DicomDataSet::unsigned_short(DicomTag tag) const {
    const auto all = numbers<std::uint16_t>(tag);
    return all.empty() ? std::nullopt : std::optional<int>(all[0]);
}

std::optional<std::vector<double>> DicomDataSet::decimals(DicomTag tag, std::size_t count) const {
    const std::string value = text(tag);
    std::vector<double> out;
    for (const std::string_view part : values_of(value)) {
        const auto one = parse_double(part);
        if (!one || !std::isfinite(*one)) return {};
        out.push_back(*one);
    }
    if (out.size() != count) return {};
    return out;
}

std::optional<double> DicomDataSet::decimal(DicomTag tag) const {
    const auto one = decimals(tag, 1);
    return one ? std::optional((*one)[0]) : std::nullopt;
}

std::vector<DicomDataSet> DicomDataSet::items(DicomTag tag) const {
    std::vector<DicomDataSet> out;
    const auto at = elements_.find(tag);
    if (at == elements_.end()) return out;
    try {
        DicomParser parser(at->second.value, at->second.encoding);
        parser.items(1, [&](DicomParser& item, int depth) { out.push_back(item.data_set(depth)); });
    } catch (const Damaged&) {
        throw InputError(fmt::format("a DICOM sequence ({:04x},{:04x}) is damaged", tag >> 16, tag & 0xffff));
    }
    return out;
}

bool is_dicom(std::string_view head) {
    if (head.size() >= 132 && head.substr(128, 4) == "DICM") return true;
    // Without a preamble, a data set begins with a low element of group 0002 or 0008, in either byte order.
    if (head.size() < 8) return false;
    for (const bool big : {false, true}) {
        const std::uint32_t group = number_at(head, 0, 2, big), element = number_at(head, 2, 2, big);
        if ((group == 2 || group == 8) && element <= 0x20) return true;
    }
    return false;
}

namespace {

// Guesses the encoding from the first element, for files that name no transfer syntax of the standard.
DicomEncoding guess_encoding(std::string_view bytes, std::size_t at) {
    if (bytes.size() - at < 8) throw NeedsMore();
    return {is_vr(bytes.substr(at + 4, 2)), number_at(bytes, at, 2, false) > 0xff};
}

// Inflates a deflated data set, which starts at offset `at` of the file.
Buffer<char> inflate_data_set(const std::filesystem::path& path, std::size_t at) {
    constexpr std::size_t kMost = std::size_t{1} << 30;
    ByteStream stream(path, Compression::deflate, at);
    Buffer<char> out;
    for (std::size_t step = 1 << 16;; step = out.size()) {
        const std::size_t before = out.size();
        if (before + step > kMost) fail<LimitError>(path, "inflates to more than 1 GiB");
        out.resize(before + step);
        out.resize(before + stream.read_some(out.data() + before, step));
        if (out.size() < before + step) {
            stream.verify_end();
            return out;
        }
    }
}

// Parses `file.bytes`, which may be only the start of the file. \throw NeedsMore; Damaged
void parse(ParsedDicom& file, const std::filesystem::path& path) {
    std::string_view bytes(file.bytes.data(), file.bytes.size());
    std::size_t at = bytes.size() >= 132 && bytes.substr(128, 4) == "DICM" ? 132 : 0;
    if (bytes.size() - at >= 4 && number_at(bytes, at, 2, false) == 2) {
        DicomParser meta(bytes, {true, false}, at);
        file.transfer_syntax = meta.data_set(0, 2).text(tag::kTransferSyntaxUid);
        at = meta.at();
    }
    if (file.transfer_syntax == "1.2.840.10008.1.2.1.99") {  // deflated, without a zlib header
        file.bytes = inflate_data_set(path, at);
        bytes = {file.bytes.data(), file.bytes.size()};
        at = 0;
        file.encoding = {true, false};
    } else if (file.transfer_syntax == "1.2.840.10008.1.2") {
        file.encoding = {false, false};
    } else if (file.transfer_syntax.starts_with("1.2.840.10008.1.2.")) {
        file.encoding = {true, file.transfer_syntax == "1.2.840.10008.1.2.2"};
    } else {
        file.encoding = guess_encoding(bytes, at);
    }
    DicomParser parser(bytes, file.encoding, at);
    file.data_set = parser.data_set(0);
    if (const auto& pixels = parser.pixels()) {
        file.pixels_at = parser.at();
        file.pixels_are_words = pixels->vr == "OW" || !file.encoding.explicit_vr;
        if (pixels->length != kUndefinedLength) file.pixels_size = pixels->length;
    }
}

// Parses the first bytes of a file, at most `most`. \throw NeedsMore; IoError; InputError
ParsedDicom parse_head(const std::filesystem::path& path, std::uint64_t most, Buffer<char> memory) {
    ParsedDicom file;
    file.file_size = regular_file_size(path);
    file.bytes = std::move(memory);
    file.bytes.resize(checked_size(std::min(most, file.file_size)));
    ByteStream(path, Compression::none).read(file.bytes.data(), file.bytes.size());
    try {
        parse(file, path);
    } catch (const NeedsMore&) {
        throw;
    } catch (const Damaged&) {
        fail<InputError>(path, "is not a DICOM file, or it is damaged");
    }
    return file;
}

}  // namespace

ParsedDicom parse_dicom(const std::filesystem::path& path, Buffer<char> memory) {
    try {
        return parse_head(path, ~std::uint64_t{0}, std::move(memory));
    } catch (const NeedsMore&) {
        fail<InputError>(path, "the DICOM file is truncated or damaged");
    }
}

ParsedDicom parse_dicom_header(const std::filesystem::path& path) {
    constexpr std::uint64_t kUsualHeader = 1 << 14;
    try {
        ParsedDicom file = parse_head(path, kUsualHeader, {});
        if (file.pixels_at > 0 || file.file_size <= kUsualHeader) return file;
    } catch (const NeedsMore&) {
    }
    return parse_dicom(path);
}

namespace {

struct Fragments {
    std::string_view offset_table;
    std::vector<std::string_view> parts;
    std::vector<std::size_t> starts;  // offsets of their items, relative as in the offset table
};

Fragments fragments(const ParsedDicom& file) {
    const std::string_view bytes(file.bytes.data(), file.bytes.size());
    Fragments out;
    try {
        DicomParser parser(bytes, {false, false}, file.pixels_at);
        std::size_t first = 0;
        for (bool table = true;; table = false) {
            const std::size_t start = parser.at();
            const auto h = parser.header();
            if (h.tag == kSequenceEnd && !table) return out;
            if (h.tag != kItem || h.length == kUndefinedLength) throw Damaged();
            const std::string_view value = parser.value(h, 0).value;
            if (table) {
                out.offset_table = value;
                first = parser.at();
            } else {
                out.parts.push_back(value);
                out.starts.push_back(start - first);
            }
        }
    } catch (const NeedsMore&) {
        throw InputError("its pixel data are truncated");
    } catch (const Damaged&) {
        throw InputError("its pixel data are damaged");
    }
}

}  // namespace

std::vector<std::string> compressed_frames(const ParsedDicom& file, std::size_t frames) {
    const Fragments all = fragments(file);
    if (all.parts.empty()) throw InputError("has no pixels");
    std::vector<std::string> out(frames);
    const bool one_each = all.parts.size() == frames;
    if (frames > 1 && !one_each && all.offset_table.size() != 4 * frames) {
        throw InputError(fmt::format(
            "has {} frames in {} fragments without an offset table; decompress it with another program first",
            frames, all.parts.size()));
    }
    std::size_t frame = 0;
    for (std::size_t i = 0; i < all.parts.size(); ++i) {
        if (one_each) {
            frame = i;
        } else if (frames > 1 && frame + 1 < frames &&
                   all.starts[i] == number_at(all.offset_table, 4 * (frame + 1), 4, false)) {
            ++frame;
        }
        out[frame] += all.parts[i];
    }
    if (frame + 1 != frames) throw InputError("its offset table does not match its pixel data");
    return out;
}

}  // namespace marrow::internal::io
