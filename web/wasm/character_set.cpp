// Converts the text of DICOM files to UTF-8 by the decoders that JavaScript has.
#include "io/dicom/character_set.h"

#include <emscripten.h>

#include <array>
#include <cstdlib>
#include <memory>
#include <string_view>

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

struct Encoding {
    std::string_view dicom;  // SpecificCharacterSet
    const char* name;
};

// PS3.3, C.12.1.1.2. With code extensions, text begins in the first set, and escape
// sequences change to the others.
constexpr std::array kEncodings{Encoding{"ISO_IR 6", "us-ascii"},      Encoding{"ISO_IR 100", "iso-8859-1"},
                                Encoding{"ISO_IR 101", "iso-8859-2"},  Encoding{"ISO_IR 109", "iso-8859-3"},
                                Encoding{"ISO_IR 110", "iso-8859-4"},  Encoding{"ISO_IR 144", "iso-8859-5"},
                                Encoding{"ISO_IR 127", "iso-8859-6"},  Encoding{"ISO_IR 126", "iso-8859-7"},
                                Encoding{"ISO_IR 138", "iso-8859-8"},  Encoding{"ISO_IR 148", "iso-8859-9"},
                                Encoding{"ISO_IR 203", "iso-8859-15"}, Encoding{"ISO_IR 166", "windows-874"},
                                Encoding{"ISO_IR 13", "shift_jis"},    Encoding{"ISO_IR 192", "utf-8"},
                                Encoding{"GB18030", "gb18030"},        Encoding{"GBK", "gbk"},
                                Encoding{"ISO_IR 87", "iso-2022-jp"},  Encoding{"ISO_IR 159", "iso-2022-jp"},
                                Encoding{"ISO_IR 149", "euc-kr"},      Encoding{"ISO_IR 58", "gb18030"}};

std::string_view trimmed(std::string_view text) {
    const std::size_t first = text.find_first_not_of(' ');
    return first == text.npos ? std::string_view()
                              : text.substr(first, text.find_last_not_of(" \0") - first + 1);
}

const char* encoding_of(std::string_view term) {
    std::string name(trimmed(term));
    if (name.empty()) return "us-ascii";
    if (name.starts_with("ISO 2022 IR ")) name = "ISO_IR " + name.substr(12);
    for (const Encoding& encoding : kEncodings) {
        if (encoding.dicom == name) return encoding.name;
    }
    return nullptr;
}

bool is_ascii(std::string_view text) {
    return text.find_first_not_of('\x1b') == text.npos ||
           text.end() ==
               std::find_if(text.begin(), text.end(), [](char c) { return c == '\x1b' || (c & 0x80) != 0; });
}

// Korean and Chinese sets are in the upper half of the bytes, so that the escape sequences tell nothing.
std::string without_escapes(std::string text) {
    for (const std::string_view escape : {"\x1b$)C", "\x1b$)A"}) {
        for (std::size_t at = text.find(escape); at != text.npos; at = text.find(escape))
            text.erase(at, escape.size());
    }
    return text;
}

}  // namespace

std::optional<std::string> to_utf8(const std::string& text, const std::string& character_set) {
    // The last set that is not the default one is the one that the escape sequences change to.
    const char* encoding = "us-ascii";
    std::string_view sets = character_set;
    while (true) {
        const std::size_t end = std::min(sets.find('\\'), sets.size());
        const char* const next = encoding_of(sets.substr(0, end));
        if (next == nullptr) return {};
        if (std::string_view(next) != "us-ascii") encoding = next;
        if (end == sets.size()) break;
        sets.remove_prefix(end + 1);
    }
    if (is_ascii(text)) return text;
    if (std::string_view(encoding) == "us-ascii") return {};
    const std::string plain = without_escapes(text);
    const std::unique_ptr<char, void (*)(void*)> decoded(
        marrow_decode(plain.data(), static_cast<unsigned>(plain.size()), encoding), std::free);
    if (!decoded) return {};
    return std::string(decoded.get());
}

}  // namespace marrow::internal::io
