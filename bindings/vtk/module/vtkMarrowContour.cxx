// Connects Marrow's extraction to VTK's pipeline.
#include "vtkMarrowContour.h"

#include <vtkAbstractArray.h>
#include <vtkCellArray.h>
#include <vtkContourValues.h>
#include <vtkDataArray.h>
#include <vtkExtentTranslator.h>
#include <vtkFloatArray.h>
#include <vtkIdTypeArray.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkMatrix3x3.h>
#include <vtkObjectFactory.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkStreamingDemandDrivenPipeline.h>
#include <vtkTypeInt32Array.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <future>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <marrow/error.h>
#include <marrow/isosurface.h>
#include <marrow/parts.h>

vtkStandardNewMacro(vtkMarrowContour);

namespace {

using Extent = std::array<int, 6>;
constexpr Extent kNoSamples = {0, -1, 0, -1, 0, -1};

// The surfaces that own the memory of VTK's arrays, by the addresses of that memory. A copy of an array shares
// its memory but nothing else, so that only what frees the memory can let go of the surface.
class SharedSurfaces {
  public:
    static void keep(void* memory, std::shared_ptr<marrow::PartSurface> surface) {
        SharedSurfaces& all = instance();
        const std::lock_guard lock(all.mutex_);
        all.owners_[memory] = std::move(surface);
    }
    static void release(void* memory) {
        SharedSurfaces& all = instance();
        std::shared_ptr<marrow::PartSurface> last;  // is destroyed after the lock
        const std::lock_guard lock(all.mutex_);
        const auto at = all.owners_.find(memory);
        last = std::move(at->second);
        all.owners_.erase(at);
    }

  private:
    static SharedSurfaces& instance() {
        static auto* const all =
            new SharedSurfaces;  // never destroyed: arrays may live until the process ends
        return *all;
    }

