// Names and sizes of sample types, geometry, and owned volumes.
#include <marrow/volume.h>

#include <cmath>
#include <limits>
#include <new>
#include <string>

#include <marrow/error.h>

#include "base/checked_size.h"
#include "checks.h"

namespace marrow {

std::size_t sample_size(SampleType type) {
    switch (type) {
        case SampleType::uint8:
        case SampleType::int8:
            return 1;
        case SampleType::uint16:
        case SampleType::int16:
            return 2;
        case SampleType::int32:
        case SampleType::float32:
            return 4;
        case SampleType::float64:
            return 8;
    }
    throw InputError("unknown sample type");
}

const char* sample_type_name(SampleType type) {
    switch (type) {
        case SampleType::uint8:
            return "uint8";
        case SampleType::int8:
            return "int8";
        case SampleType::uint16:
            return "uint16";
        case SampleType::int16:
            return "int16";
        case SampleType::int32:
            return "int32";
        case SampleType::float32:
            return "float32";
        case SampleType::float64:
            return "float64";
    }
    throw InputError("unknown sample type");
}

Mat3d Geometry::index_to_physical() const {
    Mat3d m = direction;
    for (Vec3d& row : m) {
        for (int axis = 0; axis < 3; ++axis) row[axis] *= spacing[axis];
    }
    return m;
}

Vec3d Geometry::physical(const Vec3d& index) const {
    const Mat3d m = index_to_physical();
    Vec3d p = origin;
    for (int row = 0; row < 3; ++row) {
        for (int axis = 0; axis < 3; ++axis) p[row] += m[row][axis] * index[axis];
    }
    return p;
}

void check_geometry(const Geometry& g) {
    std::int64_t samples = 1;
    for (int axis = 0; axis < 3; ++axis) {
        if (g.dims[axis] < 0) throw InputError("volume: negative size along axis " + std::to_string(axis));
        if (__builtin_mul_overflow(samples, g.dims[axis], &samples) || g.dims[axis] >= std::int64_t{1}
                                                                                           << 30) {
            throw InputError("volume: size along axis " + std::to_string(axis) + " is out of range");
        }
        if (!(g.spacing[axis] >= std::numeric_limits<float>::min()) || !std::isfinite(g.spacing[axis])) {
            throw InputError("volume: spacing along axis " + std::to_string(axis) +
                             " is not a positive number");
        }
        if (!std::isfinite(g.origin[axis])) throw InputError("volume: the origin is not finite");
    }
    const double volume_of_axes = determinant(g.direction);
    if (!(std::abs(volume_of_axes) > 1e-6) || !std::isfinite(volume_of_axes))
        throw InputError("volume: the direction matrix is singular");
    for (int corner = 0; corner < 8; ++corner) {
        Vec3d index;
        for (int axis = 0; axis < 3; ++axis)
            index[axis] = corner >> axis & 1 ? static_cast<double>(g.dims[axis]) : 0;
        for (const double coordinate : g.physical(index)) {
            if (!(std::abs(coordinate) <= std::numeric_limits<float>::max()))
                throw InputError("volume: its coordinates exceed the range of float32");
        }
    }
}

VolumeView::VolumeView(const Volume& volume)
    : geometry(volume.geometry()), type(volume.type()), data(volume.data()), rescale(volume.rescale()) {}

Geometry VolumeView::own_geometry() const {
    Geometry own = geometry;
    own.origin = geometry.physical(
        {static_cast<double>(first[0]), static_cast<double>(first[1]), static_cast<double>(first[2])});
    return own;
}

VolumeView part_of(const VolumeView& volume, const std::array<std::int64_t, 3>& begin,
                   const std::array<std::int64_t, 3>& dims) {
    internal::check_volume(volume);
    VolumeView part = volume;
    part.pitch = {volume.row_pitch(), volume.slice_pitch()};
    part.geometry.dims = dims;
    for (std::size_t a = 0; a < 3; ++a) {
        const std::int64_t available = volume.geometry.dims[a];
        if (begin[a] < 0 || dims[a] < 0 || begin[a] > available || dims[a] > available - begin[a])
            throw InputError("part of a volume: " + std::to_string(dims[a]) + " samples from sample " +
                             std::to_string(begin[a]) + " along axis " + std::to_string(a) +
                             " leave the volume, which has " + std::to_string(available));
        part.first[a] += begin[a];
        part.below[a] += begin[a];
        part.above[a] += available - begin[a] - dims[a];
    }
    const std::int64_t offset = begin[2] * part.pitch[1] + begin[1] * part.pitch[0] + begin[0];
    if (part.geometry.sample_count() > 0)
        part.data = static_cast<const std::byte*>(volume.data) +
                    static_cast<std::size_t>(offset) * sample_size(volume.type);
    return part;
}

Volume::Volume(const Geometry& geometry, SampleType type) : geometry_(geometry), type_(type) {
    check_geometry(geometry);
    std::int64_t bytes = 0;
    if (__builtin_mul_overflow(geometry.sample_count(), static_cast<std::int64_t>(sample_size(type)),
                               &bytes)) {
        throw LimitError("volume: more samples than memory can hold");
    }
    try {
        samples_.resize(internal::checked_size(static_cast<std::uint64_t>(bytes)));
    } catch (const std::exception&) {
        throw LimitError("volume: " + std::to_string(bytes >> 20) + " MiB of memory are not available");
    }
}

void Volume::set_geometry(const Geometry& geometry) {
    check_geometry(geometry);
    if (geometry.dims != geometry_.dims) throw InputError("volume: set_geometry cannot change the dims");
    geometry_ = geometry;
}

void Volume::set_rescale(const Rescale& rescale) {
    internal::check_rescale(rescale);
    rescale_ = rescale;
}

}  // namespace marrow
