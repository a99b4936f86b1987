// Parts of volumes, for processes that work on one surface together. What they exchange are tuples of arrays.
#include <marrow/parts.h>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <tbb/task_arena.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <marrow/error.h>
#include <marrow/mesh_io.h>
#include <marrow/scan_io.h>

#include "long_work.h"
#include "mesh.h"
#include "mesh_files.h"
#include "module.h"
#include "parts.h"
#include "vectors.h"
#include "volume.h"

namespace py = pybind11;

namespace marrow::python {

namespace {

// A scan of which boxes are read, on one thread.
class BoxReader {
  public:
    BoxReader(const std::filesystem::path& path, const std::optional<Vec3d>& spacing)
        : source_(open_boxes(path, {.spacing = spacing})) {}

    const Geometry& geometry() const { return source_.geometry; }
    py::dtype dtype() const { return dtype_of(source_.type); }
    const Index& chunk() const { return source_.chunk; }

    // For each chunk [k, j, i] that a box overlaps, whether it is known, and a sample that then stands for
    // all of it.
    using KnownChunks = std::optional<std::pair<py::array, py::array>>;

    // Fills `out` [k, j, i] with the samples from `first` on.
    void read(const Index& first, py::array& out, const KnownChunks& known) const {
        if (!out.writeable() || !(out.flags() & py::array::c_style) || out.ndim() != 3 ||
            sample_type_of(out.dtype()) != source_.type)
            throw InputError("the samples of a box go to a C-contiguous array of their type with three axes");
        const Index dims{out.shape(2), out.shape(1), out.shape(0)};
        void* const samples = out.mutable_data();
        const BoxSource::KnownChunks known_chunks = to_known_chunks(known, first, dims);
        compute(py::none(), [&](const Progress&) {
            tbb::task_arena(1).execute([&] { source_.read(first, dims, samples, known_chunks); });
            return true;
        });
    }

  private:
    // Refers to the arrays.
    BoxSource::KnownChunks to_known_chunks(const KnownChunks& known, const Index& first,
                                           const Index& dims) const {
        if (!known) return {};
        const auto& [are_known, samples] = *known;
        Index begin, count;
        for (std::size_t a = 0; a < 3; ++a) {
            begin[a] = first[a] / chunk()[a];
            count[a] = (first[a] + dims[a] - 1) / chunk()[a] + 1 - begin[a];
        }
        const auto fits = [&](const py::array& array, SampleType type) {
            return (array.flags() & py::array::c_style) && sample_type_of(array.dtype()) == type &&
                   array.ndim() == 3 && Index{array.shape(2), array.shape(1), array.shape(0)} == count;
        };
        if (!fits(are_known, SampleType::uint8) || !fits(samples, source_.type))
            throw InputError(
                "known chunks are two arrays, of uint8 and of samples, with an element for each chunk");
        return [begin, count, flags = static_cast<const std::uint8_t*>(are_known.data()),
                values = static_cast<const char*>(samples.data()),
                size = sample_size(source_.type)](const Index& at) -> const void* {
            const auto i = static_cast<std::size_t>(
                ((at[2] - begin[2]) * count[1] + at[1] - begin[1]) * count[0] + at[0] - begin[0]);
            return flags[i] != 0 ? values + i * size : nullptr;
        };
    }

