#include <marrow/labels.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include "case_table.h"
#include "dispatch.h"
#include "frame.h"
#include "label_net.h"

namespace marrow {

using namespace internal;

namespace {

// Ascending values, and where each is. Remembers the last one asked for: neighbours are often alike.
template <class T>
class Values {
  public:
    void add(T value) {
        if (!values_.empty() && value == values_[last_]) return;
        const auto at = std::lower_bound(values_.begin(), values_.end(), value);
        last_ = static_cast<std::size_t>(at - values_.begin());
        if (at == values_.end() || *at != value) values_.insert(at, value);
    }
    std::size_t place(T value) {
        if (value != values_[last_])
            last_ = static_cast<std::size_t>(std::lower_bound(values_.begin(), values_.end(), value) -
                                             values_.begin());
        return last_;
    }
    const std::vector<T>& all() const { return values_; }

  private:
    std::vector<T> values_;
    std::size_t last_ = 0;
};

// Calls f(i) for the crossed grid edges of a row.
template <class F>
void for_each_crossed(const BorderBits& bits, std::size_t axis, std::size_t row, const F& f) {
    const std::uint64_t* words = &bits.crossed[axis][row];
    for (std::size_t w = 0; w < bits.words; ++w) {
        for (std::uint64_t left = words[w]; left != 0; left &= left - 1)
            f(static_cast<std::int64_t>(64 * w) + __builtin_ctzll(left));
    }
}

// Every label that is there begins somewhere along x, as beyond the volume there is background.
template <class T>
Values<T> find_values(const LabelReader<T>& labels, const BorderBits& bits) {
    constexpr std::size_t kMost = 65535;
    tbb::enumerable_thread_specific<Values<T>> of_thread;
    tbb::parallel_for(std::int64_t{1}, bits.dims[2] + 1, [&](std::int64_t k) {
        Values<T>& seen = of_thread.local();
        for (std::int64_t j = 1; j <= bits.dims[1]; ++j) {
            const T* row = labels.row(j, k);
            for_each_crossed(bits, 0, bits.row(j, k),
                             [&](std::int64_t i) { seen.add(labels.at(row, i + 1)); });
        }
        if (seen.all().size() > kMost)
            throw InputError("the label map has more than 65535 different values: is it one?");
    });
    Values<T> values;
    values.add(labels.background);
    for (const Values<T>& seen : of_thread) {
        for (const T value : seen.all()) values.add(value);
    }
    return values;
}

// A polygon between the points of the cells round a grid edge, and of knots between them.
struct Polygon {
    static constexpr std::size_t kNone = 8;
    std::array<std::uint32_t, 8> points{};
    std::size_t size = 0;
    std::size_t fan_from = kNone;  // a knot's point, where there is one

    void add(std::uint32_t point) { points[size++] = point; }
    void add_knot(std::uint32_t point) {
        if (fan_from == kNone) fan_from = size;
        add(point);
    }
};

// Two triangles (0, 1, 2) and (0, 2, 3) of the net; or one, where 2 and 3 are the same.
using Quad = std::array<std::uint32_t, 4>;

// The grid edges along an axis from a row of samples, and the four cells round each, counter-clockwise seen from its upper end.
struct EdgeRow {
    std::size_t axis;
    std::array<std::int64_t, 4> step_i{};     // of the cells from the edge
    std::array<std::size_t, 4> row{};         // of the cells
    std::array<std::size_t, 4> local_edge{};  // what the edge is to each cell

    EdgeRow(const BorderBits& bits, std::size_t along, std::int64_t j, std::int64_t k) : axis(along) {
        constexpr std::int64_t kRing[4][2] = {{-1, -1}, {0, -1}, {0, 0}, {-1, 0}};
        const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
        for (std::size_t c = 0; c < 4; ++c) {
            Index3 step{};
            step[u] = kRing[c][0];
            step[v] = kRing[c][1];
            step_i[c] = step[0];
            const std::int64_t cell_j = j + step[1], cell_k = k + step[2];
            row[c] = cell_j >= 0 && cell_k >= 0 ? bits.row(cell_j, cell_k)
                                                : 0;  // else the row has no crossed edges
            const int corner = (kRing[c][0] < 0 ? 1 << u : 0) | (kRing[c][1] < 0 ? 1 << v : 0);
            for (std::size_t e = 0; e < kCellEdges; ++e) {
                if (kEdgeCorners[e][0] == corner && kEdgeCorners[e][1] == (corner | 1 << axis))
                    local_edge[c] = e;
            }
        }
    }
};

// Makes the patches of grid edges.
class Patches {
  public:
    explicit Patches(const LabelNet& net) : net_(net) {}

