#include "data_set.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include <marrow/error.h>

#include "io/bytes/byte_stream.h"
#include "io/bytes/text.h"

namespace marrow {

namespace {

constexpr DicomTag transfer_syntax_uid = 0x00020010, pixel_data = 0x7fe00010;
constexpr DicomTag item_start = 0xfffee000, item_end = 0xfffee00d, sequence_end = 0xfffee0dd;
constexpr std::uint32_t undefined_length = 0xffffffff;
constexpr int deepest_nesting = 32;

struct Damaged {};    // the bytes are not a data set
struct NeedsMore {};  // they end before the data set does

std::uint32_t number_at(std::string_view bytes, std::size_t at, std::size_t size, bool big_endian) {
    std::uint32_t out = 0;
    for (std::size_t i = 0; i < size; ++i) {
        const auto byte = static_cast<unsigned char>(bytes[at + (big_endian ? i : size - 1 - i)]);
        out = out << 8 | byte;
    }
    return out;
}

bool is_vr(std::string_view two) {
    return two.size() == 2 && two[0] >= 'A' && two[0] <= 'Z' && two[1] >= 'A' && two[1] <= 'Z';
}

}  // namespace

// Walks over elements without trusting a length.
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

    // The value of an element of known or undefined length; walks past it.
    DicomSet::Element value(const Header& h, int depth) {
        DicomSet::Element out{{}, encoding_};
        const std::size_t begin = at_;
        if (h.length == undefined_length) {
            // what comes with an unknown VR and length is written without VRs
            if (h.vr == "UN") out.encoding = {false, false};
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

    // The elements up to the end, the pixel data, an item's end, or the end of group `only_group` where that
    // is not 0.
    DicomSet set(int depth, std::uint32_t only_group = 0) {
        if (depth > deepest_nesting) throw Damaged();
        DicomSet out;
        while (!at_end()) {
            if (only_group != 0) {  // what follows may be encoded otherwise
                need(2);
                if (number_at(bytes_, at_, 2, encoding_.big_endian) != only_group) break;
            }
            const std::size_t begin = at_;
            const Header h = header();
            if (h.tag == item_end && depth > 0) break;
            if (h.tag == pixel_data && depth == 0) {
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

    // Calls `f` for each item of a sequence, with its parser at its elements.
    template <class F>
    void items(int depth, F&& f) {
        while (!at_end()) {
            const Header h = header();
            if (h.tag == sequence_end) return;
            if (h.tag != item_start) throw Damaged();
            if (h.length == undefined_length) {
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
    // Past the delimiter of a sequence of undefined length.
    std::size_t skip_items(int depth) {
        if (depth > deepest_nesting) throw Damaged();
        for (;;) {
            const Header h = header();
            if (h.tag == sequence_end) return at_;
            if (h.tag != item_start) throw Damaged();
            if (h.length != undefined_length) {
                need(h.length);
                at_ += h.length;
                continue;
            }
            for (;;) {
                const Header e = header();
                if (e.tag == item_end) break;
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

std::string_view DicomSet::bytes(DicomTag tag) const {
    const auto at = elements_.find(tag);
    return at == elements_.end() ? std::string_view() : at->second.value;
}

std::string DicomSet::text(DicomTag tag) const {
    std::string_view value = bytes(tag);
    while (!value.empty() && value.back() == '\0') value.remove_suffix(1);
    return std::string(trimmed(value));
}

std::optional<int> DicomSet::unsigned_short(DicomTag tag) const {
    const auto at = elements_.find(tag);
    if (at == elements_.end() || at->second.value.size() < 2) return {};
    return static_cast<int>(number_at(at->second.value, 0, 2, at->second.encoding.big_endian));
}

std::optional<std::vector<double>> DicomSet::decimals(DicomTag tag, std::size_t count) const {
    const std::string value = text(tag);
    std::vector<double> out;
    for (std::size_t at = 0; !value.empty() && at <= value.size();) {
        const std::size_t end = std::min(value.find('\\', at), value.size());
        const auto one = number(std::string_view(value).substr(at, end - at));
        if (!one || !std::isfinite(*one)) return {};
        out.push_back(*one);
        at = end + 1;
    }
    if (out.size() != count) return {};
    return out;
}

std::optional<double> DicomSet::decimal(DicomTag tag) const {
    const auto one = decimals(tag, 1);
    return one ? std::optional((*one)[0]) : std::nullopt;
}

std::vector<DicomSet> DicomSet::items(DicomTag tag) const {
    std::vector<DicomSet> out;
    const auto at = elements_.find(tag);
    if (at == elements_.end()) return out;
    try {
        DicomParser parser(at->second.value, at->second.encoding);
        parser.items(1, [&](DicomParser& item, int depth) { out.push_back(item.set(depth)); });
    } catch (const NeedsMore&) {
        throw InputError(fmt::format("a DICOM sequence ({:04x},{:04x}) is damaged", tag >> 16, tag & 0xffff));
    } catch (const Damaged&) {
        throw InputError(fmt::format("a DICOM sequence ({:04x},{:04x}) is damaged", tag >> 16, tag & 0xffff));
    }
    return out;
}

bool is_dicom(std::string_view head) {
    if (head.size() >= 132 && head.substr(128, 4) == "DICM") return true;
    // Without a preamble a data set begins with a small element of group 0002 or 0008, in either byte order.
    if (head.size() < 8) return false;
    for (const bool big : {false, true}) {
        const std::uint32_t group = number_at(head, 0, 2, big), element = number_at(head, 2, 2, big);
        if ((group == 2 || group == 8) && element <= 0x20) return true;
    }
    return false;
}

namespace {

// The encoding that the first element betrays, where no transfer syntax is named.
DicomEncoding guessed(std::string_view bytes, std::size_t at) {
    if (bytes.size() - at < 8) throw NeedsMore();
    return {is_vr(bytes.substr(at + 4, 2)), number_at(bytes, at, 2, false) > 0xff};
}

// What a deflated data set inflates to, from `at` in the file.
Buffer<char> inflated(const std::filesystem::path& path, std::size_t at) {
    constexpr std::size_t most = std::size_t{1} << 30;
    ByteStream stream(path, Compression::deflate, at);
    Buffer<char> out;
    for (std::size_t step = 1 << 16;; step = out.size()) {
        const std::size_t before = out.size();
        if (before + step > most)
            throw LimitError(fmt::format("{}: inflates to more than 1 GiB", shown(path)));
        out.resize(before + step);
        out.resize(before + stream.read_some(out.data() + before, step));
        if (out.size() < before + step) {
            stream.verify_end();
            return out;
        }
    }
}

// Parses what of the file is in `file.bytes`. \throw NeedsMore, Damaged
void parse(DicomBytes& file, const std::filesystem::path& path) {
    std::string_view bytes(file.bytes.data(), file.bytes.size());
    std::size_t at = bytes.size() >= 132 && bytes.substr(128, 4) == "DICM" ? 132 : 0;
    if (bytes.size() - at >= 4 && number_at(bytes, at, 2, false) == 2) {
        DicomParser meta(bytes, {true, false}, at);
        file.transfer_syntax = meta.set(0, 2).text(transfer_syntax_uid);
        at = meta.at();
    }
    if (file.transfer_syntax == "1.2.840.10008.1.2.1.99") {  // deflated, without zlib's header
        file.bytes = inflated(path, at);
        bytes = {file.bytes.data(), file.bytes.size()};
        at = 0;
        file.encoding = {true, false};
    } else if (file.transfer_syntax.empty()) {
        file.encoding = guessed(bytes, at);
    } else {
        file.encoding = {file.transfer_syntax != "1.2.840.10008.1.2",
                         file.transfer_syntax == "1.2.840.10008.1.2.2"};
    }
    DicomParser parser(bytes, file.encoding, at);
    file.set = parser.set(0);
    if (const auto& pixels = parser.pixels()) {
        file.pixels_at = parser.at();
        file.pixels_are_words = pixels->vr == "OW" || !file.encoding.explicit_vr;
        if (pixels->length != undefined_length) file.pixels_size = pixels->length;
    }
}

}  // namespace

namespace {

// Parses the first `size` bytes of a file.
DicomBytes parse_head(const std::filesystem::path& path, std::size_t size, Buffer<char> memory) {
    DicomBytes file;
    file.bytes = std::move(memory);
    file.bytes.resize(size);
    ByteStream(path, Compression::none).read(file.bytes.data(), size);
    try {
        parse(file, path);
    } catch (const Damaged&) {
        throw InputError(fmt::format("{}: is not a DICOM file, or a damaged one", shown(path)));
    }
    return file;
}

}  // namespace

DicomBytes parse_dicom(const std::filesystem::path& path, Buffer<char> memory) {
    try {
        return parse_head(path, size_of_file(path), std::move(memory));
    } catch (const NeedsMore&) {
        throw InputError(fmt::format("{}: the DICOM file is truncated or damaged", shown(path)));
    }
}

DicomBytes parse_dicom_header(const std::filesystem::path& path) {
    constexpr std::size_t usual_header = 1 << 14;
    if (size_of_file(path) > usual_header) {
        try {
            DicomBytes file = parse_head(path, usual_header, {});
            if (file.pixels_at > 0) return file;
        } catch (const NeedsMore&) {
        }
    }
    return parse_dicom(path);
}

namespace {

struct Fragments {
    std::string_view offset_table;
    std::vector<std::string_view> parts;
    std::vector<std::size_t> starts;  // of their items, counted as the offset table does
};

Fragments fragments(const DicomBytes& file) {
    const std::string_view bytes(file.bytes.data(), file.bytes.size());
    Fragments out;
    try {
        DicomParser parser(bytes, {false, false}, file.pixels_at);
        std::size_t first = 0;
        for (bool table = true;; table = false) {
            const std::size_t start = parser.at();
            const auto h = parser.header();
            if (h.tag == sequence_end && !table) return out;
            if (h.tag != item_start || h.length == undefined_length) throw Damaged();
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

std::vector<std::string> compressed_frames(const DicomBytes& file, std::size_t frames) {
    const Fragments all = fragments(file);
    if (all.parts.empty()) throw InputError("has no pixels");
    std::vector<std::string> out(frames);
    const bool one_each = all.parts.size() == frames;
    if (frames > 1 && !one_each && all.offset_table.size() != 4 * frames) {
        throw InputError(
            fmt::format("has {} frames in {} fragments and no table of which belong together; decompress it "
                        "with another program first",
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
    if (frame + 1 != frames) throw InputError("its table of frames does not fit its pixel data");
    return out;
}

}  // namespace marrow
