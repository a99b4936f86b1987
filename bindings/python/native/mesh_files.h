/// Mesh files.
#pragma once

#include <string>

#include <marrow/mesh_io.h>

namespace marrow::python {

/// The space with this name: LPS, RAS or none. \throw InputError another name
Space space_named(const std::string& name);

}  // namespace marrow::python
