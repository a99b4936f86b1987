/// Names and colours of labels, as tuples in Python.
#pragma once

#include <pybind11/pybind11.h>

#include <array>

#include <marrow/label_table.h>

#include "text.h"

namespace marrow::python {

inline pybind11::tuple colour_tuple(const std::array<double, 3>& colour) {
    return pybind11::make_tuple(colour[0], colour[1], colour[2]);
}

/// Entries (name, colour or None) by label.
inline pybind11::dict entries_of(const LabelTable& table) {
    pybind11::dict entries;
    for (const auto& [label, entry] : table) {
        pybind11::object colour = pybind11::none();
        if (entry.colour) colour = colour_tuple(*entry.colour);
        entries[pybind11::int_(label)] = pybind11::make_tuple(readable(entry.name), colour);
    }
    return entries;
}

}  // namespace marrow::python
