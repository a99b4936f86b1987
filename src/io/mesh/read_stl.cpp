// Reads binary and text STL.
#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <random>

#include <marrow/error.h>

#include "io/bytes/text.h"
#include "reader.h"
#include "writer.h"

namespace marrow::internal::io {

namespace {

// Makes a mesh of corners, which STL does not share. Those with the same coordinates become one point, so
// that triangles are connected; -0 is equal to 0. Points are numbered in the order of the file.
class CornerJoiner {
  public:
    explicit CornerJoiner(const FileContent& input) : input_(input) {}

    void add(const std::array<Vec3f, 3>& corners) {
        check_finite(input_, corners);  // NaN would be a new point each time
        mesh_.triangles.push_back({number(corners[0]), number(corners[1]), number(corners[2])});
    }
    Mesh take() { return std::move(mesh_); }

  private:
    static constexpr std::uint32_t kFree = std::numeric_limits<std::uint32_t>::max();

    // The number of the point with these coordinates, found by hashing with linear probing.
    std::uint32_t number(const Vec3f& p) {
        if (slots_.size() <= 2 * mesh_.points.size()) grow();
        const std::size_t slot = slot_of(p);
        if (slots_[slot] != kFree) return slots_[slot];
        if (mesh_.points.size() == kFree) throw LimitError(quoted(input_.path) + ": has 2^32 points or more");
        slots_[slot] = static_cast<std::uint32_t>(mesh_.points.size());
        mesh_.points.push_back(p);
        return slots_[slot];
    }

    // Where the point with these coordinates stands, or would stand.
    std::size_t slot_of(const Vec3f& p) const {
        std::uint64_t hash = seed_;
        for (const float x : p) {
            hash = (hash ^ std::bit_cast<std::uint32_t>(x + 0.0f)) * 0x9E3779B97F4A7C15;  // -0 + 0 is 0
            hash ^= hash >> 32;
        }
        const std::size_t last = slots_.size() - 1;
        std::size_t slot = hash & last;
        while (slots_[slot] != kFree && mesh_.points[slots_[slot]] != p) slot = (slot + 1) & last;
        return slot;
    }

    void grow() {
        slots_.assign(std::bit_ceil(std::max(std::size_t{1024}, 4 * mesh_.points.size())), kFree);
        for (std::size_t i = 0; i < mesh_.points.size(); ++i)
            slots_[slot_of(mesh_.points[i])] = static_cast<std::uint32_t>(i);
    }

    const FileContent& input_;
    // Random, so that no file can have points that all collide.
    const std::uint64_t seed_ = std::uint64_t{std::random_device()()} << 32 | std::random_device()();
    Mesh mesh_;
    std::vector<std::uint32_t> slots_;  // numbers of points, a power of two, at most half of them in use
};

}  // namespace

Mesh read_stl(const FileContent& input, Space& space, const Progress& progress) {
    const std::string& bytes = input.bytes;
    ReadingProgress reading(progress);
    const auto size = static_cast<double>(bytes.size());
    CornerJoiner mesh(input);
    std::array<Vec3f, 3> corners{};
    std::uint32_t count = 0;
    if (bytes.size() >= kStlHeaderBytes) std::memcpy(&count, bytes.data() + 80, sizeof count);
    if (bytes.size() >= kStlHeaderBytes &&
        bytes.size() == kStlHeaderBytes + kStlFacetBytes * std::size_t{count}) {
        space = stated_space(std::string_view(bytes).substr(0, 80));
        for (std::size_t t = 0; t < count; ++t) {
            reading(static_cast<double>(kStlFacetBytes * t), size);
            std::memcpy(corners.data(), bytes.data() + kStlHeaderBytes + kStlFacetBytes * t + 12, 36);
            mesh.add(corners);
        }
        return mesh.take();
    }
    if (!to_lower(trimmed(std::string_view(bytes).substr(0, 80))).starts_with("solid"))
        input.refuse("is neither a text STL file nor a binary one with the length of its " +
                     std::to_string(count) + " triangles; it may be cut off");
    bool ended = false;
    std::size_t facets = 0, vertices = 0;
    const auto check_facets = [&] {
        if (vertices != 3 * facets)
            input.refuse("facet " + std::to_string(facets) +
                         " does not have three vertices; save it again as triangles");
    };
    std::string_view rest = bytes;
    if (rest.ends_with('\0')) rest.remove_suffix(1);  // what DICOM adds to an odd number of bytes
    for (std::string_view word = take_word(rest); !word.empty(); word = take_word(rest)) {
        reading(size - static_cast<double>(rest.size()), size);
        const std::string keyword = to_lower(word);
        if (keyword == "facet") {
            check_facets();
            ++facets;
        } else if (keyword == "vertex") {
            std::vector<std::string_view> line{word};
            while (line.size() < 4) line.push_back(take_word(rest));
            corners[vertices % 3] = parse_point(input, line);
            if (++vertices % 3 == 0) mesh.add(corners);
        } else if (keyword == "solid" || keyword == "endsolid") {
            const std::string_view name = take_line(rest);
            ended = keyword == "endsolid";
            if (!ended && space == Space::none) space = stated_space(name);
        }
    }
    if (!ended) input.refuse("the text STL file is cut off");
    check_facets();
    return mesh.take();
}

}  // namespace marrow::internal::io
