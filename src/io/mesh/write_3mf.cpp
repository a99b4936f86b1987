// Writes 3MF after its core specification 1.2: a ZIP archive with an XML model. Numbers have the fewest
// digits that read back to the same float, in any locale.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string_view>

#include <fmt/format.h>

#include <marrow/error.h>

#include "writer.h"

namespace marrow::internal::io {
namespace {

constexpr std::size_t kFloatChars = 15, kIndexChars = 10;

// What surrounds the three numbers of an element.
using Texts = std::array<std::string_view, 4>;
constexpr Texts kVertex{"<vertex x=\"", "\" y=\"", "\" z=\"", "\"/>\n"};
constexpr Texts kTriangle{"<triangle v1=\"", "\" v2=\"", "\" v3=\"", "\"/>\n"};

constexpr std::size_t longest(const Texts& texts, std::size_t number_chars) {
    std::size_t chars = 3 * number_chars;
    for (const std::string_view text : texts) chars += text.size();
    return chars;
}

template <class Numbers>
char* put_element(char* to, const Texts& texts, const Numbers& numbers, std::size_t number_chars) {
    for (std::size_t i = 0; i < 3; ++i) {
        to = std::copy(texts[i].begin(), texts[i].end(), to);
        to = std::to_chars(to, to + number_chars, numbers[i]).ptr;
    }
    return std::copy(texts[3].begin(), texts[3].end(), to);
}

std::string escaped(const std::string& name) {
    std::string text;
    for (const char c : clean_name(name))
        text += c == '&'   ? "&amp;"
                : c == '<' ? "&lt;"
                : c == '>' ? "&gt;"
                : c == '"' ? "&quot;"
                           : std::string(1, c);
    return text;
}

std::string hex_colour(const std::array<double, 3>& colour) {
    std::string text = "#";
    for (const double part : colour)
        text += fmt::format("{:02X}", std::lround(255 * std::clamp(part, 0.0, 1.0)));
    return text + "FF";
}

std::string name_attribute(const MeshObject& object) {
    return object.name.empty() ? "" : " name=\"" + escaped(object.name) + "\"";
}

// The schema's limits on the points and triangles of an object.
void check_size(const MeshView& mesh) {
    constexpr std::size_t kMost = (std::size_t{1} << 31) - 1;
    if (std::max(mesh.points.size(), mesh.triangles.size()) > kMost)
        throw LimitError(
            fmt::format("a .3mf file holds surfaces of at most 2^31 - 1 points and triangles, and this one "
                        "has {} and {}; write .ply or .vtp",
                        mesh.points.size(), mesh.triangles.size()));
}

void write_object(MeshOutput& output, const MeshView& mesh) {
    output.text("<mesh><vertices>\n");
    output.items<longest(kVertex, kFloatChars)>(mesh.points.size(), 0, 0.5, [&](std::size_t i, char* to) {
        return put_element(to, kVertex, output.oriented(mesh.points[i]), kFloatChars);
    });
    output.text("</vertices><triangles>\n");
    output.items<longest(kTriangle, kIndexChars)>(
        mesh.triangles.size(), 0.5, 1, [&](std::size_t i, char* to) {
            const Triangle& t = mesh.triangles[i];
            return has_three_corners(t) ? put_element(to, kTriangle, t, kIndexChars)
                                        : to;  // the schema wants three
        });
    output.text("</triangles></mesh>");
}

}  // namespace

std::span<const ArchiveFile> other_3mf_files() {
    static constexpr ArchiveFile kFiles[] = {
        {"[Content_Types].xml",
         "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
         "<Types xmlns=\"http://schemas.openxmlformats.org/package/2006/content-types\">"
         "<Default Extension=\"rels\" "
         "ContentType=\"application/vnd.openxmlformats-package.relationships+xml\"/>"
         "<Default Extension=\"model\" "
         "ContentType=\"application/vnd.ms-package.3dmanufacturing-3dmodel+xml\"/>"
         "</Types>\n"},
        {"_rels/.rels",
         "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
         "<Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\">"
         "<Relationship Id=\"model\" Target=\"/3D/3dmodel.model\" "
         "Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>\n"}};
    return kFiles;
}

void write_3mf_model(MeshOutput& output, MeshObjects objects) {
    for (const MeshObject& object : objects) check_size(object.mesh);
    std::string text =
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model unit=\"millimeter\" xml:lang=\"en-US\" "
        "xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\">\n"
        "<metadata name=\"Application\">Marrow</metadata>\n<metadata name=\"Description\">" +
        space_mark(output.space) + "</metadata>\n<resources>\n";
    // Resource 1 is the list of colours; objects refer to them by index. The objects follow.
    const bool coloured =
        std::any_of(objects.begin(), objects.end(), [](const MeshObject& o) { return o.colour.has_value(); });
    std::vector<std::string> colour_of(objects.size());
    if (coloured) {
        text += "<basematerials id=\"1\">\n";
        std::size_t colours = 0;
        for (std::size_t i = 0; i < objects.size(); ++i) {
            if (!objects[i].colour) continue;
            text += "<base name=\"" + escaped(name_or_number(objects, i)) + "\" displaycolor=\"" +
                    hex_colour(*objects[i].colour) + "\"/>\n";
            colour_of[i] = " pid=\"1\" pindex=\"" + std::to_string(colours++) + "\"";
        }
        text += "</basematerials>\n";
    }
    output.text(text);
    const auto id = [](std::size_t object) { return fmt::format("\"{}\"", object + 2); };
    for (std::size_t i = 0; i < objects.size(); ++i) {
        output.set_share(i, objects.size());
        output.text("<object id=" + id(i) + " type=\"model\"" + name_attribute(objects[i]) + colour_of[i] +
                    ">");
        write_object(output, objects[i].mesh);
        output.text("</object>\n");
    }
    text = "</resources>\n<build>\n";
    for (std::size_t i = 0; i < objects.size(); ++i) text += "<item objectid=" + id(i) + "/>\n";
    output.text(text + "</build>\n</model>\n");
}

}  // namespace marrow::internal::io