    std::mutex mutex_;
    std::map<void*, std::shared_ptr<marrow::PartSurface>> owners_;
};

// An array of VTK's over memory that a surface owns.
template <class Array>
vtkSmartPointer<Array> array_over(std::shared_ptr<marrow::PartSurface> surface, void* data,
                                  std::size_t values, int components) {
    auto array = vtkSmartPointer<Array>::New();
    array->SetNumberOfComponents(components);
    if (values == 0) return array;
    SharedSurfaces::keep(data, std::move(surface));
    array->SetArray(static_cast<typename Array::ValueType*>(data), static_cast<vtkIdType>(values), 0,
                    vtkAbstractArray::VTK_DATA_ARRAY_USER_DEFINED);
    array->SetArrayFreeFunction(SharedSurfaces::release);
    return array;
}

std::optional<marrow::SampleType> sample_type(int type) {
    switch (type) {
        case VTK_UNSIGNED_CHAR:
            return marrow::SampleType::uint8;
        case VTK_SIGNED_CHAR:
            return marrow::SampleType::int8;
        case VTK_CHAR:
            return marrow::sample_type_of<
                std::conditional_t<std::is_signed_v<char>, std::int8_t, std::uint8_t>>();
        case VTK_SHORT:
            return marrow::SampleType::int16;
        case VTK_UNSIGNED_SHORT:
            return marrow::SampleType::uint16;
        case VTK_INT:
            return marrow::SampleType::int32;
        case VTK_FLOAT:
            return marrow::SampleType::float32;
        case VTK_DOUBLE:
            return marrow::SampleType::float64;
        default:
            return {};
    }
}

// The samples of an image, one at each point. \throw std::runtime_error Marrow cannot read them where they are
const void* samples_of(vtkDataArray& scalars, vtkIdType points, marrow::SampleType& type) {
    const std::string name = scalars.GetName() ? scalars.GetName() : "the scalars";
    if (scalars.GetNumberOfTuples() != points)
        throw std::runtime_error(name + " have " + std::to_string(scalars.GetNumberOfTuples()) +
                                 " values for " + std::to_string(points) +
                                 " points; convert values of cells with vtkCellDataToPointData");
    if (scalars.GetNumberOfComponents() != 1)
        throw std::runtime_error(name + " have " + std::to_string(scalars.GetNumberOfComponents()) +
                                 " components; choose one with vtkImageExtractComponents");
    const std::optional<marrow::SampleType> known = sample_type(scalars.GetDataType());
    if (!known)
        throw std::runtime_error(name + " are of type " + scalars.GetDataTypeAsString() +
                                 "; convert them with vtkImageCast");
    if (!scalars.HasStandardMemoryLayout())
        throw std::runtime_error(name +
                                 " are not one block of memory; copy them with vtkDataArray::DeepCopy");
    type = *known;
    return scalars.GetVoidPointer(0);
}

bool is_empty(const Extent& extent) {
    return extent[0] > extent[1] || extent[2] > extent[3] || extent[4] > extent[5];
}

std::array<std::int64_t, 3> dims_of(const Extent& extent) {
    std::array<std::int64_t, 3> dims;
    for (std::size_t m = 0; m < 3; ++m) dims[m] = std::int64_t{extent[2 * m + 1]} - extent[2 * m] + 1;
    return dims;
}

// The samples at the cells that this piece owns, of an image whose ghost cells no array marks: some filters,
// such as vtkImageChangeInformation, drop it. If the image is a piece as VTK splits the whole, with the ghost
// levels that its information states, then it owns that piece without them.
Extent owned_by_split(vtkImageData& image, const Extent& present, Extent whole) {
    vtkInformation& info = *image.GetInformation();
    const int ghost_levels = info.Get(vtkDataObject::DATA_NUMBER_OF_GHOST_LEVELS());
    if (ghost_levels == 0) return present;
    const vtkNew<vtkExtentTranslator> translator;
    const auto split = [&](int levels) {
        Extent extent{};
        translator->PieceToExtentThreadSafe(info.Get(vtkDataObject::DATA_PIECE_NUMBER()),
                                            info.Get(vtkDataObject::DATA_NUMBER_OF_PIECES()), levels,
                                            whole.data(), extent.data(), vtkExtentTranslator::BLOCK_MODE, 0);
        return extent;
    };
    return split(ghost_levels) == present ? split(0) : present;
}

// The samples at the cells that this piece owns. Other pieces own ghost cells, which lie around these.
// \throw std::runtime_error the ghost array is not one of this image's cells
Extent owned_by_piece(vtkImageData& image, const Extent& present, const Extent& whole) {
    vtkUnsignedCharArray* const ghosts = image.GetCellGhostArray();
    if (!ghosts) return owned_by_split(image, present, whole);
    if (ghosts->GetNumberOfValues() != image.GetNumberOfCells())
        throw std::runtime_error(std::string(vtkDataSetAttributes::GhostArrayName()) + " has " +
                                 std::to_string(ghosts->GetNumberOfValues()) + " values for " +
                                 std::to_string(image.GetNumberOfCells()) +
                                 " cells; give it one for each, or if a threaded image filter of VTK left it "
                                 "so, update that filter as a whole instead of in pieces");
    const auto is_owned = [&](std::int64_t cell) {
        return (ghosts->GetValue(cell) & vtkDataSetAttributes::DUPLICATECELL) == 0;
    };
    std::int64_t first = 0;
    while (first < ghosts->GetNumberOfValues() && !is_owned(first)) ++first;
    if (first == ghosts->GetNumberOfValues()) return kNoSamples;
    Extent owned{};
    const std::array<std::int64_t, 3> samples = dims_of(present);
    std::int64_t step = 1, left = first;
    for (std::size_t m = 0; m < 3; ++m) {
        const std::int64_t cells = std::max<std::int64_t>(samples[m] - 1, 1), begin = left % cells;
        std::int64_t end = begin + 1;
        while (end < cells && is_owned(first + (end - begin) * step)) ++end;
        owned[2 * m] = present[2 * m] + static_cast<int>(begin);
        owned[2 * m + 1] = present[2 * m] + static_cast<int>(std::min(end, samples[m] - 1));
        left /= cells;
        step *= cells;
    }
    return owned;
}

// \throw std::runtime_error normals need samples beyond the border of the piece that the image does not have
void check_neighbours(const Extent& whole, const Extent& present, const Extent& piece) {
    for (std::size_t m = 0; m < 3; ++m) {
        const std::size_t first = 2 * m, last = first + 1;
        if ((piece[first] > whole[first] && piece[first] == present[first]) ||
            (piece[last] < whole[last] && piece[last] == present[last]))
            throw std::runtime_error(
                "normals at the border of a piece need a ghost level, and there is none along axis " +
                std::to_string(m) + "; give it one, or turn ComputeNormals off");
    }
}

// The piece of an image as a part of the whole volume. Indices count from the whole's first sample.
marrow::VolumeView view_of(vtkImageData& image, const void* samples, marrow::SampleType type,
                           const Extent& whole, const Extent& present, const Extent& piece) {
    marrow::VolumeView view;
    view.type = type;
    const double* const spacing = image.GetSpacing();
    const vtkMatrix3x3* const direction = image.GetDirectionMatrix();
    marrow::Geometry& g = view.geometry;
    g.dims = dims_of(piece);
    const std::array<std::int64_t, 3> size = dims_of(present);
    std::int64_t offset = 0, pitch = 1;
    for (std::size_t m = 0; m < 3; ++m) {
        // In Marrow, an axis with a negative spacing has a positive one and runs the other way.
        const double sign = spacing[m] < 0 ? -1 : 1;
        g.spacing[m] = sign * spacing[m];
        for (std::size_t row = 0; row < 3; ++row)
            g.direction[row][m] = sign * direction->GetElement(static_cast<int>(row), static_cast<int>(m));
        view.first[m] = std::int64_t{piece[2 * m]} - whole[2 * m];
        view.below[m] = std::int64_t{piece[2 * m]} - present[2 * m];
        view.above[m] = std::int64_t{present[2 * m + 1]} - piece[2 * m + 1];
        offset += view.below[m] * pitch;
        pitch *= size[m];
    }
    double origin[3];
    image.TransformIndexToPhysicalPoint(whole[0], whole[2], whole[4], origin);
    std::copy_n(origin, 3, g.origin.begin());
    view.pitch = {size[0], size[0] * size[1]};
    view.data =
        static_cast<const std::byte*>(samples) + static_cast<std::size_t>(offset) * marrow::sample_size(type);
    return view;
}

// Writes the isovalue of each point, or the nearest value that the type has, of at most 32 bits if it is an
// integer; number i has the points until points_until[i].
template <class T>
void fill(const std::vector<double>& isovalues, const std::vector<std::size_t>& points_until, T* to) {
    constexpr auto kLowest = static_cast<double>(std::numeric_limits<T>::lowest());
    constexpr auto kHighest = static_cast<double>(std::numeric_limits<T>::max());
    std::size_t point = 0;
    for (std::size_t i = 0; i < isovalues.size(); ++i) {
        std::fill(to + point, to + points_until[i],
                  static_cast<T>(std::clamp(isovalues[i], kLowest, kHighest)));
        point = points_until[i];
    }
}

// Adds a surface to another, and `first_id` to its keys.
void append(const marrow::PartSurface& surface, std::uint64_t first_id, marrow::PartSurface& all) {
    for (const std::uint64_t key : surface.keys) all.keys.push_back(first_id + key);
    const marrow::Mesh& from = surface.mesh;
    marrow::Mesh& to = all.mesh;
    const std::size_t first = to.points.size();
    if (first + from.points.size() > std::numeric_limits<std::uint32_t>::max())
        throw marrow::LimitError(
            "the surfaces together have 2^32 points or more; extract fewer values at once");
    to.points.insert(to.points.end(), from.points.begin(), from.points.end());
    to.normals.insert(to.normals.end(), from.normals.begin(), from.normals.end());
    to.triangles.reserve(to.triangles.size() + from.triangles.size());
    for (marrow::Triangle triangle : from.triangles) {
        for (std::uint32_t& point : triangle) point += static_cast<std::uint32_t>(first);
        to.triangles.push_back(triangle);
    }
}

// The first id of the next isovalue's points, whose keys are those of the same edges and cells.
// \throw marrow::LimitError
std::uint64_t next_first_id(std::uint64_t first_id, const marrow::PartSurface& surface) {
    std::uint64_t next = 0;
    if (__builtin_add_overflow(first_id, surface.key_count(), &next) || next > std::uint64_t{VTK_ID_MAX})
        throw marrow::LimitError(
            "the global ids do not fit in vtkIdType; extract fewer isovalues at once, or no global ids");
    return next;
}

}  // namespace

