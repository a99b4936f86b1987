// Merges the surfaces of labels from parts: points by their keys, and triangles
// by the rows in which they begin.
#include <marrow/label_parts.h>

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "base/parallel.h"
#include "base/progress.h"
#include "core/volume/checks.h"
#include "hold_back_labels.h"
#include "label_normals.h"
#include "label_part_keys.h"

namespace marrow {

using namespace internal;

namespace {

// Checks that the parts have each row once.
void check(std::span<const LabelPart> parts) {
    const std::array<std::int64_t, 3>& whole = parts.front().whole;
    std::vector<char> covered(static_cast<std::size_t>(whole[1] * whole[2]));
    std::size_t rows = 0;
    std::optional<bool> are_relaxed;  // of the parts that have points
    for (const LabelPart& part : parts) {
        if (part.whole != whole) throw InputError("the parts are of different label maps");
        if (!part.positions.empty()) {
            const bool relaxed = !part.positions_before_relaxation.empty();
            if (are_relaxed.value_or(relaxed) != relaxed)
                throw InputError(
                    "only some of the parts are relaxed; extract all parts with the same options");
            are_relaxed = relaxed;
        }
        for (std::int64_t z = part.first[2]; z < part.first[2] + part.dims[2]; ++z) {
            for (std::int64_t y = part.first[1]; y < part.first[1] + part.dims[1]; ++y, ++rows) {
                if (std::exchange(covered.at(static_cast<std::size_t>(z * whole[1] + y)), 1) != 0)
                    throw InputError(
                        "two parts have a common row; cut the label map into parts that share no samples");
            }
        }
    }
    if (rows != covered.size()) throw InputError("the parts of the label map leave a gap");
}

// The different keys of some sequences, ascending.
template <class Sequences>
Buffer<std::uint64_t> merged_keys(const Sequences& sequences) {
    Buffer<std::uint64_t> keys;
    for (const Buffer<std::uint64_t>* sequence : sequences)
        keys.insert(keys.end(), sequence->begin(), sequence->end());
    std::sort(keys.begin(), keys.end());
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
    if (keys.size() >= ~std::uint32_t{0}) throw_too_many_label_points(keys.size());
    return keys;
}

// For each key of a sequence, its index among the merged ones.
Buffer<std::uint32_t> indices_of(const Buffer<std::uint64_t>& keys, const Buffer<std::uint64_t>& merged) {
    Buffer<std::uint32_t> indices(keys.size());
    parallel_for(std::size_t{0}, keys.size(), [&](std::size_t i) {
        indices[i] = static_cast<std::uint32_t>(std::lower_bound(merged.begin(), merged.end(), keys[i]) -
                                                merged.begin());
    });
    return indices;
}

// The points of the whole net. Parts share points, with equal positions.
struct Net {
    std::vector<Buffer<std::uint32_t>> index_of;  // for each part's points
    Buffer<Vec3f> positions, before_relaxation;

