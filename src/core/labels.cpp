#include <marrow/labels.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>
#include <string>
#include <utility>

#include <hwy/base.h>
#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include "case_table.h"
#include "dispatch.h"
#include "frame.h"
#include "label_net.h"
#include "label_relax.h"

namespace marrow {

using namespace internal;

namespace {

// What is remembered of the last 256 labels: one each for labels with different lowest bits, as they are few and mostly small.
template <class T, class Known>
class Recent {
  public:
    explicit Recent(const Known& known) { known_.fill(known); }
    Known& of(T label) { return known_[static_cast<std::uint8_t>(static_cast<std::int64_t>(label))]; }

  private:
    std::array<Known, 256> known_;
};

// Ascending values.
template <class T>
class Values {
  public:
    explicit Values(T first) : values_{first}, recent_(first) {}

    void add(T value) {
        if (std::exchange(recent_.of(value), value) == value) return;
        const auto at = std::lower_bound(values_.begin(), values_.end(), value);
        if (at == values_.end() || *at != value) values_.insert(at, value);
    }
    const std::vector<T>& all() const { return values_; }

  private:
    std::vector<T> values_;
    Recent<T, T> recent_;
};

// Where each of some ascending values is.
template <class T>
class Places {
  public:
    explicit Places(const std::vector<T>& values) : values_(values), recent_({values[0], 0}) {}
    std::size_t operator()(T value) {
        Found& found = recent_.of(value);
        if (found.value != value) {
            const auto at = std::lower_bound(values_.begin(), values_.end(), value);
            found = {value, static_cast<std::uint32_t>(at - values_.begin())};
        }
        return found.place;
    }

  private:
    struct Found {
        T value;
        std::uint32_t place;
    };
    const std::vector<T>& values_;
    Recent<T, Found> recent_;
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
    tbb::enumerable_thread_specific<Values<T>> of_thread(labels.background);
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
    Values<T> values(labels.background);
    for (const Values<T>& seen : of_thread) {
        for (const T value : seen.all()) values.add(value);
    }
    return values;
}

// Two triangles (0, 1, 2) and (0, 2, 3) of the net; or one, where 2 and 3 are the same.
using Quad = std::array<std::uint32_t, 4>;

// A label's quads. All is added alike, but the background's quads are written over each other: a branch would be mispredicted at
// every other border.
class QuadList {
  public:
    void drop_all() { step_ = 0; }
    bool keeps() const { return step_ != 0; }
    HWY_INLINE void add(const Quad& quad) {
        if (size_ == quads_.size()) grow();
        quads_[size_] = quad;
        size_ += step_;
    }
    std::span<const Quad> all() const { return {quads_.data(), size_}; }
    void give_up() {
        size_ = 0;
        Buffer<Quad>().swap(quads_);
    }

  private:
    HWY_NOINLINE void grow() { quads_.resize(std::max<std::size_t>(32, 2 * size_)); }

    Buffer<Quad> quads_;
    std::size_t size_ = 0, step_ = 1;
};

// Grid edges along an axis: the four cells round each, counter-clockwise seen from its upper end.
struct EdgeKind {
    std::size_t axis = 0;
    std::array<std::size_t, 4> row{};         // of the cells, as CellIds has them
    std::array<std::ptrdiff_t, 4> step{};     // along the row
    std::array<std::size_t, 4> local_edge{};  // what the edge is to each cell
};

constexpr std::array<EdgeKind, 3> kEdgeKinds = [] {
    constexpr int kRing[4][2] = {{-1, -1}, {0, -1}, {0, 0}, {-1, 0}};
    std::array<EdgeKind, 3> kinds;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
        kinds[axis].axis = axis;
        for (std::size_t c = 0; c < 4; ++c) {
            int step[3] = {0, 0, 0};
            step[u] = kRing[c][0];
            step[v] = kRing[c][1];
            kinds[axis].row[c] = static_cast<std::size_t>((step[1] + 1) + 2 * (step[2] + 1));
            kinds[axis].step[c] = step[0];
            const int corner = (kRing[c][0] < 0 ? 1 << u : 0) | (kRing[c][1] < 0 ? 1 << v : 0);
            for (std::size_t e = 0; e < kCellEdges; ++e) {
                if (kEdgeCorners[e][0] == corner && kEdgeCorners[e][1] == (corner | 1 << axis))
                    kinds[axis].local_edge[c] = e;
            }
        }
    }
    return kinds;
}();

// The four rows of cells round a row (j, k) of samples: (j - 1, k - 1), (j, k - 1), (j - 1, k), (j, k).
class CellsRound {
  public:
    explicit CellsRound(const LabelNet& net)
        : net_(net), rows_{CellIds(net.bits), CellIds(net.bits), CellIds(net.bits), CellIds(net.bits)} {}
    // Goes to the next row of samples of a slice; j = 0: to its first, which has no crossed edges but those to the next.
    void move_to(std::int64_t j, std::int64_t k) {
        std::swap(rows_[0], rows_[1]);
        std::swap(rows_[2], rows_[3]);
        if (k > 0) rows_[1].fill(net_, j, k - 1);
        rows_[3].fill(net_, j, k);
    }
    // Where the first points of the cells c round edges (0, j, k), (1, j, k), ... are. Only active cells have one.
    const std::uint32_t* round(const EdgeKind& edges, std::size_t c) const {
        return rows_[edges.row[c]].at(edges.step[c]);
    }