    const BoxSource source_;
};

py::tuple as_tuple(const PartExtent& extent) {
    return py::make_tuple(extent.whole, extent.first, extent.dims);
}

PartExtent to_extent(const py::handle& extent) {
    const auto [whole, first, dims] = extent.cast<std::tuple<Index, Index, Index>>();
    return {whole, first, dims};
}

py::tuple as_tuple(PartCounts&& counts) {
    return py::make_tuple(as_tuple(counts.extent), to_array(std::move(counts.points)),
                          to_array(std::move(counts.triangles)), counts.topology);
}

PartCounts to_counts(const py::handle& counts) {
    const auto [extent, points, triangles, topology] =
        counts.cast<std::tuple<py::object, py::object, py::object, bool>>();
    return {to_extent(extent), to_vector<std::vector<std::uint32_t>>(points),
            to_vector<std::vector<std::uint32_t>>(triangles), topology};
}

std::vector<PartCounts> to_counts(const py::list& list) {
    std::vector<PartCounts> counts;
    for (const py::handle item : list) counts.push_back(to_counts(item));
    return counts;
}

py::tuple as_tuple(PartNumbers&& numbers) {
    return py::make_tuple(as_tuple(numbers.extent), to_array(std::move(numbers.points)),
                          to_array(std::move(numbers.triangles)), numbers.topology, numbers.counts_hash);
}

PartNumbers to_numbers(const py::handle& numbers) {
    const auto [extent, points, triangles, topology, counts_hash] =
        numbers.cast<std::tuple<py::object, py::object, py::object, bool, std::uint64_t>>();
    return {to_extent(extent), to_vector<std::vector<std::uint32_t>>(points),
            to_vector<std::vector<std::uint64_t>>(triangles), topology, counts_hash};
}

PartSurface to_surface(const py::handle& part) {
    const auto [extent, points, triangles, normals, keys, topology] =
        part.cast<std::tuple<py::object, py::object, py::object, py::object, py::object, bool>>();
    PartSurface surface;
    surface.topology = topology;
    surface.extent = to_extent(extent);
    surface.mesh.points = to_vector<Buffer<Vec3f>>(points);
    if (!normals.is_none()) surface.mesh.normals = to_vector<Buffer<Vec3f>>(normals);
    surface.mesh.triangles = to_vector<Buffer<Triangle>>(triangles);
    surface.keys = to_vector<Buffer<std::uint64_t>>(keys);
    return surface;
}

IsosurfaceOptions options_of(bool closed, bool normals, bool topology, int threads,
                             const Progress& progress) {
    return {
        .normals = normals, .closed = closed, .topology = topology, .threads = threads, .progress = progress};
}

py::tuple python_extract_part(const ArrayPart& part, double isovalue, bool closed, bool normals,
                              bool topology, int threads, const py::object& progress) {
    PartSurface surface = compute(progress, [&](const Progress& report) {
        return extract_part(part.view(), part.whole(), isovalue,
                            options_of(closed, normals, topology, threads, report));
    });
    const py::tuple mesh = to_python(std::move(surface.mesh));
    return py::make_tuple(as_tuple(surface.extent), mesh[0], mesh[1], mesh[2],
                          to_array(std::move(surface.keys)), surface.topology);
}

py::tuple python_merge_parts(const py::list& list, const py::object& progress) {
    std::vector<PartSurface> parts;
    for (const py::handle part : list) parts.push_back(to_surface(part));
    return to_python(compute(progress, [&](const Progress& report) { return merge_parts(parts, report); }));
}

py::tuple python_count_part(const ArrayPart& part, double isovalue, bool closed, bool topology, int threads,
                            const py::object& progress) {
    return as_tuple(compute(progress, [&](const Progress& report) {
        return count_part(part.view(), part.whole(), isovalue,
                          options_of(closed, false, topology, threads, report));
    }));
}

py::array_t<std::uint8_t> python_chunks_without_surface(const ArrayPart& part, const Index& chunk,
                                                        double isovalue, bool closed, int threads) {
    const auto flags = compute(py::none(), [&](const Progress& report) {
        return chunks_without_surface(part.view(), part.whole(), chunk, isovalue,
                                      {.closed = closed, .threads = threads, .progress = report});
    });
    return py::array_t<std::uint8_t>(static_cast<py::ssize_t>(flags.size()), flags.data());
}

py::list python_number_parts(const py::list& parts, const py::list& next, std::uint64_t points_before,
                             std::uint64_t triangles_before) {
    py::list result;
    for (PartNumbers& numbers :
         number_parts(to_counts(parts), to_counts(next), {points_before, triangles_before}))
        result.append(as_tuple(std::move(numbers)));
    return result;
}

// What another process needs to know of a file that is written by several.
py::tuple as_tuple(const SharedSurfaceFile& file) {
    return py::make_tuple(file.temporary, file.format == MeshFormat::stl, static_cast<int>(file.space),
                          file.normals, file.size.points, file.size.triangles);
}

SharedSurfaceFile to_file(const py::tuple& file) {
    return {file[0].cast<std::filesystem::path>(),
            file[1].cast<bool>() ? MeshFormat::stl : MeshFormat::ply,
            static_cast<Space>(file[2].cast<int>()),
            file[3].cast<bool>(),
            {file[4].cast<std::uint64_t>(), file[5].cast<std::uint64_t>()}};
}

// A file that appears with commit(). Python may keep it alive after an error, with the traceback, so
// discard() removes the temporary file.
class FileOfParts {
  public:
    FileOfParts(const std::filesystem::path& path, std::uint64_t points, std::uint64_t triangles,
                bool normals, const std::string& space) {
        MeshWriteOptions options;
        options.space = space_named(space);
        writer_ =
            std::make_unique<SharedSurfaceWriter>(path, SurfaceSize{points, triangles}, normals, options);
    }