vtkMarrowContour::vtkMarrowContour() {
    this->SetInputArrayToProcess(0, 0, 0, vtkDataObject::FIELD_ASSOCIATION_POINTS,
                                 vtkDataSetAttributes::SCALARS);
}

vtkMarrowContour::~vtkMarrowContour() = default;

vtkMTimeType vtkMarrowContour::GetMTime() {
    return std::max(this->Superclass::GetMTime(), this->ContourValues->GetMTime());
}

void vtkMarrowContour::SetValue(int i, double value) {
    this->ContourValues->SetValue(i, value);
}
double vtkMarrowContour::GetValue(int i) {
    return this->ContourValues->GetValue(i);
}
double* vtkMarrowContour::GetValues() {
    return this->ContourValues->GetValues();
}
void vtkMarrowContour::GetValues(double* values) {
    this->ContourValues->GetValues(values);
}
void vtkMarrowContour::SetNumberOfContours(int count) {
    this->ContourValues->SetNumberOfContours(count);
}
vtkIdType vtkMarrowContour::GetNumberOfContours() {
    return this->ContourValues->GetNumberOfContours();
}
void vtkMarrowContour::GenerateValues(int count, double range[2]) {
    this->ContourValues->GenerateValues(count, range);
}
void vtkMarrowContour::GenerateValues(int count, double low, double high) {
    this->ContourValues->GenerateValues(count, low, high);
}

