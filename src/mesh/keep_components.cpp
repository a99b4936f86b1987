// Chooses components by size and volume, and copies them into a new mesh.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <unordered_map>
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

// What components are directly in. The search takes a tree of all triangles, so it begins only if it must.
class Nesting {
  public:
    Nesting(const MeshView& mesh, const Components& components) : mesh_(mesh), components_(components) {
        for (const Component& c : components.all) {
            if (c.is_cavity()) largest_cavity_ = std::max(largest_cavity_, -c.volume);
        }
    }

    // An index into the components, or kNone.
    std::uint32_t around(std::uint32_t c) {
        const auto [found, is_new] = around_.try_emplace(c, Components::kNone);
        if (is_new) {
            if (!tree_) tree_.emplace(mesh_);
            found->second = component_around(components_.all[c], mesh_, components_, *tree_);
        }
        return found->second;
    }

    // What faces inward and is in nothing is no cavity.
    bool is_cavity(std::uint32_t c) {
        return components_.all[c].is_cavity() && around(c) != Components::kNone;
    }

    // Only a closed component can be seen to be in a cavity, which is larger.
    bool is_in_cavity(std::uint32_t c) {
        const Component& body = components_.all[c];
        return body.closed && std::abs(body.volume) < largest_cavity_ && around(c) != Components::kNone &&
               is_cavity(around(c));
    }

  private:
    const MeshView& mesh_;
    const Components& components_;
    double largest_cavity_ = 0;
    std::optional<TriangleTree> tree_;
    std::unordered_map<std::uint32_t, std::uint32_t> around_;
};

// Of the components marked in `keep`, keeps the `count` largest that are not cavities, and their cavities. If
// cavities are filled, what is in them does not count.
void keep_largest(std::int64_t count, bool with_cavities, const Components& components, Nesting& nesting,
                  std::vector<bool>& keep) {
    std::vector<std::uint32_t> by_size, cavities;
    for (std::uint32_t c = 0; c < keep.size(); ++c) {
        if (keep[c]) by_size.push_back(c);
    }
    std::stable_sort(by_size.begin(), by_size.end(), [&](std::uint32_t a, std::uint32_t b) {
        return components.all[a].triangles > components.all[b].triangles;
    });
    for (const std::uint32_t c : by_size) {
        keep[c] = false;
        if (count == 0 && !with_cavities) continue;
        if (nesting.is_cavity(c)) {
            cavities.push_back(c);
        } else if (count > 0 && (with_cavities || !nesting.is_in_cavity(c))) {
            keep[c] = true;
            --count;
        }
    }
    if (!with_cavities) return;
    for (const std::uint32_t c : cavities) keep[c] = keep[nesting.around(c)];
}

// Drops cavities, and what is in them.
void fill_cavities(Nesting& nesting, std::vector<bool>& keep) {
    for (std::uint32_t c = 0; c < keep.size(); ++c)
        keep[c] = keep[c] && !nesting.is_cavity(c) && !nesting.is_in_cavity(c);
}

}  // namespace

Mesh keep_components(MeshView mesh, const ComponentOptions& options) {
    if (options.count && *options.count < 1) throw InputError("components: the count must be at least 1");
    if (!(options.min_volume >= 0))
        throw InputError("components: the smallest volume must be a number of mm^3 from 0 upwards");
    check_arrays(mesh);
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
        Nesting nesting(mesh, components);
        if (options.count)
            keep_largest(*options.count, options.cavities, components, nesting, keep);
        else if (!options.cavities)
            fill_cavities(nesting, keep);
        result = copy_components(mesh, components, keep);
    });
    return result;
}

}  // namespace marrow