    // Appends the patch of edge i of a row, facing the edge's upper end, for the label at its lower end; and turned over for
    // that at its upper end. Null: that label has no surface.
    void add(const EdgeRow& edges, std::int64_t i, std::vector<Quad>* lower, std::vector<Quad>* upper) const {
        Quad id;
        bool complex = false;
        for (std::size_t c = 0; c < 4; ++c) {
            id[c] = net_.first_point(i + edges.step_i[c], edges.row[c]);
            complex |= net_.is_complex[id[c]] != 0;
        }
        if (complex) {
            if (lower != nullptr) add_polygon(edges, id, 0, *lower);
            if (upper != nullptr) add_polygon(edges, id, 1, *upper);
            return;
        }
        // Along the shorter diagonal.
        const bool first = squared(id[0], id[2]) <= squared(id[1], id[3]);
        const auto [a, b, c, d] = first ? id : Quad{id[1], id[2], id[3], id[0]};
        if (lower != nullptr) lower->push_back({a, b, c, d});
        if (upper != nullptr) upper->push_back({a, d, c, b});
    }

  private:
    float squared(std::uint32_t a, std::uint32_t b) const {
        const Vec3f &p = net_.points[a], &q = net_.points[b];
        const float x = p[0] - q[0], y = p[1] - q[1], z = p[2] - q[2];
        return x * x + y * y + z * z;
    }
    std::uint32_t point(std::uint32_t id, std::size_t e, int end) const {
        if (net_.is_complex[id] == 0) return id;
        const ComplexCell& cell = net_.complex_cell(id);
        return cell.point(cell.patches.point[e][static_cast<std::size_t>(end)]);
    }
    // The point of the knot that edge e has on the lower face along an axis; 0: the knot has none.
    std::uint32_t knot_point(std::uint32_t id, std::size_t axis, std::size_t e) const {
        if (net_.is_complex[id] == 0) return 0;
        const ComplexCell& cell = net_.complex_cell(id);
        if (cell.knots[axis] == 0) return 0;
        return cell.knots[axis] + static_cast<std::uint32_t>(cell.patches.knot[2 * axis][e]);
    }

    void add_polygon(const EdgeRow& edges, const Quad& id, int end, std::vector<Quad>& to) const {
        const std::size_t u = (edges.axis + 1) % 3, v = (edges.axis + 2) % 3;
        // The face between a cell of the ring and the next is the lower one of whichever lies higher.
        constexpr std::size_t kHigher[4] = {1, 2, 2, 3};
        Polygon polygon;
        for (std::size_t c = 0; c < 4; ++c) {
            polygon.add(point(id[c], edges.local_edge[c], end));
            const std::size_t higher = kHigher[c];
            if (const std::uint32_t knot =
                    knot_point(id[higher], c % 2 == 0 ? u : v, edges.local_edge[higher]))
                polygon.add_knot(knot);
        }
        // As a fan from a knot's point, where there is one: a diagonal beside it could be another patch's too, as the face has
        // two knots.
        const Polygon& p = polygon;
        std::size_t from = p.fan_from;
        if (from == Polygon::kNone)
            from = squared(p.points[0], p.points[2]) <= squared(p.points[1], p.points[3]) ? 0 : 1;
        for (std::size_t n = 1; n + 1 < p.size; ++n) {
            const std::uint32_t a = p.points[from], b = p.points[(from + n) % p.size],
                                c = p.points[(from + n + 1) % p.size];
            to.push_back(end == 0 ? Quad{a, b, c, c} : Quad{a, c, b, b});
        }
    }

