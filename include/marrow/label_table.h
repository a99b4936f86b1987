/// Names and colours of labels.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include <marrow/export.h>

namespace marrow {

struct LabelEntry {
    std::string name;  ///< as it stands in the table
    std::optional<std::array<double, 3>>
        colour;  ///< red, green, blue from 0 to 1; none: the table does not say
};

/// By label.
using LabelTable = std::map<std::int64_t, LabelEntry>;

/// Reads a table of labels: text, one label a line, in any of these forms, which may be mixed; `#` begins a comment.
///
/// | table                | line                                                                       |
/// | -------------------- | -------------------------------------------------------------------------- |
/// | 3D Slicer .ctbl, FreeSurfer | `label name red green blue [alpha]`, colours from 0 to 255          |
/// | ITK-SNAP             | `label red green blue alpha visible mesh "name"`                           |
/// | plain                | `label name`, by spaces, tabs or commas; numbers behind the name are left out unless they are three or four colours |
///
/// \throw IoError a file that cannot be read; InputError a line that is none of these, or a label twice
MARROW_EXPORT LabelTable read_label_table(const std::filesystem::path& file);

/// A colour for a label that has none: the same for the same label, and unlike those of its neighbours in number.
MARROW_EXPORT std::array<double, 3> default_label_colour(std::int64_t label);

}  // namespace marrow
