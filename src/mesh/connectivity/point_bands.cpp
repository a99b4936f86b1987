// Finds which points each section of successive triangles reaches.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mesh/connectivity/point_bands.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "point_bands.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

// A plain loop, which compilers turn into vectors.
void extend(Reach& reach, const std::uint32_t* points, std::size_t count) {
    std::uint32_t lowest = reach[0], highest = reach[1];
    for (std::size_t i = 0; i < count; ++i) {
        lowest = std::min(lowest, points[i]);
        highest = std::max(highest, points[i]);
    }
    reach = {lowest, highest};
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {
namespace {

HWY_EXPORT(extend);

// All threads take part. If the triangles are in no spatial order, each band goes over most of them, so that
// there are no more bands than threads.
std::size_t band_width(const std::vector<Reach>& reaches, std::size_t points) {
    constexpr std::size_t kMostChunks = 64,
                          kMostReached = 4;  // bands by each section, on average
    const std::size_t chunks =
        (points / PointBands::kChunk + 1) / static_cast<std::size_t>(thread_count()) + 1;
    const std::size_t width = PointBands::kChunk * std::min(chunks, kMostChunks);
    std::size_t reached = 0;
    for (const auto& [lowest, highest] : reaches) reached += highest / width - lowest / width + 1;
    return reached <= kMostReached * reaches.size() ? width : PointBands::kChunk * chunks;
}

}  // namespace

void extend_reach(Reach& reach, std::span<const std::uint32_t> points) {
    HWY_DYNAMIC_DISPATCH(extend)(reach, points.data(), points.size());
}

PointBands::PointBands(const MeshView& mesh)
    : points_(mesh.points.size()),
      triangles_(mesh.triangles.size()),
      reaches_((triangles_ + kSection - 1) / kSection) {
    parallel_for(std::size_t{0}, reaches_.size(), [&](std::size_t s) {
        const std::size_t begin = s * kSection, end = std::min(begin + kSection, triangles_);
        reaches_[s] = {~std::uint32_t{0}, 0};
        extend_reach(reaches_[s], {mesh.triangles[begin].data(), 3 * (end - begin)});
    });
    width_ = band_width(reaches_, points_);
}

}  // namespace marrow::internal
#endif