  private:
    const LabelNet& net_;
    std::array<CellIds, 4> rows_;
};

// Makes the patches of grid edges.
class Patches {
  public:
    explicit Patches(const LabelNet& net) : net_(net) {}

    // Appends the patch of an edge between cells with these first points: facing the edge's upper end, for the label at its
    // lower end; and turned over, for that at its upper end.
    HWY_INLINE void add(const EdgeKind& edges, const Quad& ids, QuadList& lower, QuadList& upper) const {
        if (net_.is_complex(ids[0]) || net_.is_complex(ids[1]) || net_.is_complex(ids[2]) ||
            net_.is_complex(ids[3])) {
            add_complex(edges, ids, lower, upper);
            return;
        }
        const auto [a, b, c, d] = from_shorter_diagonal(ids);
        lower.add({a, b, c, d});
        upper.add({a, d, c, b});
    }

  private:
    float squared(std::uint32_t a, std::uint32_t b) const {
        const Vec3f &p = net_.points[a], &q = net_.points[b];
        const float x = p[0] - q[0], y = p[1] - q[1], z = p[2] - q[2];
        return x * x + y * y + z * z;
    }
    Quad from_shorter_diagonal(const Quad& p) const {
        const std::size_t from = squared(p[0], p[2]) <= squared(p[1], p[3]) ? 0 : 1;
        return {p[from], p[from + 1], p[from + 2], p[(from + 3) % 4]};
    }

    HWY_NOINLINE void add_complex(const EdgeKind& edges, const Quad& ids, QuadList& lower,
                                  QuadList& upper) const {
        std::array<const ComplexCell*, 4> cells;
        for (std::size_t c = 0; c < 4; ++c)
            cells[c] = net_.is_complex(ids[c]) ? &net_.complex_cell(ids[c]) : nullptr;
        // The points of knots between the cells, 0: none. The face between a cell and the next is the lower one of whichever lies
        // higher.
        constexpr std::size_t kHigher[4] = {1, 2, 2, 3};
        const std::size_t across[2] = {(edges.axis + 1) % 3, (edges.axis + 2) % 3};
        Quad knots{};
        for (std::size_t c = 0; c < 4; ++c) {
            const std::size_t axis = across[c % 2], edge = edges.local_edge[kHigher[c]];
            const ComplexCell* higher = cells[kHigher[c]];
            if (higher != nullptr && higher->knots[axis] != 0)
                knots[c] =
                    higher->knots[axis] + static_cast<std::uint32_t>(higher->patches.knot[2 * axis][edge]);
        }
        for (std::size_t end = 0; end < 2; ++end) {
            QuadList& list = end == 0 ? lower : upper;
            if (!list.keeps()) continue;
            Quad points = ids;
            for (std::size_t c = 0; c < 4; ++c) {
                if (cells[c] != nullptr)
                    points[c] = cells[c]->point(cells[c]->patches.point[edges.local_edge[c]][end]);
            }
            if (knots == Quad{}) {
                const auto [a, b, c, d] = from_shorter_diagonal(points);
                list.add(end == 0 ? Quad{a, b, c, d} : Quad{a, d, c, b});
            } else {
                add_fan(points, knots, end, list);
            }
        }
    }

    // A polygon with knots, as a fan from the first of these: a diagonal beside it could be another patch's too, as the face has
    // two knots.
    static void add_fan(const Quad& points, const Quad& knots, std::size_t end, QuadList& list) {
        std::array<std::uint32_t, 8> polygon{};
        std::size_t size = 0, from = polygon.size();
        for (std::size_t c = 0; c < 4; ++c) {
            polygon[size++] = points[c];
            if (knots[c] == 0) continue;
            from = std::min(from, size);
            polygon[size++] = knots[c];
        }
        const auto next = [&](std::size_t n) { return n + 1 < size ? n + 1 : 0; };
        for (std::size_t n = next(from); next(n) != from; n = next(n)) {
            const std::uint32_t a = polygon[from], b = polygon[n], c = polygon[next(n)];
            list.add(end == 0 ? Quad{a, b, c, c} : Quad{a, c, b, b});
        }
    }

