// Converts the text of DICOM files to UTF-8 by the decoders that JavaScript has.
#include "io/dicom/character_set.h"

#include <emscripten.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <memory>
#include <string_view>
#include <vector>

namespace marrow::internal::io {
namespace {

// Returns the text in memory of malloc, or null if it is not in the encoding.
EM_JS(char*, marrow_decode, (const char* text, unsigned size, const char* encoding), {
    try {
        // Decoders do not take shared memory: slice() copies.
        const decoded =
            new TextDecoder(UTF8ToString(encoding), {fatal : true}).decode(HEAPU8.slice(text, text + size));
        const bytes = lengthBytesUTF8(decoded) + 1;
        const copy = _malloc(bytes);
        if (copy) stringToUTF8(decoded, copy, bytes);
        return copy;
    } catch (error) {
        return 0;
    }
});

constexpr char kEscape = '\x1b';
constexpr std::string_view kDelimiters = "\\^=";  // of values and of the parts of names

struct CharacterSet {
    std::string_view number;  // in the register of ISO, which SpecificCharacterSet names it by
    std::string_view escape;  // what changes to it within a text, after ESC
    const char* encoding;     // that of JavaScript; null for ASCII
};

// PS3.3, C.12.1.1.2 and C.12.1.1.3. The first is the default.
constexpr std::array kSets{CharacterSet{"6", "(B", nullptr},         CharacterSet{"100", "-A", "iso-8859-1"},
                           CharacterSet{"101", "-B", "iso-8859-2"},  CharacterSet{"109", "-C", "iso-8859-3"},
                           CharacterSet{"110", "-D", "iso-8859-4"},  CharacterSet{"144", "-L", "iso-8859-5"},
                           CharacterSet{"127", "-G", "iso-8859-6"},  CharacterSet{"126", "-F", "iso-8859-7"},
                           CharacterSet{"138", "-H", "iso-8859-8"},  CharacterSet{"148", "-M", "iso-8859-9"},
                           CharacterSet{"203", "-b", "iso-8859-15"}, CharacterSet{"166", "-T", "windows-874"},
                           CharacterSet{"13", ")I", "shift_jis"},    CharacterSet{"13", "(J", nullptr},
                           CharacterSet{"87", "$B", "euc-jp"},       CharacterSet{"159", "$(D", "euc-jp"},
                           CharacterSet{"149", "$)C", "euc-kr"},     CharacterSet{"58", "$)A", "gb18030"}};

// The sets without escape sequences, in which a byte of the lower half may belong to a longer character.
struct WholeEncoding {
    std::string_view term;
    const char* encoding;
};
constexpr std::array kWholeEncodings{WholeEncoding{"ISO_IR 192", "utf-8"},
                                     WholeEncoding{"GB18030", "gb18030"}, WholeEncoding{"GBK", "gbk"}};

bool is_high(char c) {
    return (c & 0x80) != 0;
}

// Whether a set is that of bytes of the upper half, ISO 2022's G1; the others are G0.
bool is_upper(const CharacterSet& set) {
    return set.escape.starts_with('-') || set.escape.find(')') != std::string_view::npos;
}

std::string_view trimmed(std::string_view text) {
    constexpr std::string_view kPadding(" \0", 2);
    const std::size_t first = text.find_first_not_of(kPadding);
    return first == text.npos ? std::string_view()
                              : text.substr(first, text.find_last_not_of(kPadding) - first + 1);
}

// The set that a value of SpecificCharacterSet names, or null.
const CharacterSet* set_named(std::string_view term) {
    if (term.empty()) return &kSets.front();
    for (const std::string_view prefix : {"ISO_IR ", "ISO 2022 IR "}) {
        if (!term.starts_with(prefix)) continue;
        for (const CharacterSet& set : kSets) {
            if (set.number == term.substr(prefix.size())) return &set;
        }
    }
    return nullptr;
}

using Sets = std::vector<const CharacterSet*>;

// The set of an escape sequence, if the file names it, or null.
const CharacterSet* set_after_escape(std::string_view text, const Sets& named) {
    const auto is_named = [&](const CharacterSet& set) {
        return std::any_of(named.begin(), named.end(),
                           [&](const CharacterSet* other) { return other->number == set.number; });
    };
    for (const CharacterSet& set : kSets) {
        if (text.starts_with(set.escape) && (&set == &kSets.front() || is_named(set))) return &set;
    }
    return nullptr;
}

std::optional<std::string> decode(const std::string& text, const char* encoding) {
    const std::unique_ptr<char, void (*)(void*)> decoded(
        marrow_decode(text.data(), static_cast<unsigned>(text.size()), encoding), std::free);
    if (!decoded) return {};
    return std::string(decoded.get());
}

// Decodes bytes of one half, which are of one set.
std::optional<std::string> decode_run(std::string_view run, const CharacterSet& set) {
    if (set.encoding == nullptr) {
        if (is_high(run.front())) return {};
        return std::string(run);
    }
    // EUC has Japanese in the upper half, and the supplementary characters after a shift.
    std::string bytes;
    for (std::size_t i = 0; i < run.size(); ++i) {
        if (set.number == "159" && i % 2 == 0) bytes += '\x8f';
        bytes += static_cast<char>(run[i] | 0x80);
    }
    return decode(bytes, set.encoding);
}

// Decodes text whose escape sequences change to other sets. Lines and the parts of names begin anew.
std::optional<std::string> decode_runs(std::string_view text, const Sets& named) {
    const CharacterSet* const first_lower = &kSets.front();
    const CharacterSet* const first_upper = named.front();
    const CharacterSet *lower = first_lower, *upper = first_upper;
    const auto separates = [&](char c) {
        return !is_high(c) &&
               (c < ' ' || (lower->encoding == nullptr && kDelimiters.find(c) != std::string_view::npos));
    };
    std::string out;
    while (!text.empty()) {
        const char c = text.front();
        std::size_t size = 1;
        if (c == kEscape) {
            const CharacterSet* const next = set_after_escape(text.substr(1), named);
            if (next == nullptr) return {};
            (is_upper(*next) ? upper : lower) = next;
            size += next->escape.size();
        } else if (separates(c)) {
            out += c;
            lower = first_lower;
            upper = first_upper;
        } else if (c == ' ') {  // in all sets
            out += c;
        } else {
            const auto ends = [&](char next) {
                return is_high(next) != is_high(c) || next == ' ' || separates(next);
            };
            size = static_cast<std::size_t>(std::find_if(text.begin(), text.end(), ends) - text.begin());
            const auto decoded = decode_run(text.substr(0, size), is_high(c) ? *upper : *lower);
            if (!decoded) return {};
            out += *decoded;
        }
        text.remove_prefix(size);
    }
    return out;
}

}  // namespace

std::optional<std::string> to_utf8(const std::string& text, const std::string& character_set) {
    Sets named;
    std::string_view terms = character_set;
    while (true) {
        const std::size_t end = std::min(terms.find('\\'), terms.size());
        const std::string_view term = trimmed(terms.substr(0, end));
        for (const WholeEncoding& whole : kWholeEncodings) {
            if (whole.term == term) return decode(text, whole.encoding);
        }
        named.push_back(set_named(term));
        if (named.back() == nullptr) return {};
        if (end == terms.size()) break;
        terms.remove_prefix(end + 1);
    }
    return decode_runs(text, named);
}

}  // namespace marrow::internal::io
