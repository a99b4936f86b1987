/// Parses XML by expat.
#pragma once

#include <cstddef>
#include <exception>
#include <string>
#include <string_view>

#include "file_content.h"

struct XML_ParserStruct;

namespace marrow::internal::io {

/// A start tag. Its views are valid until the visitor returns.
struct XmlElement {
    std::string_view space;  ///< the URI of its namespace; empty if it has none
    std::string_view name;   ///< without the prefix
    const char* const* attributes;

    /// The value of an attribute, which has a namespace or none; empty if it is absent.
    std::string_view get(const char* attribute, std::string_view attribute_space = {}) const;
};

/// Receives the parts of a document in their order.
class XmlVisitor {
  public:
    virtual ~XmlVisitor() = default;
    virtual void begin(const XmlElement& element) = 0;
    virtual void end(std::string_view space, std::string_view name) = 0;
    /// A piece of the text of the current element.
    virtual void text(std::string_view) {}
    virtual void declare_prefix(std::string_view /*prefix*/, std::string_view /*space*/) {}
    /// Reads complete elements from the start of the bytes that follow a tag, instead of the
    /// parser, and returns their size; 0 leaves all to the parser. For millions of equal elements,
    /// which the parser would slow down.
    virtual std::size_t take(std::string_view /*bytes*/) { return 0; }
};

/// Parses a document that comes in pieces. Document types are refused, and with them entities of the
/// document's own; so are elements that are nested deeply, and tags of more than a mebibyte.
class XmlParser {
  public:
    /// Errors name `file`. \pre the file and the visitor outlive the parser
    XmlParser(const FileContent& file, XmlVisitor& visitor);
    ~XmlParser();
    XmlParser(const XmlParser&) = delete;
    XmlParser& operator=(const XmlParser&) = delete;

    /// \throw InputError the document is invalid; what the visitor throws
    void parse(std::string_view bytes);
    /// Ends the document. \throw InputError it is cut off; what the visitor throws
    void finish();
    /// Leaves the rest of the document out, for the visitor.
    void stop();
    /// How many bytes of the document end with the tag that the visitor receives.
    std::size_t end_of_tag() const;

  private:
    struct Callbacks;
    void parse_piece(std::string_view bytes, bool last);

    const FileContent& file_;
    XmlVisitor& visitor_;
    XML_ParserStruct* parser_;
    std::exception_ptr thrown_;  // by the visitor; it must not pass through expat
    int depth_ = 0;
    bool stopped_ = false;
    std::size_t parsed_ = 0;   // bytes
    std::size_t tag_end_ = 0;  // of the last tag, among them
    std::size_t taken_lines_ = 0;
};

}  // namespace marrow::internal::io