    const LabelNet& net_;
};

// The quads of all labels, by piece of the net and then by place of the label's value.
using Pieces = std::vector<std::vector<QuadList>>;
constexpr std::int64_t kSlices = 8;  // to a piece

template <class T>
Pieces make_quads(const LabelReader<T>& labels, const LabelNet& net, const Values<T>& values,
                  const Progress& progress) {
    const BorderBits& bits = net.bits;
    const std::size_t count = values.all().size();
    Pieces pieces(static_cast<std::size_t>((bits.dims[2] + kSlices) / kSlices), std::vector<QuadList>(count));
    const Patches patches(net);
    Stage stage(progress, 0.6, 0.8, pieces.size());
    const std::size_t background = Places<T>(values.all())(labels.background);
    tbb::parallel_for(std::size_t{0}, pieces.size(), [&](std::size_t piece) {
        std::vector<QuadList>& made = pieces[piece];
        made[background].drop_all();
        Places<T> place(values.all());
        CellsRound cells(net);
        const std::int64_t first = static_cast<std::int64_t>(piece) * kSlices;
        for (std::int64_t k = first; k < std::min(first + kSlices, bits.dims[2] + 1); ++k) {
            for (std::int64_t j = 0; j <= bits.dims[1]; ++j) {
                cells.move_to(j, k);
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    const EdgeKind& edges = kEdgeKinds[axis];
                    const T* from = labels.row(j, k);
                    const T* to = labels.row(j + (axis == 1), k + (axis == 2));
                    const std::int64_t step = axis == 0 ? 1 : 0;
                    const std::array<const std::uint32_t*, 4> ids = {
                        cells.round(edges, 0), cells.round(edges, 1), cells.round(edges, 2),
                        cells.round(edges, 3)};
                    for_each_crossed(bits, axis, bits.row(j, k), [&](std::int64_t i) {
                        patches.add(edges, {ids[0][i], ids[1][i], ids[2][i], ids[3][i]},
                                    made[place(labels.at(from, i))], made[place(labels.at(to, i + step))]);
                    });
                }
            }
        }
        stage.step();
    });
    return pieces;
}

// The points of the net that a mesh has. One serves mesh after mesh, as collect takes its marks away.
class OwnPoints {
  public:
    explicit OwnPoints(std::size_t points)
        : used_((points + 7) / 8 * 8, 0), place_(points), points_(points) {}

    void mark(std::uint32_t point) { used_[point] = 1; }
    // Appends the marked points of [begin, end), and of the words that these lie in, to the mesh's.
    void collect(std::size_t begin, std::size_t end) {
        for (std::size_t word = begin / 8 * 8; word < end; word += 8) {
            std::uint64_t marks;
            std::memcpy(&marks, &used_[word], 8);
            if (marks == 0) continue;
            std::memset(&used_[word], 0, 8);
            for (; marks != 0; marks &= marks - 1) {
                const std::size_t p = word + static_cast<std::size_t>(__builtin_ctzll(marks)) / 8;
                place_[p] = static_cast<std::uint32_t>(count_);
                points_[count_++] = static_cast<std::uint32_t>(p);
            }
        }
    }
    // The place of a point among them.
    std::uint32_t place(std::uint32_t point) const { return place_[point]; }
    Buffer<Vec3f> take(const Buffer<Vec3f>& all) {
        Buffer<Vec3f> own(count_);
        for (std::size_t i = 0; i < count_; ++i) own[i] = all[points_[i]];
        count_ = 0;
        return own;
    }

  private:
    std::vector<std::uint8_t> used_;        // padded to whole words
    Buffer<std::uint32_t> place_, points_;  // of the points of the net, and of the mesh
    std::size_t count_ = 0;
};

// A label's mesh: its quads as triangles, and its points in the net's order. The quads are given up.
Mesh own_mesh(Pieces& pieces, std::size_t label, const LabelNet& net, bool mirrored, OwnPoints& own) {
    std::size_t triangles = 0;
    std::int64_t first_slice = net.bits.dims[2],
                 end_slice = first_slice;  // of cells that may have its points
    for (std::size_t piece = 0; piece < pieces.size(); ++piece) {
        const std::span<const Quad> quads = pieces[piece][label].all();
        if (quads.empty()) continue;
        const std::int64_t begin = static_cast<std::int64_t>(piece) * kSlices;
        first_slice = std::min(first_slice, std::max(begin - 1, std::int64_t{0}));
        end_slice = std::min(begin + kSlices, net.bits.dims[2] + 1);
        for (const Quad& q : quads) {
            for (const std::uint32_t p : q) own.mark(p);
            triangles += q[2] == q[3] ? 1 : 2;
        }
    }
    own.collect(net.first_point_of_slice(first_slice), net.first_point_of_slice(end_slice));
    own.collect(net.complex_number.size(), net.points.size());
    Mesh mesh;
    mesh.points = own.take(net.points);
    mesh.triangles.resize(triangles);
    Triangle* next = mesh.triangles.data();
    for (auto& piece : pieces) {
        for (const Quad& q : piece[label].all()) {
            std::uint32_t a = own.place(q[0]), b = own.place(q[1]), c = own.place(q[2]), d = own.place(q[3]);
            if (mirrored) {
                std::swap(b, d);
                if (q[2] == q[3])
                    b = c, c = d = own.place(q[1]);  // one triangle: its last corners are turned
            }
            *next++ = {a, b, c};
            if (c != d) *next++ = {a, c, d};
        }
        piece[label].give_up();
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
    tbb::enumerable_thread_specific<OwnPoints> own_of_thread(net.points.size());
    tbb::parallel_for(std::size_t{0}, surfaces.size(), [&](std::size_t i) {
        surfaces[i].mesh = own_mesh(pieces, places[i], net, frame.mirrored, own_of_thread.local());
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
