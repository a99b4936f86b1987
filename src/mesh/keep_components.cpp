// Chooses components by size and volume, and copies them into a new mesh.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/components.h>
#include <marrow/error.h>

#include "base/parallel.h"
#include "component_around.h"
#include "find_components.h"
#include "mesh/connectivity/check_mesh.h"
#include "mesh/search/triangle_tree.h"

namespace marrow {

using namespace internal;

namespace {

// The elements of an array that is_kept(i) chooses, numbered in the same order.
template <class IsKept>
class Kept {
  public:
    Kept(std::size_t size, const IsKept& is_kept)
        : size_(size), is_kept_(is_kept), starts_((size + kSection - 1) / kSection + 1, 0) {
        for_each_section([&](std::size_t section, std::size_t begin, std::size_t end) {
            std::size_t kept = 0;
            for (std::size_t i = begin; i < end; ++i) kept += is_kept_(i) ? 1 : 0;
            starts_[section + 1] = kept;
        });
        std::partial_sum(starts_.begin(), starts_.end(), starts_.begin());
    }

    std::size_t count() const { return starts_.back(); }
    // Calls f(i, its number) for each element i that is kept, on all threads.
    template <class F>
    void for_each(const F& f) const {
        for_each_section([&](std::size_t section, std::size_t begin, std::size_t end) {
            std::size_t number = starts_[section];
            for (std::size_t i = begin; i < end; ++i)
                if (is_kept_(i)) f(i, number++);
        });
    }

  private:
    static constexpr std::size_t kSection = 16384;

    template <class F>
    void for_each_section(const F& f) const {
        parallel_for(std::size_t{0}, starts_.size() - 1, [&](std::size_t section) {
            f(section, section * kSection, std::min((section + 1) * kSection, size_));
        });
    }

    const std::size_t size_;
    const IsKept is_kept_;
    std::vector<std::size_t> starts_;  // the numbers that sections begin with, and how many are kept
};

Mesh copy_components(const MeshView& mesh, const Components& components, const std::vector<bool>& keep) {
    const Kept points(mesh.points.size(), [&](std::size_t p) {
        return components.of_point[p] != Components::kNone && keep[components.of_point[p]];
    });
    const Kept triangles(mesh.triangles.size(),
                         [&](std::size_t t) { return keep[components.of(mesh.triangles[t])]; });
    Mesh result;
    result.points.resize(points.count());
    result.triangles.resize(triangles.count());
    if (!mesh.normals.empty()) result.normals.resize(points.count());
    Buffer<std::uint32_t> new_index(mesh.points.size());
    points.for_each([&](std::size_t p, std::size_t number) {
        new_index[p] = static_cast<std::uint32_t>(number);
        result.points[number] = mesh.points[p];
        if (!mesh.normals.empty()) result.normals[number] = mesh.normals[p];
    });
    triangles.for_each([&](std::size_t t, std::size_t number) {
        const auto [a, b, c] = mesh.triangles[t];
        result.triangles[number] = {new_index[a], new_index[b], new_index[c]};
    });
    return result;
}

// What each component is directly in, where that is needed: of cavities, and of bodies if cavities are
// filled. A component that faces inward and is in none is no cavity.
class Nesting {
  public:
    Nesting(const MeshView& mesh, const Components& components, bool of_bodies)
        : around_(components.all.size(), Components::kNone) {
        const auto faces_inward = [](const Component& c) { return c.is_cavity(); };
        if (std::none_of(components.all.begin(), components.all.end(), faces_inward)) return;
        const TriangleTree tree(mesh);
        for (std::size_t c = 0; c < around_.size(); ++c) {
            const Component& component = components.all[c];
            if (component.is_cavity() || (of_bodies && component.closed))
                around_[c] = component_around(component, mesh, components, tree);
        }
        for (std::size_t c = 0; c < around_.size(); ++c)
            is_cavity_.push_back(components.all[c].is_cavity() && around_[c] != Components::kNone);
    }

    bool is_cavity(std::uint32_t c) const { return !is_cavity_.empty() && is_cavity_[c]; }
    std::uint32_t around(std::uint32_t c) const { return around_[c]; }
    bool is_in_cavity(std::uint32_t c) const {
        return around_[c] != Components::kNone && is_cavity(around_[c]);
    }

  private:
    std::vector<std::uint32_t> around_;
    std::vector<bool> is_cavity_;
};

// Of the components marked in `keep`, keeps the `count` largest that are not cavities, and their cavities.
void keep_largest(std::int64_t count, const Components& components, const Nesting& nesting,
                  std::vector<bool>& keep) {
    std::vector<std::uint32_t> bodies, cavities;
    for (std::uint32_t c = 0; c < keep.size(); ++c) {
        if (keep[c]) (nesting.is_cavity(c) ? cavities : bodies).push_back(c);
    }
    std::stable_sort(bodies.begin(), bodies.end(), [&](std::uint32_t a, std::uint32_t b) {
        return components.all[a].triangles > components.all[b].triangles;
    });
    for (std::size_t i = static_cast<std::size_t>(count); i < bodies.size(); ++i) keep[bodies[i]] = false;
    for (const std::uint32_t c : cavities) keep[c] = keep[nesting.around(c)];
}

// Drops cavities, and what is in them.
void fill_cavities(const Nesting& nesting, std::vector<bool>& keep) {
    for (std::uint32_t c = 0; c < keep.size(); ++c) {
        if (nesting.is_cavity(c) || nesting.is_in_cavity(c)) keep[c] = false;
    }
}

}  // namespace

Mesh keep_components(MeshView mesh, const ComponentOptions& options) {
    if (options.count && *options.count < 1) throw InputError("components: the count must be at least 1");
    if (!(options.min_volume >= 0))
        throw InputError("components: the smallest volume must be a number of mm^3 from 0 upwards");
    check_indices(mesh);
    check_coordinates(mesh.points);
    check_triangle_count(mesh, "components");
    Mesh result;
    with_threads(options.threads, [&] {
        const Components components = find_components(mesh, OneRings(mesh));
        std::vector<bool> keep;
        for (const Component& c : components.all) {
            const bool too_small = c.closed && std::abs(c.volume) < options.min_volume;
            keep.push_back(!too_small);
        }
        if (options.count || !options.cavities) {
            const Nesting nesting(mesh, components, !options.cavities);
            if (!options.cavities) fill_cavities(nesting, keep);
            if (options.count) keep_largest(*options.count, components, nesting, keep);
        }
        result = copy_components(mesh, components, keep);
    });
    return result;
}

}  // namespace marrow