    py::tuple description() const { return as_tuple(writer().file()); }
    void commit() {
        SharedSurfaceWriter& complete = writer();
        const py::gil_scoped_release unlocked;
        complete.commit();
    }
    void discard() { writer_.reset(); }

  private:
    SharedSurfaceWriter& writer() const {
        if (!writer_) throw InputError("the file was discarded");
        return *writer_;
    }

    std::unique_ptr<SharedSurfaceWriter> writer_;
};

void extract_to_shared_file(const ArrayPart& part, const py::tuple& numbers, double isovalue,
                            const py::tuple& file, bool closed, bool topology, int threads,
                            const py::object& progress) {
    const SharedSurfaceFile target = to_file(file);
    const PartNumbers part_numbers = to_numbers(numbers);
    run_long_work(progress, [&](const Progress& report) {
        write_part(target,
                   extract_numbered_part(part.view(), part_numbers, isovalue,
                                         options_of(closed, target.normals, topology, threads, report)));
    });
}

}  // namespace

void add_parts(py::module_& module) {
    py::class_<ArrayPart>(module, "ArrayPart")
        .def(py::init<py::array, const Index&, const Index&, const Index&, const Index&, const Vec3d&,
                      const Vec3d&, const Mat3d&>(),
             py::arg("array").noconvert(), py::arg("array_first"), py::arg("first"), py::arg("dims"),
             py::arg("whole"), py::arg("spacing"), py::arg("origin"), py::arg("direction"))
        .def_property_readonly("array", &ArrayPart::array);
    py::class_<BoxReader>(module, "BoxReader")
        .def(py::init<const std::filesystem::path&, const std::optional<Vec3d>&>(), py::arg("path"),
             py::kw_only(), py::arg("spacing"))
        .def_property_readonly("shape",
                               [](const BoxReader& reader) {
                                   const Index& dims = reader.geometry().dims;
                                   return py::make_tuple(dims[2], dims[1], dims[0]);
                               })
        .def_property_readonly("dtype", &BoxReader::dtype)
        .def_property_readonly("chunks",
                               [](const BoxReader& reader) {
                                   const Index& chunk = reader.chunk();
                                   return py::make_tuple(chunk[2], chunk[1], chunk[0]);
                               })
        .def_property_readonly("spacing", [](const BoxReader& reader) { return reader.geometry().spacing; })
        .def_property_readonly("origin", [](const BoxReader& reader) { return reader.geometry().origin; })
        .def_property_readonly("direction",
                               [](const BoxReader& reader) { return reader.geometry().direction; })
        .def("read", &BoxReader::read, py::arg("first"), py::arg("out").noconvert(),
             py::arg("known") = py::none());
    module.def("extract_part", &python_extract_part, py::arg("part"), py::arg("isovalue"), py::kw_only(),
               py::arg("closed"), py::arg("normals"), py::arg("topology"), py::arg("threads"),
               py::arg("progress") = py::none());
    module.def("merge_parts", &python_merge_parts, py::arg("parts"), py::arg("progress") = py::none());
    module.def("count_part", &python_count_part, py::arg("part"), py::arg("isovalue"), py::kw_only(),
               py::arg("closed"), py::arg("topology"), py::arg("threads"), py::arg("progress") = py::none());
    module.def("chunks_without_surface", &python_chunks_without_surface, py::arg("part"), py::arg("chunk"),
               py::arg("isovalue"), py::kw_only(), py::arg("closed"), py::arg("threads"));
    module.def(
        "first_slice", [](const py::tuple& counts) { return as_tuple(first_slice(to_counts(counts))); },
        py::arg("counts"));
    module.def("number_parts", &python_number_parts, py::arg("parts"), py::arg("next"),
               py::arg("points_before"), py::arg("triangles_before"));
    module.def("extract_to_shared_file", &extract_to_shared_file, py::arg("part"), py::arg("numbers"),
               py::arg("isovalue"), py::arg("file"), py::kw_only(), py::arg("closed"), py::arg("topology"),
               py::arg("threads"), py::arg("progress") = py::none());
    py::class_<FileOfParts>(module, "FileOfParts")
        .def(py::init<const std::filesystem::path&, std::uint64_t, std::uint64_t, bool, const std::string&>(),
             py::arg("path"), py::arg("points"), py::arg("triangles"), py::kw_only(), py::arg("normals"),
             py::arg("space"))
        .def_property_readonly("description", &FileOfParts::description)
        .def("commit", &FileOfParts::commit)
        .def("discard", &FileOfParts::discard);
}

}  // namespace marrow::python