    const LabelNet& net_;
};

// The quads of all labels, by piece of the net and then by place of the label's value.
using Pieces = std::vector<std::vector<std::vector<Quad>>>;

template <class T>
Pieces make_quads(const LabelReader<T>& labels, const LabelNet& net, const Values<T>& values,
                  const Progress& progress) {
    constexpr std::int64_t kSlices = 8;  // to a piece
    const BorderBits& bits = net.bits;
    const std::size_t count = values.all().size();
    Pieces pieces(static_cast<std::size_t>((bits.dims[2] + kSlices) / kSlices),
                  std::vector<std::vector<Quad>>(count));
    const Patches patches(net);
    Stage stage(progress, 0.6, 0.8, pieces.size());
    const std::size_t background = Values<T>(values).place(labels.background);
    tbb::parallel_for(std::size_t{0}, pieces.size(), [&](std::size_t piece) {
        std::vector<std::vector<Quad>>& made = pieces[piece];
        Values<T> lower = values, upper = values;
        const std::int64_t first = static_cast<std::int64_t>(piece) * kSlices;
        for (std::int64_t k = first; k < std::min(first + kSlices, bits.dims[2] + 1); ++k) {
            for (std::int64_t j = 0; j <= bits.dims[1]; ++j) {
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    const EdgeRow edges(bits, axis, j, k);
                    const T* from = labels.row(j, k);
                    const T* to = labels.row(j + (axis == 1), k + (axis == 2));
                    const std::int64_t step = axis == 0 ? 1 : 0;
                    for_each_crossed(bits, axis, bits.row(j, k), [&](std::int64_t i) {
                        const std::size_t a = lower.place(labels.at(from, i)),
                                          b = upper.place(labels.at(to, i + step));
                        patches.add(edges, i, a != background ? &made[a] : nullptr,
                                    b != background ? &made[b] : nullptr);
                    });
                }
            }
        }
        stage.step();
    });
    return pieces;
}

// A label's mesh: its quads as triangles, and its points in the net's order. The quads are given up.
Mesh own_mesh(Pieces& pieces, std::size_t label, const Buffer<Vec3f>& points, bool mirrored) {
    std::vector<std::uint64_t> used((points.size() + 63) / 64, 0);
    std::size_t triangles = 0;
    for (const auto& piece : pieces) {
        for (const Quad& q : piece[label]) {
            for (const std::uint32_t p : q) used[p / 64] |= std::uint64_t{1} << (p % 64);
            triangles += q[2] == q[3] ? 1 : 2;
        }
    }
    std::vector<std::uint32_t> before(used.size());
    std::uint32_t count = 0;
    for (std::size_t w = 0; w < used.size(); ++w) {
        before[w] = count;
        count += static_cast<std::uint32_t>(__builtin_popcountll(used[w]));
    }
    Mesh mesh;
    mesh.points.resize(count);
    for (std::size_t w = 0, next = 0; w < used.size(); ++w) {
        for (std::uint64_t left = used[w]; left != 0; left &= left - 1)
            mesh.points[next++] = points[64 * w + static_cast<std::size_t>(__builtin_ctzll(left))];
    }
    const auto own = [&](std::uint32_t p) {
        const std::uint64_t below = used[p / 64] & ((std::uint64_t{1} << (p % 64)) - 1);
        return before[p / 64] + static_cast<std::uint32_t>(__builtin_popcountll(below));
    };
    mesh.triangles.resize(triangles);
    Triangle* next = mesh.triangles.data();
    for (auto& piece : pieces) {
        for (const Quad& q : piece[label]) {
            std::uint32_t a = own(q[0]), b = own(q[1]), c = own(q[2]), d = own(q[3]);
            if (mirrored) {
                std::swap(b, d);
                if (q[2] == q[3]) b = c, c = d = own(q[1]);  // one triangle: its last corners are turned
            }
            *next++ = {a, b, c};
            if (c != d) *next++ = {a, c, d};
        }
        std::vector<Quad>().swap(piece[label]);
    }
    return mesh;
}

// Unit normals from the triangles around each point, by area.
void add_normals(Mesh& mesh) {
    mesh.normals.assign(mesh.points.size(), Vec3f{});
    for (const Triangle& t : mesh.triangles) {
        const Vec3f &a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]];
        const Vec3f u{b[0] - a[0], b[1] - a[1], b[2] - a[2]}, v{c[0] - a[0], c[1] - a[1], c[2] - a[2]};
        const Vec3f n{u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
        for (const std::uint32_t p : t) {
            for (std::size_t r = 0; r < 3; ++r) mesh.normals[p][r] += n[r];
        }
    }
    for (Vec3f& n : mesh.normals) {
        const float length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        if (length > 0)
            for (float& x : n) x /= length;
        else
            n = {0, 0, 1};  // triangles that cancel: any direction is as good
    }
}

