// Joins and replaces the output of slices.
#include "snap_output.h"

#include <algorithm>

#include "base/checked_size.h"
#include "base/parallel.h"

namespace marrow::internal {

namespace {

Triangle shifted(Triangle triangle, std::uint64_t by) {
    for (std::uint32_t& p : triangle) p += static_cast<std::uint32_t>(by);
    return triangle;
}

SliceStart operator+(const SliceStart& a, const SliceStart& b) {
    return {a.point + b.point, a.triangle + b.triangle, a.cap + b.cap};
}

void resize(SnapOutput& output, const SliceStart& size, bool normals) {
    output.mesh.points.resize(checked_size(size.point, sizeof(Vec3f)));
    output.mesh.normals.resize(normals ? output.mesh.points.size() : 0);
    output.mesh.triangles.resize(checked_size(size.triangle, sizeof(Triangle)));
    output.cells.resize(output.mesh.triangles.size());
}

template <class List>
void copy_to(const List& from, List& to, std::uint64_t begin) {
    std::copy(from.begin(), from.end(), to.begin() + static_cast<std::ptrdiff_t>(begin));
}

// Copies the output of some slices, except for caps, to where it begins in another.
void copy_to(const SnapOutput& from, SnapOutput& to, const SliceStart& begin) {
    copy_to(from.mesh.points, to.mesh.points, begin.point);
    copy_to(from.mesh.normals, to.mesh.normals, from.mesh.normals.empty() ? 0 : begin.point);
    copy_to(from.cells, to.cells, begin.triangle);
    std::transform(from.mesh.triangles.begin(), from.mesh.triangles.end(),
                   to.mesh.triangles.begin() + static_cast<std::ptrdiff_t>(begin.triangle),
                   [&](const Triangle& t) { return shifted(t, begin.point); });
}

// Appends the caps [begin, end) of other output.
void append_caps(const std::vector<CapTriangle>& from, std::uint64_t begin, std::uint64_t end,
                 std::uint64_t first_point, std::vector<CapTriangle>& to) {
    for (std::uint64_t i = begin; i < end; ++i) {
        to.push_back(from[static_cast<std::size_t>(i)]);
        to.back().triangle = shifted(to.back().triangle, first_point);
    }
}

// Moves the elements [begin, end) towards the end.
template <class List>
void move_up(List& list, std::uint64_t begin, std::uint64_t end, std::uint64_t by) {
    if (by == 0 || list.empty()) return;
    const auto at = [&](std::uint64_t i) { return list.begin() + static_cast<std::ptrdiff_t>(i); };
    std::copy_backward(at(begin), at(end), at(end + by));
}

// Moves the output of slices, except for caps, by as many points and triangles.
void move_up(SnapOutput& output, const SliceStart& begin, const SliceStart& end, const SliceStart& by) {
    move_up(output.mesh.points, begin.point, end.point, by.point);
    move_up(output.mesh.normals, begin.point, end.point, by.point);
    move_up(output.cells, begin.triangle, end.triangle, by.triangle);
    Triangle* const triangles = output.mesh.triangles.data();
    for (std::uint64_t t = end.triangle; t-- > begin.triangle;)
        triangles[t + by.triangle] = shifted(triangles[t], by.point);
}

}  // namespace

std::size_t SnapOutput::bytes() const {
    return mesh.points.capacity() * sizeof mesh.points[0] + mesh.normals.capacity() * sizeof mesh.normals[0] +
           mesh.triangles.capacity() * sizeof mesh.triangles[0] + cells.capacity() * sizeof cells[0] +
           caps.capacity() * sizeof caps[0] + starts.capacity() * sizeof starts[0];
}

void join(const std::vector<const SnapOutput*>& slabs, SnapOutput& all) {
    all.starts.clear();
    all.caps.clear();
    std::vector<SliceStart> begins;
    SliceStart end;
    for (const SnapOutput* slab : slabs) {
        begins.push_back(end);
        for (std::size_t z = 0; z < slab->slices(); ++z) all.starts.push_back(end + slab->starts[z]);
        append_caps(slab->caps, 0, slab->caps.size(), end.point, all.caps);
        end = end + slab->starts.back();
    }
    all.starts.push_back(end);
    const bool normals = std::any_of(slabs.begin(), slabs.end(),
                                     [](const SnapOutput* slab) { return !slab->mesh.normals.empty(); });
    resize(all, end, normals);
    parallel_for(std::size_t{0}, slabs.size(), [&](std::size_t s) { copy_to(*slabs[s], all, begins[s]); });
}

void replace_slices(SnapOutput& output, const std::vector<SnapPart>& parts) {
    const std::vector<SliceStart> before = output.starts;
    // How much there is more, up to the end of each part.
    std::vector<SliceStart> more(parts.size() + 1);
    for (std::size_t i = 0; i < parts.size(); ++i) {
        const auto& [begin, part] = parts[i];
        const SliceStart &old_begin = before[begin], &old_end = before[begin + part.slices()],
                         &size = part.starts.back();
        more[i + 1] = {more[i].point + size.point - (old_end.point - old_begin.point),
                       more[i].triangle + size.triangle - (old_end.triangle - old_begin.triangle),
                       more[i].cap + size.cap - (old_end.cap - old_begin.cap)};
    }
    std::vector<CapTriangle> caps;
    for (std::size_t i = 0; i <= parts.size(); ++i) {
        const std::size_t from = i > 0 ? parts[i - 1].begin + parts[i - 1].output.slices() : 0,
                          to = i < parts.size() ? parts[i].begin : output.slices();
        append_caps(output.caps, before[from].cap, before[to].cap, more[i].point, caps);
        if (i == parts.size()) break;
        const SnapPart& part = parts[i];
        append_caps(part.output.caps, 0, part.output.caps.size(), before[to].point + more[i].point, caps);
    }
    output.caps = std::move(caps);
    resize(output, before.back() + more.back(), !output.mesh.normals.empty());
    // From the end, so that nothing is overwritten before it is moved.
    for (std::size_t i = parts.size(); i-- > 0;) {
        const auto& [begin, part] = parts[i];
        const std::size_t end = begin + part.slices(),
                          next = i + 1 < parts.size() ? parts[i + 1].begin : output.slices();
        move_up(output, before[end], before[next], more[i + 1]);
        copy_to(part, output, before[begin] + more[i]);
        for (std::size_t z = begin; z < end; ++z)
            output.starts[z] = before[begin] + more[i] + part.starts[z - begin];
        for (std::size_t z = end; z < next; ++z) output.starts[z] = before[z] + more[i + 1];
    }
    output.starts.back() = before.back() + more.back();
}

}  // namespace marrow::internal