    Net(std::span<const LabelPart> parts, const Progress& progress) {
        Stage stage(progress, 0, 1, parts.size() + 1);
        std::vector<const Buffer<std::uint64_t>*> sequences;
        for (const LabelPart& part : parts) sequences.push_back(&part.net_keys);
        const Buffer<std::uint64_t> keys = merged_keys(sequences);
        stage.step();
        positions.resize(keys.size());
        for (const LabelPart& part : parts) {
            const Buffer<std::uint32_t>& index = index_of.emplace_back(indices_of(part.net_keys, keys));
            for (std::size_t p = 0; p < index.size(); ++p) positions[index[p]] = part.positions[p];
            if (!part.positions_before_relaxation.empty()) {
                before_relaxation.resize(keys.size());
                for (std::size_t p = 0; p < index.size(); ++p)
                    before_relaxation[index[p]] = part.positions_before_relaxation[p];
            }
            stage.step();
        }
    }
};

// A label's surface in one of the parts.
struct Piece {
    const LabelPart::Surface* surface;
    const Buffer<std::uint32_t>* net_index;
};

// Triangles of a piece that begin in one row and follow each other.
struct Run {
    std::array<std::int64_t, 3> order;
    std::size_t piece, begin, end;
};

void append_runs(const LabelPartKeys& keys, const LabelPart::Surface& surface, std::size_t piece,
                 std::vector<Run>& runs) {
    const std::size_t first = runs.size();
    for (std::size_t i = 0; i < surface.triangles.size(); ++i) {
        const Triangle& t = surface.triangles[i];
        const auto cell = [&](std::size_t corner) { return keys.cell_of(surface.keys[t[corner]]); };
        const auto order = EdgeRow::of(cell(0), cell(1), cell(2)).order();
        if (runs.size() > first && runs.back().order == order)
            ++runs.back().end;
        else
            runs.push_back({order, piece, i, i + 1});
    }
}

// Fills in the mesh of a label, and the points of the net that its points are.
void merge_label(const LabelPartKeys& keys, const std::vector<Piece>& pieces, const Net& net, Mesh& mesh,
                 Buffer<std::uint32_t>& net_points) {
    std::vector<const Buffer<std::uint64_t>*> sequences;
    for (const Piece& piece : pieces) sequences.push_back(&piece.surface->keys);
    const Buffer<std::uint64_t> merged = merged_keys(sequences);
    net_points.resize(merged.size());
    mesh.points.resize(merged.size());
    std::vector<Buffer<std::uint32_t>> index_of;
    std::vector<Run> runs;
    std::size_t triangles = 0;
    for (std::size_t n = 0; n < pieces.size(); ++n) {
        const LabelPart::Surface& surface = *pieces[n].surface;
        const Buffer<std::uint32_t>& index = index_of.emplace_back(indices_of(surface.keys, merged));
        for (std::size_t p = 0; p < index.size(); ++p)
            net_points[index[p]] = (*pieces[n].net_index)[surface.net_points[p]];
        append_runs(keys, surface, n, runs);
        triangles += surface.triangles.size();
    }
    for (std::size_t p = 0; p < merged.size(); ++p) mesh.points[p] = net.positions[net_points[p]];
    std::sort(runs.begin(), runs.end(), [](const Run& a, const Run& b) { return a.order < b.order; });
    mesh.triangles.reserve(triangles);
    for (const Run& run : runs) {
        for (std::size_t i = run.begin; i < run.end; ++i) {
            Triangle t = pieces[run.piece].surface->triangles[i];
            for (std::uint32_t& point : t) point = index_of[run.piece][point];
            mesh.triangles.push_back(t);
        }
    }
}

std::vector<LabelSurface> merge(std::span<const LabelPart> parts, const LabelOptions& options) {
    const LabelPartKeys keys(parts.front().whole);
    const Net net(parts, sub_progress(options.progress, 0, 0.15));
    std::map<std::int64_t, std::vector<Piece>> pieces;
    for (std::size_t p = 0; p < parts.size(); ++p) {
        for (const LabelPart::Surface& surface : parts[p].surfaces)
            pieces[surface.label].push_back({&surface, &net.index_of[p]});
    }
    std::vector<std::int64_t> labels;
    for (const auto& [label, unused] : pieces) labels.push_back(label);
    LabelMeshes meshes{std::vector<Mesh>(labels.size()), std::vector<Buffer<std::uint32_t>>(labels.size())};
    Stage stage(options.progress, 0.15, 0.3, labels.size());
    parallel_for(std::size_t{0}, labels.size(), [&](std::size_t l) {
        merge_label(keys, pieces.at(labels[l]), net, meshes.meshes[l], meshes.net_points[l]);
        stage.step();
    });
    if (!net.before_relaxation.empty())
        hold_back_labels(
            meshes, net.positions.size(), [&](const Progress&) { return net.before_relaxation; },
            sub_progress(options.progress, 0.3, 0.9));
    std::vector<LabelSurface> surfaces;
    for (std::size_t l = 0; l < labels.size(); ++l)
        surfaces.push_back({labels[l], std::move(meshes.meshes[l]), meshes.held_back_points[l]});
    if (options.normals) add_label_normals(surfaces, sub_progress(options.progress, 0.9, 1));
    return surfaces;
}

}  // namespace

std::vector<LabelSurface> merge_label_parts(std::span<const LabelPart> parts, const LabelOptions& options) {
    std::vector<LabelSurface> surfaces;
    if (parts.empty()) return surfaces;
    check(parts);
    with_threads(options.threads, [&] { surfaces = merge(parts, options); });
    report_progress(options.progress, 1);
    return surfaces;
}

}  // namespace marrow