template <class T>
LabelReader<T> reader_of(const VolumeView& map, std::int64_t background) {
    const T* samples = static_cast<const T*>(map.data);
    const T value = static_cast<T>(background);
    if (static_cast<std::int64_t>(value) != background)
        throw InputError("the background label does not fit the map's samples");
    if constexpr (std::is_floating_point_v<T>) {
        constexpr T kMost = sizeof(T) == 4 ? T(1 << 24) : T(std::int64_t{1} << 53);
        tbb::parallel_for(
            tbb::blocked_range<std::int64_t>(0, map.geometry.sample_count(), 1 << 16),
            [&](const auto& range) {
                for (std::int64_t i = range.begin(); i < range.end(); ++i) {
                    if (!(std::abs(samples[i]) <= kMost) || std::trunc(samples[i]) != samples[i])
                        throw InputError(
                            "the samples are no labels, as they are not all integers; label maps hold "
                            "integers");
                }
            });
    }
    return {samples, map.geometry.dims, value};
}

// The story: find borders and points, relax, make triangles, part them by labels.
template <class T>
std::vector<LabelSurface> extract(const VolumeView& map, const LabelOptions& options) {
    const LabelReader<T> labels = reader_of<T>(map, options.background);
    LabelNet net = make_net(labels, options.progress);
    const Values<T> values = find_values(labels, net.bits);
    relax(net, options.relax, options.progress);

    const Frame frame(map.geometry);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, net.points.size(), 1 << 14), [&](const auto& range) {
        for (std::size_t p = range.begin(); p < range.end(); ++p) {
            const Vec3f at = net.points[p];
            for (std::size_t r = 0; r < 3; ++r) {
                net.points[p][r] =
                    static_cast<float>(frame.origin[r] + frame.exact[r][0] * double(at[0]) +
                                       frame.exact[r][1] * double(at[1]) + frame.exact[r][2] * double(at[2]));
            }
        }
    });

    Pieces pieces = make_quads(labels, net, values, options.progress);
    std::vector<std::size_t> places;
    std::vector<LabelSurface> surfaces;
    for (std::size_t i = 0; i < values.all().size(); ++i) {
        if (values.all()[i] == labels.background) continue;
        places.push_back(i);
        surfaces.push_back({static_cast<std::int64_t>(values.all()[i]), {}});
    }
    Stage stage(options.progress, 0.8, 1, surfaces.size());
    tbb::parallel_for(std::size_t{0}, surfaces.size(), [&](std::size_t i) {
        surfaces[i].mesh = own_mesh(pieces, places[i], net.points, frame.mirrored);
        if (options.normals) add_normals(surfaces[i].mesh);
        stage.step();
    });
    return surfaces;
}

}  // namespace

std::vector<LabelSurface> extract_labels(const VolumeView& map, const LabelOptions& options) {
    check_geometry(map.geometry);
    if (map.data == nullptr && map.geometry.sample_count() > 0) throw InputError("volume has no samples");
    if (options.relax < 0) throw InputError("the number of relaxation passes must not be negative");
    std::vector<LabelSurface> surfaces;
    if (!has_cells(map.geometry, true)) return surfaces;
    with_threads(options.threads, [&] {
        surfaces =
            with_sample_type(map.type, [&](auto sample) { return extract<decltype(sample)>(map, options); });
    });
    report(options.progress, 1);
    return surfaces;
}

}  // namespace marrow
