// write_mesh, write_meshes, MeshFiles and SurfaceWriter.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <ostream>
#include <stdexcept>
#include <type_traits>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <vtkCellArray.h>
#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkNew.h>
#include <vtkOBJReader.h>
#include <vtkPLYReader.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkSTLReader.h>
#include <vtkSmartPointer.h>
#include <vtkStringArray.h>
#include <vtkXMLPolyDataReader.h>

#include <marrow/isosurface.h>
#include <marrow/mesh_io.h>
#include <marrow/normals.h>
#include <marrow/streaming.h>

#include "io/mesh/writer.h"
#include "support/fields.h"
#include "support/temporary_folder.h"

namespace marrow::test {
namespace {

using Names = std::set<std::string>;

// Rotated and shifted, so that coordinates have many digits and both signs.
Mesh ball() {
    Geometry g = grid(17, 18, 19);
    const double c = std::cos(0.3), s = std::sin(0.3);
    g.direction = {{{c, -s, 0}, {s, c, 0}, {0, 0, 1}}};
    g.spacing = {0.7, 0.9, 1.1};
    g.origin = {-3.3, -5.7, 1e-5};
    const Vec3d centre = g.physical({8, 8.5, 9});
    const Volume volume = sampled_in_space<float>(g, sphere(centre, 5));
    return extract_isosurface(volume, 0);
}

template <class Reader>
vtkSmartPointer<vtkPolyData> read(Reader* reader, const std::filesystem::path& file) {
    reader->SetFileName(file.c_str());
    reader->Update();
    return reader->GetOutput();
}

vtkSmartPointer<vtkPolyData> read_back(const std::filesystem::path& file) {
    switch (mesh_format(file)) {
        case MeshFormat::stl: {
            vtkNew<vtkSTLReader> reader;
            reader->MergingOff();
            return read(reader.Get(), file);
        }
        case MeshFormat::ply:
            return read(vtkNew<vtkPLYReader>().Get(), file);
        case MeshFormat::obj:
            return read(vtkNew<vtkOBJReader>().Get(), file);
        case MeshFormat::vtp:
            return read(vtkNew<vtkXMLPolyDataReader>().Get(), file);
        case MeshFormat::threemf:
        case MeshFormat::glb:
        case MeshFormat::dicom:
            break;  // see mesh_formats_test.cpp
    }
    return nullptr;
}

std::vector<Vec3f> vectors(vtkDataArray* array) {
    if (!array) return {};
    EXPECT_EQ(array->GetDataType(), VTK_FLOAT);
    std::vector<Vec3f> result(static_cast<std::size_t>(array->GetNumberOfTuples()));
    std::memcpy(result.data(), array->GetVoidPointer(0), result.size() * sizeof(Vec3f));
    return result;
}

std::vector<Triangle> triangles(vtkPolyData* data) {
    std::vector<Triangle> result;
    for (vtkIdType i = 0; i < data->GetNumberOfPolys(); ++i) {
        vtkIdType n = 0;
        const vtkIdType* corners = nullptr;
        data->GetPolys()->GetCellAtId(i, n, corners);
        EXPECT_EQ(n, 3);
        result.push_back({static_cast<std::uint32_t>(corners[0]), static_cast<std::uint32_t>(corners[1]),
                          static_cast<std::uint32_t>(corners[2])});
    }
    return result;
}

// Compares bits: 0 and -0 differ.
template <class T, class Container>
bool same_bits(const std::vector<T>& a, const Container& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

std::vector<Vec3f> in_space(const Buffer<Vec3f>& lps, Space space) {
    std::vector<Vec3f> result(lps.begin(), lps.end());
    for (Vec3f& v : result) {
        if (space == Space::RAS) v = {-v[0], -v[1], v[2]};
    }
    return result;
}

struct Case {
    const char* ending;
    Space space;
    friend void PrintTo(const Case& c, std::ostream* out) {
        *out << c.ending << (c.space == Space::RAS ? " RAS" : " LPS");
    }
};

class EveryFormat : public testing::TestWithParam<Case> {};

INSTANTIATE_TEST_SUITE_P(, EveryFormat,
                         testing::Values(Case{"stl", Space::LPS}, Case{"stl", Space::RAS},
                                         Case{"ply", Space::LPS}, Case{"ply", Space::RAS},
                                         Case{"obj", Space::LPS}, Case{"obj", Space::RAS},
                                         Case{"vtp", Space::LPS}, Case{"vtp", Space::RAS}),
                         [](const auto& info) {
                             return std::string(info.param.ending) +
                                    (info.param.space == Space::RAS ? "RAS" : "LPS");
                         });

TEST_P(EveryFormat, ReadsBackWithTheSameBits) {
    const auto [ending, space] = GetParam();
    const TemporaryFolder folder;
    const auto file = folder / (std::string("ball.") + ending);
    const Mesh mesh = ball();
    ASSERT_GT(mesh.triangles.size(), 100u);
    write_mesh(mesh, file, {.space = space});

    const auto data = read_back(file);
    const std::vector<Vec3f> expected = in_space(mesh.points, space);
    const std::vector<Vec3f> points = vectors(data->GetPoints()->GetData());
    if (mesh_format(file) == MeshFormat::stl) {  // each triangle has three points of its own
        std::vector<Vec3f> corners;
        for (const Triangle& t : mesh.triangles) {
            for (const std::uint32_t p : t) corners.push_back(expected[p]);
        }
        EXPECT_TRUE(same_bits(points, corners));
        EXPECT_EQ(data->GetNumberOfPolys(), static_cast<vtkIdType>(mesh.triangles.size()));
    } else {
        EXPECT_TRUE(same_bits(points, expected));
        EXPECT_TRUE(same_bits(triangles(data), mesh.triangles));
        EXPECT_TRUE(same_bits(vectors(data->GetPointData()->GetNormals()), in_space(mesh.normals, space)));
    }
}

TEST_P(EveryFormat, WritesNormalsThatAgreeWithTheirFaces) {
    const auto [ending, space] = GetParam();
    const TemporaryFolder folder;
    const auto file = folder / (std::string("ball.") + ending);
    if (mesh_format(file) == MeshFormat::stl) return;  // has normals of faces only
    Mesh turned = ball();
    for (std::size_t p = 0; p < turned.normals.size(); p += 3) {
        for (float& c : turned.normals[p]) c = -c;
    }
    const std::vector<Vec3f> inward(turned.normals.begin(), turned.normals.end());
    write_mesh(turned, file, {.space = space});
    EXPECT_GT(turn_normals_outward(turned), turned.normals.size() / 4);
    const std::vector<Vec3f> written = vectors(read_back(file)->GetPointData()->GetNormals());
    EXPECT_TRUE(same_bits(written, in_space(turned.normals, space)));
    EXPECT_FALSE(same_bits(written, inward));
}

TEST_P(EveryFormat, StatesItsSpaceWhere3DSlicerReadsIt) {
    const auto [ending, space] = GetParam();
    const TemporaryFolder folder;
    const auto file = folder / (std::string("ball.") + ending);
    write_mesh(ball(), file, {.space = space});
    const std::string name = space == Space::RAS ? "RAS" : "LPS";
    const std::string text = read_file(file);
    switch (mesh_format(file)) {
        case MeshFormat::stl: {
            const std::string header = text.substr(0, 80);
            EXPECT_NE(header.substr(0, 5), "solid");
            EXPECT_NE(header.find("SPACE=" + name + " UNITS=mm"), header.npos);
            break;
        }
        case MeshFormat::ply: {
            const std::string header = text.substr(0, text.find("end_header"));
            EXPECT_NE(header.find("\ncomment Marrow SPACE=" + name + " UNITS=mm\n"), header.npos);
            break;
        }
        case MeshFormat::obj:
            EXPECT_EQ(text.find("# Marrow SPACE=" + name + " UNITS=mm\n"), 0u);
            break;
        case MeshFormat::vtp: {
            const auto data = read_back(file);
            auto* mark = vtkStringArray::SafeDownCast(data->GetFieldData()->GetAbstractArray("SPACE"));
            ASSERT_TRUE(mark);
            EXPECT_EQ(mark->GetValue(0), name);
            break;
        }
        case MeshFormat::threemf:
        case MeshFormat::glb:
        case MeshFormat::dicom:
            FAIL() << "see mesh_formats_test.cpp";
    }
}

TEST_P(EveryFormat, WritesAMeshWithoutNormals) {
    const TemporaryFolder folder;
    const auto file = folder / (std::string("ball.") + GetParam().ending);
    Mesh mesh = ball();
    mesh.normals.clear();
    write_mesh(mesh, file, {.space = GetParam().space});
    const auto data = read_back(file);
    EXPECT_EQ(data->GetNumberOfPolys(), static_cast<vtkIdType>(mesh.triangles.size()));
    EXPECT_FALSE(data->GetPointData()->GetNormals());
}

TEST_P(EveryFormat, LeavesTheOldFileWhenCancelled) {
    const TemporaryFolder folder;
    const auto file = folder / (std::string("ball.") + GetParam().ending);
    write_file(file, "old");
    EXPECT_THROW(write_mesh(ball(), file, {.progress = [](double) { return false; }}), Cancelled);
    EXPECT_EQ(read_file(file), "old");
    EXPECT_EQ(folder.files().size(), 1u);
}

TEST_P(EveryFormat, ProgressRisesToOne) {
    const TemporaryFolder folder;
    double last = 0;
    write_mesh(ball(), folder / (std::string("ball.") + GetParam().ending),
               {.progress = [&](double fraction) {
                   EXPECT_GE(fraction, last);
                   last = fraction;
                   return true;
               }});
    EXPECT_EQ(last, 1);
}

TEST(WriteMesh, FilesThatHoldNoNormalsDoNotDependOnThem) {
    const Mesh with = ball();
    Mesh without = with;
    without.normals.clear();
    for (const char* const ending : {"stl", "ply", "obj", "vtp", "3mf", "glb"}) {
        const TemporaryFolder folder;
        const auto file = folder / (std::string("ball.") + ending),
                   other = folder / (std::string("other.") + ending);
        write_mesh(with, file);
        write_mesh(without, other);
        EXPECT_EQ(read_file(file) != read_file(other), holds_normals(mesh_format(file))) << ending;
    }
}

TEST(WriteStl, FacetNormalsAreUnitAndFaceOutward) {
    const TemporaryFolder folder;
    const Mesh mesh = ball();
    write_mesh(mesh, folder / "ball.stl");
    const std::string bytes = read_file(folder / "ball.stl");
    ASSERT_EQ(bytes.size(), 84 + 50 * mesh.triangles.size());
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        Vec3f facet;
        std::memcpy(facet.data(), bytes.data() + 84 + 50 * i, sizeof facet);
        ASSERT_NEAR(std::hypot(facet[0], facet[1], facet[2]), 1, 1e-6);
        for (const std::uint32_t p : mesh.triangles[i]) {
            const Vec3f& n = mesh.normals[p];
            ASSERT_GT(facet[0] * n[0] + facet[1] * n[1] + facet[2] * n[2], 0.8f);
        }
    }
}

TEST(WriteStl, GivesATriangleWithoutAreaNoNormal) {
    const TemporaryFolder folder;
    Mesh mesh;
    mesh.points = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}};
    mesh.triangles = {{0, 1, 2}};
    write_mesh(mesh, folder / "line.stl");
    EXPECT_EQ(read_file(folder / "line.stl").substr(84, 12), std::string(12, '\0'));
}

