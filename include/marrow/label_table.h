/// Reads the names and colours of labels.
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
    std::string name;                             ///< as in the table
    std::optional<std::array<double, 3>> colour;  ///< red, green, blue from 0 to 1, if the table has one
};

/// Entries by label.
using LabelTable = std::map<std::int64_t, LabelEntry>;

/// Reads a table of labels: text with one label per line. A `#` at the beginning of a line or alone between
/// blanks begins a comment. A table may mix these forms:
///
/// | table                       | line                                                       |
/// | --------------------------- | ---------------------------------------------------------- |
/// | 3D Slicer .ctbl, FreeSurfer | `label name red green blue [alpha]`, colours from 0 to 255 |
/// | ITK-SNAP                    | `label red green blue alpha visible mesh "name"`           |
/// | plain                       | `label name`, separated by spaces, tabs or commas          |
///
/// Numbers after the name are ignored unless they are a colour of three or four numbers. A name may end in a
/// number if it is in quotes, if commas or tabs separate it from the colour, or if there are five numbers and
/// the last is an alpha of 255.
/// \throw IoError the file cannot be read; InputError a line has another form, a label occurs twice, or some
/// colours have an alpha and others do not, so that a number may belong to a name without quotes
MARROW_EXPORT LabelTable read_label_table(const std::filesystem::path& file);

/// The entries of `table`, completed by those of `others`: the labels, names and colours that `table` leaves
/// out.
MARROW_EXPORT LabelTable completed(LabelTable table, const LabelTable& others);

/// A colour for a label without one. It depends only on the label; consecutive labels have distinct colours.
MARROW_EXPORT std::array<double, 3> default_label_colour(std::int64_t label);

/// The name and the colour of a label: those of the table where it has them, or else "label-N" and the
/// default colour.
MARROW_EXPORT LabelEntry label_entry(const LabelTable& table, std::int64_t label);

}  // namespace marrow
