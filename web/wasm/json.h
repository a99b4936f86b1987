/// How the face speaks with JavaScript: requests and answers are JSON, and large
/// arrays are addresses in the memory.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include <marrow/mesh.h>
#include <marrow/progress.h>
#include <marrow/scan_io.h>
#include <marrow/vector.h>
#include <marrow/volume.h>

namespace marrow::web {

using Json = nlohmann::json;

/// Does the work of a request and returns the answer. \throw Error
using Operation = Json (*)(const Json& request);

/// The address of the first element of an array, and the number of elements.
template <class T>
Json array_of(const T* data, std::size_t count) {
    return {{"address", reinterpret_cast<std::uintptr_t>(data)}, {"count", count}};
}

inline Json vector_of(const Vec3d& v) {
    return {v[0], v[1], v[2]};
}

/// The member of a request, if it is there and not null.
template <class T>
std::optional<T> member(const Json& request, const char* name) {
    const auto found = request.find(name);
    if (found == request.end() || found->is_null()) return {};
    return found->get<T>();
}

inline Vec3d vec3_of(const Json& values) {
    return {values.at(0).get<double>(), values.at(1).get<double>(), values.at(2).get<double>()};
}

/// Reports to JavaScript, which may cancel.
Progress progress();

/// The scan of this module. \throw InputError there is none
const Volume& scan();
const ScanInfo& scan_info();

/// The part of the scan that a request's `crop` names, or all of it. No samples are copied.
VolumeView cropped_scan(const Json& request);

/// Keeps a mesh, and describes it with its arrays. The member `mesh` is its number.
Json keep_mesh(Mesh mesh);

/// Describes the arrays of a mesh.
Json describe(const Mesh& mesh);

// The operations, by the file they are in.
Json inspect(const Json& request);
Json read(const Json& request);
Json adopt(const Json& request);
Json describe_scan(const Json& request);
Json read_labels(const Json& request);
Json slice(const Json& request);

Json create_extractor(const Json& request);
Json extract(const Json& request);
Json drop_extractor(const Json& request);
Json labels(const Json& request);

Json create_mesh(const Json& request);
Json drop_mesh(const Json& request);
Json keep_components(const Json& request);
Json smooth(const Json& request);
Json simplify(const Json& request);
Json measure(const Json& request);
Json check(const Json& request);
Json write(const Json& request);

}  // namespace marrow::web