TEST(WriteMesh, AcceptsExtensionsInEitherCase) {
    EXPECT_EQ(mesh_format("a/B.STL"), MeshFormat::stl);
    EXPECT_EQ(mesh_format("a.b.Ply"), MeshFormat::ply);
    EXPECT_EQ(mesh_format("a.Obj.GZ"), MeshFormat::obj);
    EXPECT_EQ(mesh_format("a.3MF"), MeshFormat::threemf);
    EXPECT_EQ(mesh_format("a.glb"), MeshFormat::glb);
    EXPECT_THROW(mesh_format("a.gz"), InputError);
}

TEST(WriteMesh, RefusesAndLeavesNothing) {
    const TemporaryFolder folder;
    write_file(folder / "file", "old");
    const Mesh mesh = ball();
    EXPECT_THROW(write_mesh(mesh, folder / "a.xyz"), InputError);
    EXPECT_THROW(write_mesh(mesh, folder / "stl"), InputError);
    EXPECT_THROW(write_mesh(mesh, folder / "missing/a.stl"), IoError);
    EXPECT_THROW(write_mesh(mesh, folder / "file/a.stl"), IoError);
    Mesh uneven = ball();
    uneven.normals.pop_back();
    EXPECT_THROW(write_mesh(uneven, folder / "a.ply"), InputError);
    Mesh dangling = ball();
    dangling.triangles.back()[1] = static_cast<std::uint32_t>(dangling.points.size());
    EXPECT_THROW(write_mesh(dangling, folder / "a.stl"), InputError);
    for (const float x : {NAN, INFINITY}) {
        Mesh broken = ball();
        broken.points[3][1] = x;
        EXPECT_THROW(write_mesh(broken, folder / "a.stl"), InputError);
    }
    EXPECT_EQ(folder.files(), Names{"file"});
    EXPECT_EQ(read_file(folder / "file"), "old");
}

