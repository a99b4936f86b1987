/// What users are told about a series before it is read.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <marrow/scan_io.h>

namespace marrow::apps {

/// "1 file", "2 files".
std::string count_of(std::size_t count, std::string_view thing);

/// "0.5 x 0.5 x ? mm"; ? where the spacing is unknown.
std::string spacing_text(const Vec3d& spacing);

/// One line, to tell a series from others.
std::string series_summary(const SeriesReport& series);

/// What the headers of a series do not state, and nobody can know from them.
std::vector<std::string> unknown_facts(const SeriesReport& series);

}  // namespace marrow::apps
