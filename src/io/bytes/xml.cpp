// Parses XML by expat.
#include "xml.h"

#include <algorithm>
#include <cstring>
#include <new>
#include <utility>

#include <expat.h>

namespace marrow::internal::io {

namespace {

constexpr char kSeparator = ' ';  // between the namespace and the name; expat refuses it in namespaces
constexpr int kMostDepth = 100;
constexpr std::size_t kLongestTag = std::size_t{1} << 20;

// Divides a name of expat's into the namespace and the name.
std::pair<std::string_view, std::string_view> divided(std::string_view full) {
    const std::size_t at = full.rfind(kSeparator);
    if (at == full.npos) return {{}, full};
    return {full.substr(0, at), full.substr(at + 1)};
}

}  // namespace

std::string_view XmlElement::get(const char* attribute, std::string_view attribute_space) const {
    for (const char* const* at = attributes; *at; at += 2) {
        if (attribute_space.empty()
                ? std::strcmp(at[0], attribute) == 0
                : divided(at[0]) == std::pair(attribute_space, std::string_view(attribute)))
            return at[1];
    }
    return {};
}

// What expat calls.
struct XmlParser::Callbacks {
    // Runs `visit` unless an error is on its way to parse_piece().
    template <class Visit>
    static void guarded(void* self, Visit visit) {
        auto& parser = *static_cast<XmlParser*>(self);
        if (parser.stopped_) return;
        try {
            visit(parser);
        } catch (...) {
            parser.thrown_ = std::current_exception();
            parser.stop();
        }
    }

    static void begin(void* self, const char* full, const char** attributes) {
        guarded(self, [&](XmlParser& parser) {
            if (++parser.depth_ > kMostDepth) parser.file_.refuse("its XML is nested too deeply");
            const auto [space, name] = divided(full);
            parser.tag_end_ = parser.end_of_tag();
            parser.visitor_.begin({space, name, attributes});
        });
    }
    static void end(void* self, const char* full) {
        guarded(self, [&](XmlParser& parser) {
            --parser.depth_;
            const auto [space, name] = divided(full);
            parser.tag_end_ = parser.end_of_tag();
            parser.visitor_.end(space, name);
        });
    }
    static void text(void* self, const char* text, int size) {
        guarded(self, [&](XmlParser& parser) {
            parser.visitor_.text({text, static_cast<std::size_t>(size)});
        });
    }
    static void declare_prefix(void* self, const char* prefix, const char* space) {
        guarded(self, [&](XmlParser& parser) {
            parser.visitor_.declare_prefix(prefix ? prefix : "", space ? space : "");
        });
    }
    static void document_type(void* self, const char*, const char*, const char*, int) {
        guarded(self, [](XmlParser& parser) {
            parser.file_.refuse("its XML has a document type, which is not supported");
        });
    }
};

XmlParser::XmlParser(const FileContent& file, XmlVisitor& visitor)
    : file_(file), visitor_(visitor), parser_(XML_ParserCreateNS(nullptr, kSeparator)) {
    if (!parser_) throw std::bad_alloc();
    XML_SetUserData(parser_, this);
    XML_SetElementHandler(parser_, Callbacks::begin, Callbacks::end);
    XML_SetCharacterDataHandler(parser_, Callbacks::text);
    XML_SetStartNamespaceDeclHandler(parser_, Callbacks::declare_prefix);
    XML_SetStartDoctypeDeclHandler(parser_, Callbacks::document_type);
}

XmlParser::~XmlParser() {
    XML_ParserFree(parser_);
}

void XmlParser::parse(std::string_view bytes) {
    constexpr std::size_t kPiece = std::size_t{1} << 16;
    while (!bytes.empty() && !stopped_) {
        if (parsed_ == tag_end_) {
            const std::string_view taken = bytes.substr(0, visitor_.take(bytes));
            taken_lines_ += static_cast<std::size_t>(std::count(taken.begin(), taken.end(), '\n'));
            bytes.remove_prefix(taken.size());
        }
        // A piece ends with a tag, so that the visitor can take what follows.
        std::string_view piece = bytes.substr(0, kPiece);
        if (const std::size_t end = piece.rfind('>'); end != piece.npos) piece = piece.substr(0, end + 1);
        parse_piece(piece, false);
        bytes.remove_prefix(piece.size());
        // expat begins again at the start of a tag with each piece, so that an endless tag would take it ever
        // longer.
        if (!stopped_ && parsed_ - static_cast<std::size_t>(XML_GetCurrentByteIndex(parser_)) > kLongestTag)
            file_.refuse("has an XML tag or comment of more than a mebibyte");
    }
}

void XmlParser::finish() {
    if (!stopped_) parse_piece({}, true);
}

void XmlParser::stop() {
    stopped_ = true;
    XML_StopParser(parser_, XML_FALSE);
}

std::size_t XmlParser::end_of_tag() const {
    return static_cast<std::size_t>(XML_GetCurrentByteIndex(parser_) + XML_GetCurrentByteCount(parser_));
}

void XmlParser::parse_piece(std::string_view bytes, bool last) {
    parsed_ += bytes.size();
    const XML_Status status = XML_Parse(parser_, bytes.data(), static_cast<int>(bytes.size()), last);
    if (thrown_) std::rethrow_exception(thrown_);
    if (stopped_ || status != XML_STATUS_ERROR) return;
    if (last) file_.refuse("its XML is cut off");
    file_.refuse("its XML is invalid in line " +
                 std::to_string(taken_lines_ + XML_GetCurrentLineNumber(parser_)) + ": " +
                 XML_ErrorString(XML_GetErrorCode(parser_)));
}

}  // namespace marrow::internal::io