// The longest text of a float has 15 characters.
TEST(WriteMesh, TheLongestNumbersFit) {
    const TemporaryFolder folder;
    constexpr float kLongest = -1.00045885e-36f;
    Mesh mesh;
    mesh.points.assign(20'000, {kLongest, kLongest, kLongest});
    mesh.normals = mesh.points;
    mesh.triangles = {{0, 1, 19'999}};
    for (const char* name : {"a.obj", "a.3mf"}) {
        write_mesh(mesh, folder / name);
        const Mesh found = read_mesh(folder / name);
        EXPECT_TRUE(std::ranges::equal(found.points, mesh.points)) << name;
        EXPECT_TRUE(std::ranges::equal(found.triangles, mesh.triangles)) << name;
    }
}

TEST(WriteMesh, AnItemThatIsLongerThanItsWriterStatesIsNoticed) {
    internal::io::MeshOutput nowhere([](const void*, std::size_t) {}, {});
    const auto write_two_bytes = [](std::size_t, char* to) { return std::fill_n(to, 2, 'x'); };
    EXPECT_NO_THROW(nowhere.items<2>(8, 0, 1, write_two_bytes));
    EXPECT_THROW(nowhere.items<1>(8, 0, 1, write_two_bytes), std::logic_error);
}

// VTK reads the numbers of points, with the bits of what was written.
TEST(PointData, ReadsBackByVtk) {
    const TemporaryFolder folder;
    const Mesh mesh = ball();
    std::vector<float> shift(mesh.points.size()), noise(mesh.points.size());
    for (std::size_t i = 0; i < shift.size(); ++i) {
        shift[i] = 0.1f * static_cast<float>(i);
        noise[i] = -1 / (1 + static_cast<float>(i));
    }
    MeshObject object{mesh};
    object.arrays = {{"shift_mm", "mm", shift}, {"noise_mm", "mm", noise}};
    for (const bool normals : {true, false}) {
        if (!normals) object.mesh.normals = {};
        write_meshes(std::array{object}, folder / "a.vtp");
        vtkNew<vtkXMLPolyDataReader> vtp;
        vtp->SetFileName((folder / "a.vtp").c_str());
        vtp->Update();
        const auto values = [&](vtkPointData* data, const char* name) {
            vtkDataArray* const array = data->GetArray(name);
            std::vector<float> result;
            for (vtkIdType i = 0; array && i < array->GetNumberOfTuples(); ++i)
                result.push_back(static_cast<float>(array->GetTuple1(i)));
            return result;
        };
        EXPECT_EQ(values(vtp->GetOutput()->GetPointData(), "shift_mm"), shift);
        EXPECT_EQ(values(vtp->GetOutput()->GetPointData(), "noise_mm"), noise);
        // Marrow's own reader of PLY leaves them out, and finds the points and triangles behind them.
        write_meshes(std::array{object}, folder / "a.ply");
        const Mesh found = read_mesh(folder / "a.ply");
        EXPECT_TRUE(std::ranges::equal(found.points, mesh.points));
        EXPECT_TRUE(std::ranges::equal(found.triangles, mesh.triangles));
        const std::string bytes = read_file(folder / "a.ply");
        const std::size_t record = 4 * (normals ? 8 : 5), last = record * (shift.size() - 1) + record - 8;
        float pair[2];
        std::memcpy(pair, bytes.data() + bytes.find("end_header\n") + 11 + last, sizeof pair);
        EXPECT_EQ(pair[0], shift.back());
        EXPECT_EQ(pair[1], noise.back());
    }
}

TEST(PointData, OfAnotherLengthIsRefused) {
    const TemporaryFolder folder;
    const Mesh mesh = ball();
    const std::vector<float> few(mesh.points.size() - 1);
    MeshObject object{mesh};
    object.arrays = {{"a", "", few}};
    EXPECT_THROW(write_meshes(std::array{object}, folder / "a.ply"), InputError);
    const std::vector<Rgb8> colours(1);
    object.arrays = {};
    object.point_colours = colours;
    EXPECT_THROW(write_meshes(std::array{object}, folder / "a.glb"), InputError);
}

TEST(PointData, OfSurfacesWithDifferentMeaningsHasAll) {
    const TemporaryFolder folder;
    const Mesh mesh = ball();
    const std::vector<float> values(mesh.points.size());
    MeshObject a{mesh}, b{mesh};
    a.name = "skin", b.name = "bone";
    a.arrays = {{"step", "mm", values}, {"wall", "not looked for", values}};
    b.arrays = {{"step", "mm", values}, {"wall", "1 beside a wall", values}};
    write_meshes(std::array{a, b}, folder / "a.vtp");
    const auto data = read_back(folder / "a.vtp");
    auto* meanings = vtkStringArray::SafeDownCast(data->GetFieldData()->GetAbstractArray("Meanings"));
    ASSERT_TRUE(meanings);
    std::vector<std::string> lines;
    for (vtkIdType k = 0; k < meanings->GetNumberOfValues(); ++k) lines.push_back(meanings->GetValue(k));
    EXPECT_EQ(lines, (std::vector<std::string>{"step: mm", "skin, wall: not looked for",
                                               "bone, wall: 1 beside a wall"}));
}

TEST(PointData, NamesAndMeaningsThatWouldBreakTheFileAreRefused) {
    const TemporaryFolder folder;
    const Mesh mesh = ball();
    const std::vector<float> values(mesh.points.size());
    const auto write = [&](std::vector<PointArray> arrays) {
        for (const char* name : {"a.ply", "a.vtp"}) {
            MeshObject object{mesh};
            object.arrays = arrays;
            write_meshes(std::array{object}, folder / name);
        }
    };
    EXPECT_NO_THROW(write({{"noise_2", "in mm, \xc2\xb1", values}, {"Noise_2", "", values}}));
    for (const char* name : {"", "a b", "a\n",
                             "sch\xc3\xa4"
                             "del",
                             "a\"", "x", "y", "z", "nx", "ny", "nz", "Normals"})
        EXPECT_THROW(write({{name, "", values}}), InputError) << name;
    EXPECT_THROW(write({{"a", "", values}, {"a", "", values}}), InputError);
    EXPECT_THROW(write({{"a", "mm\nelement vertex 1", values}}), InputError);
}

TEST(MeshFiles, AppearTogetherOrNotAtAll) {
    const TemporaryFolder folder;
    const Mesh mesh = ball();
    const MeshObject object{mesh};
    write_file(folder / "a.stl", "old");
    {
        MeshFiles files;
        files.write({&object, 1}, folder / "a.stl");
        files.write({&object, 1}, folder / "b.ply");
        EXPECT_THROW(files.write({&object, 1}, folder / "missing" / "c.ply"), IoError);
        EXPECT_EQ(read_file(folder / "a.stl"), "old");
    }
    EXPECT_EQ(folder.files(), Names{"a.stl"});
    EXPECT_EQ(read_file(folder / "a.stl"), "old");

    // A file that failed is not in the set.
    MeshFiles files;
    EXPECT_THROW(files.write({&object, 1}, folder / "c.vtp", {Space::LPS, [](double) { return false; }}),
                 Cancelled);
    files.write({&object, 1}, folder / "a.stl");
    files.write({&object, 1}, folder / "b.ply");
    files.commit();
    EXPECT_EQ(folder.files(), (Names{"a.stl", "b.ply"}));
    EXPECT_EQ(read_mesh(folder / "a.stl").triangles.size(), mesh.triangles.size());
}

// The parts of a surface would each report from 0 to 1, and a caller could take false for their end.
TEST(SurfaceWriter, DoesNotCallProgress) {
    const TemporaryFolder folder;
    const Mesh mesh = ball();
    for (const char* const name : {"a.stl", "b.ply"}) {
        int calls = 0;
        SurfaceWriter writer(folder / name, {Space::LPS, [&](double) { return ++calls < 0; }});
        const SurfaceSink sink = writer.sink();
        sink.begin(mesh.points.size(), mesh.triangles.size(), true);
        sink.part({0, mesh.points, mesh.normals, 0, mesh.triangles, mesh.points.size()});
        writer.commit();
        EXPECT_EQ(calls, 0) << name;
        EXPECT_EQ(read_mesh(folder / name).triangles.size(), mesh.triangles.size()) << name;
    }
}

TEST(WriteMeshes, DoesNotCompileWithTemporaryMeshes) {
    EXPECT_TRUE((std::is_constructible_v<KeptMeshView, const Mesh&>));
    EXPECT_TRUE((std::is_constructible_v<KeptMeshView, MeshView>));
    EXPECT_FALSE((std::is_constructible_v<decltype(MeshObject::mesh), Mesh&&>)) << "it would be freed";
}

// A label map may have more labels than a process may have open files.
TEST(MeshFiles, AreNotKeptOpen) {
    const TemporaryFolder folder;
    const Mesh mesh = ball();
    const MeshObject object{mesh};
    rlimit before{};
    getrlimit(RLIMIT_NOFILE, &before);
    rlimit few = before;
    few.rlim_cur = 40;
    setrlimit(RLIMIT_NOFILE, &few);
    {
        MeshFiles files;
        for (int i = 0; i < 100; ++i) files.write({&object, 1}, folder / (std::to_string(i) + ".stl"));
        files.commit();
    }
    setrlimit(RLIMIT_NOFILE, &before);
    EXPECT_EQ(folder.files().size(), 100u);
}

}  // namespace
}  // namespace marrow::test
