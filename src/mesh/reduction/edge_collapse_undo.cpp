// Undoes collapses by the log, together with the later ones around them.
#include "edge_collapse.h"

#include <algorithm>

namespace marrow::internal {

// The record of a collapse, which is in the log of its region.
EdgeCollapse::Collapse& EdgeCollapse::logged(std::uint32_t collapse) {
    const auto after =
        std::upper_bound(regions_.begin() + 1, regions_.end(), collapse,
                         [](std::uint32_t c, const Region& r) { return c < r.first_collapse; });
    Region& region = collapse < regions_[0].first_collapse ? after[-1] : regions_[0];
    return region.log[collapse - region.first_collapse];
}

// The later one of two collapses, or the first if they are independent. 0: none.
std::uint32_t EdgeCollapse::later_of(std::uint32_t a, std::uint32_t b) {
    if (a == 0 || b == 0) return std::max(a, b);
    return logged(b).time > logged(a).time ? b : a;
}

std::size_t EdgeCollapse::undo(std::span<const std::uint32_t> corners, std::size_t count) {
    std::size_t undone = 0;
    parallel_ = false;
    for (; count > 0; --count) {
        std::uint32_t latest = 0;
        for (const std::uint32_t p : corners) latest = later_of(latest, points_[p].latest);
        if (latest == 0) break;
        undone += undo(latest);
    }
    return undone;
}

// A collapse can be undone if no later one has changed the triangles at its point. A collapse changes the
// triangles at the point that it keeps, so none of their corners may have a later one.
std::size_t EdgeCollapse::undo(std::uint32_t collapse) {
    std::size_t undone = 0;
    std::vector<std::uint32_t> pending{collapse};
    while (!pending.empty()) {
        const std::uint32_t i = pending.back();
        const std::uint32_t kept = from(logged(i).half);
        std::uint32_t latest = i;
        if (points_[kept].latest == i)
            for_each_outgoing(kept, [&](Half out) { latest = later_of(latest, points_[to(out)].latest); });
        if (latest != i) {
            pending.push_back(latest);
            continue;
        }
        if (points_[kept].latest == i) {
            if (i == collapse) points_[kept].fixed = points_[logged(i).removed].fixed = true;
            undo_one(logged(i)), ++undone;
        }
        pending.pop_back();
    }
    return undone;
}

// The inverse of collapse().
void EdgeCollapse::undo_one(Collapse& collapse) {
    const Half h = collapse.half, g = twin(h);
    const std::uint32_t a = from(h), b = collapse.removed;
    for (const Half side : {next(h), prev(h), next(g), prev(g)}) pair(side, twin(side));
    for (const Half revived : {h, g}) {
        faces_[revived / 4].alive = true;
        std::uint8_t& degree = points_[from(prev(revived))].degree;
        if (degree != kHighDegree) ++degree;
    }
    alive_ += 2;
    Half out = g;
    do {
        faces_[out / 4].from[out % 4] = b;
        out = twin(prev(out));
    } while (out != g);
    Point &kept = points_[a], &revived = points_[b];
    const bool is_fixed = kept.fixed;
    kept = collapse.kept;
    kept.fixed = is_fixed;
    kept.outgoing = h;
    revived.outgoing = g;
    kept.changed = revived.changed = kept.is_new = revived.is_new = true;
    collapse.removed = kNone;
}

}  // namespace marrow::internal
