// Extracts any bytes as a volume: the fast algorithm must give the triangles of the classic one. With a
// closed border, each edge must have two triangles with opposite orientation, also with exact topology.
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <map>
#include <vector>

#include <marrow/error.h>
#include <marrow/isosurface.h>

namespace {

using namespace marrow;

std::vector<std::array<Vec3f, 3>> corners_of(const Mesh& mesh) {
    std::vector<std::array<Vec3f, 3>> out;
    for (const Triangle& t : mesh.triangles) {
        std::array<Vec3f, 3> corners{mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]]};
        std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
        out.push_back(corners);
    }
    std::sort(out.begin(), out.end());
    return out;
}

bool is_closed(const Mesh& mesh) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    for (const Triangle& t : mesh.triangles) {
        for (std::size_t i = 0; i < 3; ++i) {
            const auto a = t[i], b = t[(i + 1) % 3];
            if (a < b)
                ++edges[{a, b}];
            else
                --edges[{b, a}];
        }
    }
    return std::all_of(edges.begin(), edges.end(), [](const auto& e) { return e.second == 0; });
}

// Whether each edge has two triangles, with opposite orientation.
bool is_manifold(const Mesh& mesh) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> uses;  // of edges, in each direction
    for (const Triangle& t : mesh.triangles) {
        for (std::size_t i = 0; i < 3; ++i) ++uses[{t[i], t[(i + 1) % 3]}];
    }
    return std::all_of(uses.begin(), uses.end(), [&](const auto& use) {
        const auto& [edge, count] = use;
        return count == 1 && uses.contains({edge.second, edge.first});
    });
}

template <class T>
void check(const std::uint8_t* data, std::size_t size, const Geometry& geometry, double isovalue,
           bool closed) {
    std::vector<T> samples(static_cast<std::size_t>(geometry.sample_count()));
    auto* bytes = reinterpret_cast<std::uint8_t*>(samples.data());
    for (std::size_t i = 0; i < samples.size() * sizeof(T); ++i) bytes[i] = data[i % size];
    const VolumeView volume(samples.data(), geometry);
    const Mesh fast = extract_isosurface(volume, isovalue, {.closed = closed, .threads = 1});
    const Mesh threaded = extract_isosurface(volume, isovalue, {.closed = closed, .threads = 2});
    const Mesh classic = extract_isosurface_classic(volume, isovalue, closed);
    IsosurfaceExtractor extractor(volume, {.closed = closed, .threads = 1});
    extractor.extract(isovalue + 1);
    const Mesh& again = extractor.extract(isovalue);
    const auto same = [](const Mesh& a, const Mesh& b) {
        return a.triangles == b.triangles && a.points.size() == b.points.size() &&
               (a.points.empty() ||
                std::memcmp(a.points.data(), b.points.data(), a.points.size() * sizeof(Vec3f)) == 0);
    };
    if (!same(fast, threaded) || !same(fast, again)) std::abort();
    if (corners_of(fast) != corners_of(classic)) std::abort();
    if (closed && !is_closed(fast)) std::abort();
    const Mesh exact =
        extract_isosurface(volume, isovalue, {.closed = closed, .topology = true, .threads = 1});
    const Mesh exact_threaded =
        extract_isosurface(volume, isovalue, {.closed = closed, .topology = true, .threads = 2});
    if (!same(exact, exact_threaded)) std::abort();
    if (exact.points.size() < fast.points.size()) std::abort();  // points are only added, inside cells
    if (closed && !is_manifold(exact)) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    constexpr std::size_t kHead = 6;
    if (size <= kHead) return 0;
    Geometry geometry;
    for (std::size_t axis = 0; axis < 3; ++axis) geometry.dims[axis] = 2 + data[axis] % (axis == 0 ? 130 : 8);
    const bool closed = data[3] & 1;
    const int type = data[3] >> 1 & 3;
    std::int16_t isovalue = 0;
    std::memcpy(&isovalue, data + 4, sizeof isovalue);
    const std::uint8_t* samples = data + kHead;
    const std::size_t rest = size - kHead;
    if (type == 0) check<std::uint8_t>(samples, rest, geometry, isovalue & 0xff, closed);
    if (type == 1) check<std::int16_t>(samples, rest, geometry, isovalue, closed);
    if (type == 2) check<float>(samples, rest, geometry, isovalue / 8.0, closed);
    if (type == 3)
        check<std::uint16_t>(samples, rest, geometry, static_cast<std::uint16_t>(isovalue), closed);
    return 0;
}