int vtkMarrowContour::FillInputPortInformation(int, vtkInformation* info) {
    info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkImageData");
    return 1;
}

int vtkMarrowContour::RequestUpdateExtent(vtkInformation* request, vtkInformationVector** inputs,
                                          vtkInformationVector* outputs) {
    if (this->Superclass::RequestUpdateExtent(request, inputs, outputs) == 0) return 0;
    using Pipeline = vtkStreamingDemandDrivenPipeline;
    vtkInformation& input = *inputs[0]->GetInformationObject(0);
    const bool pieces = input.Get(Pipeline::UPDATE_NUMBER_OF_PIECES()) > 1;
    input.Set(Pipeline::UPDATE_NUMBER_OF_GHOST_LEVELS(), pieces && this->ComputeNormals ? 1 : 0);
    return 1;
}

int vtkMarrowContour::RequestData(vtkInformation*, vtkInformationVector** inputs,
                                  vtkInformationVector* outputs) {
    vtkImageData* const image = vtkImageData::GetData(inputs[0]);
    vtkPolyData* const output = vtkPolyData::GetData(outputs);
    vtkDataArray* const scalars = this->GetInputArrayToProcess(0, inputs);
    vtkInformation& request = *inputs[0]->GetInformationObject(0);
    Extent present{}, whole{};
    image->GetExtent(present.data());
    if (request.Has(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT()))
        request.Get(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), whole.data());
    else
        whole = present;
    // Ranks without data are normal.
    if (!scalars || is_empty(present) || this->GetNumberOfContours() == 0) return 1;

    try {
        const Extent piece = owned_by_piece(*image, present, whole);
        if (is_empty(piece)) return 1;
        if (this->ComputeNormals) check_neighbours(whole, present, piece);
        marrow::SampleType type{};
        const void* const samples = samples_of(*scalars, image->GetNumberOfPoints(), type);
        const marrow::VolumeView view = view_of(*image, samples, type, whole, present, piece);
        const bool keys = this->ComputeGlobalIds != 0;
        const bool in_parts = keys || piece != whole;

        // The work has a thread of its own: observers of progress belong to this one.
        std::atomic<double> done = 0;
        std::atomic<bool> stop = false;
        const int values = static_cast<int>(this->GetNumberOfContours());
        const std::vector<double> isovalues(this->GetValues(), this->GetValues() + values);
        std::vector<std::size_t> points_until;
        auto work = std::async(std::launch::async, [&] {
            auto all = std::make_shared<marrow::PartSurface>();
            double before = 0;
            const marrow::IsosurfaceOptions options{.normals = this->ComputeNormals != 0,
                                                    .closed = this->Closed != 0,
                                                    .topology = this->ExactTopology != 0,
                                                    .threads = this->NumberOfThreads,
                                                    .progress = [&](double fraction) {
                                                        done = (before + fraction) / values;
                                                        return !stop;
                                                    }};
            if (values == 1 && !in_parts) {
                all->mesh = marrow::extract_isosurface(view, isovalues[0], options);
                points_until.push_back(all->mesh.points.size());
                return all;
            }
            std::optional<marrow::IsosurfaceExtractor> extractor;
            if (!in_parts) extractor.emplace(view, options);
            marrow::PartSurface one;
            std::uint64_t first_id = 0;
            for (const double isovalue : isovalues) {
                if (extractor)
                    extractor->extract(isovalue, one.mesh);
                else
                    one = marrow::extract_part(view, dims_of(whole), isovalue, options);
                if (!keys) one.keys.clear();
                const std::uint64_t next_id = keys ? next_first_id(first_id, one) : 0;
                if (values == 1)
                    *all = std::move(one);
                else
                    append(one, first_id, *all);
                first_id = next_id;
                points_until.push_back(all->mesh.points.size());
                ++before;
            }
            return all;
        });
        constexpr std::chrono::milliseconds kInterval(20);
        while (work.wait_for(kInterval) != std::future_status::ready) {
            this->UpdateProgress(done);
            if (this->GetAbortExecute()) stop = true;
        }
        const std::shared_ptr<marrow::PartSurface> surface = work.get();
        marrow::Mesh* const mesh = &surface->mesh;
        // VTK counts the corners of all triangles in 32 bits, as their indices have so many.
        constexpr std::size_t kMost = std::numeric_limits<std::int32_t>::max();
        if (mesh->points.size() > kMost || mesh->triangles.size() > kMost / 3)
            throw marrow::LimitError("the surface has more than " + std::to_string(kMost / 3) +
                                     " triangles or 2^31 points; extract it in pieces");

        const vtkNew<vtkPoints> points;
        points->SetData(array_over<vtkFloatArray>(surface, mesh->points.data(), 3 * mesh->points.size(), 3));
        output->SetPoints(points);
        const vtkNew<vtkCellArray> cells;
        cells->SetData(
            3, array_over<vtkTypeInt32Array>(surface, mesh->triangles.data(), 3 * mesh->triangles.size(), 1));
        output->SetPolys(cells);
        if (this->ComputeNormals) {
            const auto normals =
                array_over<vtkFloatArray>(surface, mesh->normals.data(), 3 * mesh->normals.size(), 3);
            normals->SetName("Normals");
            output->GetPointData()->SetNormals(normals);
        }
        if (keys) {
            const auto ids =
                array_over<vtkIdTypeArray>(surface, surface->keys.data(), surface->keys.size(), 1);
            ids->SetName("GlobalPointIds");
            output->GetPointData()->SetGlobalIds(ids);
        }
        if (this->ComputeScalars) {
            const auto levels = vtkSmartPointer<vtkDataArray>::Take(scalars->NewInstance());
            levels->SetName(scalars->GetName());
            levels->SetNumberOfTuples(static_cast<vtkIdType>(mesh->points.size()));
            switch (levels->GetDataType()) {
                vtkTemplateMacro(
                    fill(isovalues, points_until, static_cast<VTK_TT*>(levels->GetVoidPointer(0))));
            }
            output->GetPointData()->SetScalars(levels);
        }
    } catch (const marrow::Cancelled&) {
        output->Initialize();
    } catch (const std::exception& error) {
        vtkErrorMacro(<< error.what());
        return 0;
    }
    return 1;
}

void vtkMarrowContour::PrintSelf(ostream& os, vtkIndent indent) {
    this->Superclass::PrintSelf(os, indent);
    this->ContourValues->PrintSelf(os, indent.GetNextIndent());
    os << indent << "ComputeNormals: " << this->ComputeNormals << '\n'
       << indent << "ComputeScalars: " << this->ComputeScalars << '\n'
       << indent << "ComputeGlobalIds: " << this->ComputeGlobalIds << '\n'
       << indent << "Closed: " << this->Closed << '\n'
       << indent << "ExactTopology: " << this->ExactTopology << '\n'
       << indent << "NumberOfThreads: " << this->NumberOfThreads << '\n';
}
