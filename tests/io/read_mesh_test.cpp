// read_mesh: STL, PLY, OBJ and VTP, as Marrow and others write them, and damaged.
#include <gtest/gtest.h>

#include <vtkCellArray.h>
#include <vtkFieldData.h>
#include <vtkNew.h>
#include <vtkPLYWriter.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkSTLWriter.h>
#include <vtkStringArray.h>
#include <vtkXMLPolyDataReader.h>
#include <vtkXMLPolyDataWriter.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <functional>
#include <map>

#include <marrow/error.h>
#include <marrow/isosurface.h>
#include <marrow/measure.h>
#include <marrow/mesh_io.h>

#include "support/fields.h"
#include "support/mesh_checks.h"
#include "support/scan_files.h"
#include "support/temporary_folder.h"

namespace marrow::test {
namespace {

namespace fs = std::filesystem;

Mesh ball() {
    Geometry g = grid(14, 14, 14);
    g.origin = {3, -40, 100};
    const Volume volume = sampled_in_space<float>(g, sphere({9.613, -33.571, 106.297}, 5.137));
    return extract_isosurface(volume, 0);
}

// More triangles than are read between two reports of progress.
Mesh large_mesh() {
    Random random(3);
    const Volume volume =
        sampled<std::int16_t>(grid(24, 25, 23), [&](auto, auto, auto) { return random() % 100; });
    return extract_isosurface(volume, 49.5, {.closed = true});
}

vtkNew<vtkPolyData> poly_data(const Mesh& mesh) {
    vtkNew<vtkPolyData> data;
    vtkNew<vtkPoints> points;
    vtkNew<vtkCellArray> polys;
    for (const Vec3f& p : mesh.points) points->InsertNextPoint(p.data());
    for (const Triangle& t : mesh.triangles) {
        const vtkIdType corners[3] = {t[0], t[1], t[2]};
        polys->InsertNextCell(3, corners);
    }
    data->SetPoints(points);
    data->SetPolys(polys);
    return data;
}

void expect_same(const Mesh& read, const Mesh& mesh) {
    EXPECT_TRUE(read.points == mesh.points);
    EXPECT_TRUE(read.triangles == mesh.triangles);
    EXPECT_TRUE(read.normals.empty());
}

// Calls `write(set)` for every form of VTK's files that is read; `set` sets the writer to the form.
template <class Writer, class Write>
void in_every_form(Writer& vtp, Write write) {
    for (const int mode : {vtkXMLWriter::Ascii, vtkXMLWriter::Binary, vtkXMLWriter::Appended}) {
        for (const bool packed : {false, true}) {
            for (const bool base64 : {false, true}) {
                write([&vtp, mode, packed, base64] {
                    vtp->SetDataMode(mode);
                    packed ? vtp->SetCompressorTypeToZLib() : vtp->SetCompressorTypeToNone();
                    vtp->SetEncodeAppendedData(base64);
                    vtp->SetBlockSize(1000 * 24);
                    base64 ? vtp->SetHeaderTypeToUInt32() : vtp->SetHeaderTypeToUInt64();
                });
            }
        }
    }
}

class ReadMesh : public testing::Test {
  protected:
    fs::path write(const std::string& name, const std::string& text) {
        write_file(folder / name, text);
        return folder / name;
    }
    const TemporaryFolder folder;
    const Mesh mesh = ball();
};

TEST_F(ReadMesh, ReadsBackWhatIsWrittenInEitherSpace) {
    for (const Space space : {Space::LPS, Space::RAS}) {
        for (const char* name :
             {"a.ply", "a.obj", "a.vtp", "a.stl", "a.3mf", "a.ply.gz", "a.obj.gz", "a.stl.gz"}) {
            const fs::path file = folder / name;
            write_mesh(mesh, file, {space, {}});
            Space stated = Space::none;
            const Mesh read = read_mesh(file, &stated);
            EXPECT_EQ(stated, space) << name;
            if (mesh_format(file) != MeshFormat::stl) {
                expect_same(read, mesh);
                continue;
            }
            EXPECT_EQ(triangle_positions(read), triangle_positions(mesh));
            EXPECT_EQ(measure(read).points, measure(mesh).points);
            EXPECT_EQ(manifold_fault(read), "");
        }
    }
}

// STL has only coordinates. If several points lay on a sample that equals the isovalue, joining them would
// make edges of four triangles.
TEST_F(ReadMesh, StlOfSamplesAtTheIsovalueStaysAManifold) {
    Random random(7);
    Geometry g = grid(12, 13, 11);
    g.spacing = {0.4, 0.4, 1.5};
    g.origin = {-120, 35, 210};
    const Volume volume = sampled<std::int16_t>(g, [&](auto, auto, auto) { return random() % 4; });
    for (const double isovalue : {1.0, 2.0, 3.0}) {
        const Mesh mesh = extract_isosurface(volume, isovalue, {.closed = true});
        write_mesh(mesh, folder / "ties.stl");
        const Mesh joined = read_mesh(folder / "ties.stl");
        EXPECT_EQ(joined.points.size(), mesh.points.size());
        EXPECT_EQ(manifold_fault(joined), "");
    }
}

TEST_F(ReadMesh, StlJoinsEqualCornersInTheOrderOfTheFile) {
    const Mesh noise = large_mesh();
    Mesh expected;
    std::map<Vec3f, std::uint32_t> numbers;  // -0 is not before 0
    for (const Triangle& t : noise.triangles) {
        Triangle joined{};
        for (std::size_t c = 0; c < 3; ++c) {
            const Vec3f& p = noise.points[t[c]];
            const auto [at, is_new] = numbers.try_emplace(p, static_cast<std::uint32_t>(numbers.size()));
            if (is_new) expected.points.push_back(p);
            joined[c] = at->second;
        }
        expected.triangles.push_back(joined);
    }
    write_mesh(noise, folder / "a.stl");
    expect_same(read_mesh(folder / "a.stl"), expected);

    const std::string facet = "facet\nvertex 0 -0 0\nvertex 1 0 0\nvertex 0 1 0\nendfacet\n",
                      next = "facet\nvertex -0 0 -0\nvertex 0 1 0\nvertex -1 0 0\nendfacet\n";
    EXPECT_EQ(read_mesh(write("b.stl", "solid\n" + facet + next + "endsolid\n")).points.size(), 4u);
}

TEST_F(ReadMesh, ReportsProgressAndCanBeCancelled) {
    const Mesh noise = large_mesh();
    for (const char* name : {"a.ply", "a.obj", "a.vtp", "a.stl", "a.3mf", "a.glb", "a.dcm", "a.obj.gz"}) {
        write_mesh(noise, folder / name);
        double last = 0;
        int calls = 0;
        const Mesh read = read_mesh(folder / name, nullptr, [&](double fraction) {
            EXPECT_GE(fraction, last) << name;
            EXPECT_LE(fraction, 1) << name;
            last = fraction;
            ++calls;
            return true;
        });
        EXPECT_EQ(read.triangles.size(), noise.triangles.size()) << name;
        EXPECT_GE(calls, 2) << name;
        EXPECT_THROW(read_meshes(folder / name, nullptr, [](double) { return false; }), Cancelled) << name;
    }
}

TEST_F(ReadMesh, KeepsObjectsApart) {
    Mesh other = mesh;
    other.triangles.resize(mesh.triangles.size() / 2);
    for (Vec3f& p : other.points) p[0] += 100;
    const MeshObject objects[] = {{mesh, "bone & marrow"}, {mesh, "skin"}, {other, "half"}};
    for (const char* name : {"a.3mf", "a.glb", "a.obj", "a.vtp"}) {
        write_meshes(objects, folder / name);
        const std::vector<NamedMesh> read = read_meshes(folder / name);
        ASSERT_EQ(read.size(), 3u) << name;
        EXPECT_EQ(read[1].name, "skin") << name;
        EXPECT_EQ(read[2].name, "half") << name;
        EXPECT_EQ(read[0].mesh.triangles, mesh.triangles) << name;
        EXPECT_EQ(read[1].mesh.triangles, mesh.triangles) << name;
        EXPECT_EQ(read[2].mesh.triangles.size(), other.triangles.size()) << name;
        EXPECT_LT(read[2].mesh.points.size(), other.points.size()) << name << ": only those with triangles";
        EXPECT_NEAR(measure(read[2].mesh).area, measure(other).area, 1e-3) << name;
        if (std::string(name) == "a.glb") continue;  // converted from metres
        EXPECT_EQ(read[0].mesh.points, mesh.points) << name;
    }
    write_mesh(mesh, folder / "a.stl");
    ASSERT_EQ(read_meshes(folder / "a.stl").size(), 1u);
}

TEST_F(ReadMesh, KeepsObjectsWithoutNamesApart) {
    for (const char* name : {"a.3mf", "a.glb", "a.obj", "a.vtp"}) {
        write_meshes(std::array{MeshObject{mesh, "bone"}, MeshObject{mesh}}, folder / name);
        const std::vector<NamedMesh> named = read_meshes(folder / name);
        ASSERT_EQ(named.size(), 2u) << name;
        EXPECT_EQ(named[0].name, "bone") << name;
        EXPECT_EQ(named[1].name, mesh_format(name) == MeshFormat::obj ? "surface 2" : "") << name;
        write_meshes(std::array{MeshObject{mesh}, MeshObject{mesh}}, folder / name);
        EXPECT_EQ(read_meshes(folder / name).size(), 2u) << name;
    }
    write_mesh(mesh, folder / "one.obj");
    EXPECT_EQ(read_meshes(folder / "one.obj").at(0).name, "");
}

TEST_F(ReadMesh, TakesObjectsThatSharePointsAsOne) {
    const std::string points = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
    const auto cut = read_meshes(write("cut.obj", points + "o a\nf 1 3 2\nf 1 2 4\no b\nf 1 4 3\nf 2 3 4\n"));
    ASSERT_EQ(cut.size(), 1u);
    EXPECT_EQ(measure(cut[0].mesh).boundary_edges, 0);
    const auto apart = read_meshes(
        write("apart.obj", points + "f 1 2 3\no  the rest \r\n" + points + "f -4 -3 -1\no empty\n"));
    ASSERT_EQ(apart.size(), 2u);
    EXPECT_EQ(apart[0].name, "");
    EXPECT_EQ(apart[1].name, "the rest");
    EXPECT_EQ(apart[1].mesh.points.size(), 3u);
}

TEST_F(ReadMesh, ReadsWhatVtkWrites) {
    const auto data = poly_data(mesh);
    const auto same_surface = [&](const fs::path& file) {
        Space stated = Space::RAS;
        const Mesh read = read_mesh(file, &stated);
        EXPECT_EQ(stated, Space::none) << "VTK states no space of its own";
        EXPECT_EQ(triangle_positions(read), triangle_positions(mesh)) << file;
    };
    const auto write_with = [&](auto& writer, const char* name, auto... settings) {
        const fs::path file = folder / name;
        writer->SetInputData(data);
        writer->SetFileName(file.c_str());
        (settings(), ...);
        writer->Write();
        same_surface(file);
    };
    vtkNew<vtkSTLWriter> stl;
    write_with(stl, "a.stl", [&] { stl->SetFileTypeToBinary(); });
    vtkNew<vtkPLYWriter> ply;
    write_with(ply, "little.ply", [&] { ply->SetFileTypeToBinary(), ply->SetDataByteOrderToLittleEndian(); });
    write_with(ply, "big.ply", [&] { ply->SetDataByteOrderToBigEndian(); });
    vtkNew<vtkXMLPolyDataWriter> vtp;
    in_every_form(vtp, [&](auto set) { write_with(vtp, "a.vtp", set); });
}

TEST_F(ReadMesh, KeepsSpaceAndNamesOfAVtpThatVtkSavesAgain) {
    write_meshes(std::array{MeshObject{mesh, "bone"}, MeshObject{mesh, "skin"}}, folder / "a.vtp",
                 {.space = Space::RAS});
    vtkNew<vtkXMLPolyDataReader> reader;
    reader->SetFileName((folder / "a.vtp").c_str());
    reader->Update();
    const fs::path file = folder / "b.vtp";
    vtkNew<vtkXMLPolyDataWriter> vtp;
    in_every_form(vtp, [&](auto set) {
        vtp->SetInputData(reader->GetOutput());
        vtp->SetFileName(file.c_str());
        set();
        vtp->Write();
        Space stated = Space::none;
        const std::vector<NamedMesh> read = read_meshes(file, &stated);
        EXPECT_EQ(stated, Space::RAS);
        ASSERT_EQ(read.size(), 2u);
        EXPECT_EQ(read[0].name, "bone");
        EXPECT_EQ(read[1].name, "skin");
        expect_same(read[0].mesh, mesh);
    });
}

TEST_F(ReadMesh, ReadsTextFormatsAsOthersWriteThem) {
    const Mesh stl = read_mesh(write("a.stl",
                                     "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n"
                                     "vertex 1e0 0 0\nvertex 0 +1 0\nendloop\nendfacet\nfacet normal 0 0 1\n"
                                     "outer loop\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 -0.0\nendloop\n"
                                     "endfacet\nendsolid x\n"));
    EXPECT_EQ(stl.points.size(), 4u) << "those at the same place are one";
    EXPECT_EQ(measure(stl).boundary_edges, 4);

    const Mesh obj = read_mesh(write("a.obj",
                                     "# a square\r\nv 0 0 0 1\nv 1 0 0\nvn 0 0 1\nv 1 1 0\nv 0 1 0\n"
                                     "g side\nf 1/1/1 2//1 3/2 -1\n"));
    EXPECT_TRUE(obj.triangles == (Buffer<Triangle>{{0, 1, 2}, {0, 2, 3}}));

    const Mesh ply = read_mesh(write("a.ply",
                                     "ply\nformat ascii 1.0\nelement vertex 4\nproperty uchar red\n"
                                     "property double x\nproperty double y\nproperty double z\n"
                                     "element face 1\nproperty uchar flag\n"
                                     "property list uchar int vertex_index\nelement edge 0\n"
                                     "property int vertex1\nend_header\n"
                                     "9 0 0 0\n9 1 0 0\n9 1 1 0\n9 0 1 0\n7 4 0 1 2 3\n"));
    EXPECT_TRUE(ply.points == obj.points);
    EXPECT_TRUE(ply.triangles == obj.triangles);
}

TEST_F(ReadMesh, ObjMayContinueLinesAndEndThemByCarriageReturns) {
    const Mesh square = read_mesh(write("a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4"));
    for (const char* text : {"v 0 0 0\rv 1 0 0\rv 1 1 0\rv 0 1 0\rf 1 2 3 4\r",
                             "# C:\\scans\\\nv 0 0 0\nv 1 \\\n0 0\nv 1 1 0\nv 0 1 0\nf 1 2\\\n 3 \\\n4\n",
                             "v 0 \\\r\n0 0\r\nv 1 0 0\r\nv 1 1 0\r\nv 0 1 0\r\nf 1 2 3\\\r\n4\r\n"}) {
        const Mesh read = read_mesh(write("b.obj", text));
        EXPECT_TRUE(read.points == square.points) << text;
        EXPECT_TRUE(read.triangles == square.triangles) << text;
    }
    EXPECT_EQ(read_mesh(write("c.obj", "v 0 0 0\\")).points.size(), 1u);
}

std::string stl_facet(int vertices) {
    std::string text = "facet normal 0 0 1\nouter loop\n";
    for (int v = 0; v < vertices; ++v)
        text += "vertex " + std::to_string(v % 2) + ' ' + std::to_string(v / 2) + " 0\n";
    return text + "endloop\nendfacet\n";
}

TEST_F(ReadMesh, StlMayHaveSeveralSolidsInCapitals) {
    const std::string first = "solid a SPACE=RAS\n" + stl_facet(3) + "endsolid a\n";
    std::string second = "solid b\n" + stl_facet(3) + "endsolid b\n";
    for (char& c : second) c = static_cast<char>(std::toupper(c));
    for (const std::string& text : {first + second, second + first}) {
        Space space = Space::none;
        EXPECT_EQ(read_mesh(write("a.stl", text), &space).triangles.size(), 2u);
        EXPECT_EQ(space, Space::RAS) << "the other solid states none";
    }
    EXPECT_EQ(read_mesh(write("a.stl", second)).triangles.size(), 1u);
    EXPECT_THROW(read_mesh(write("a.stl", first + second.substr(0, second.find("ENDSOLID")))), InputError);
}

TEST_F(ReadMesh, TextStlMayHaveAnyWhiteSpace) {
    std::string text = "solid a\n" + stl_facet(3) + stl_facet(3) + "endsolid a\n";
    const std::size_t first = text.find('\n'), last = text.rfind("endsolid");
    std::replace(text.begin() + static_cast<std::ptrdiff_t>(first) + 1,
                 text.begin() + static_cast<std::ptrdiff_t>(last), '\n', ' ');
    EXPECT_EQ(read_mesh(write("a.stl", text)).triangles.size(), 2u);
}

TEST_F(ReadMesh, ObjMayBeginWithAByteOrderMarkAndNameFacesFirst) {
    const std::string points = "v 0 0 0\nv 1 0 0\nv 0 1 0\n", face = "f 1 2 3\n";
    for (const std::string& text : {"\xEF\xBB\xBF" + points + face, face + points}) {
        const Mesh read = read_mesh(write("a.obj", text));
        EXPECT_EQ(read.points.size(), 3u);
        ASSERT_EQ(read.triangles.size(), 1u);
        EXPECT_EQ(read.triangles[0], (Triangle{0, 1, 2}));
    }
    EXPECT_THROW(read_mesh(write("a.obj", points + "f 1 2 4\n")), InputError);
    EXPECT_THROW(read_mesh(write("a.obj", "f 1 2 -1\n" + points)), InputError) << "before the first point";
    // Messages count like the file.
    for (const auto& [text, point] : {std::pair{points + "f 1 2 4\n", "4"},
                                      {"f 1 2 3\n", "1"},
                                      {points + "f 1 2 -5\n", "-5"},
                                      {points + "f 1 2 99999999999\n", "99999999999"}}) {
        try {
            read_mesh(write("a.obj", text));
            ADD_FAILURE() << text;
        } catch (const InputError& error) {
            EXPECT_NE(std::string(error.what()).find(std::string("names point ") + point + ", which"),
                      std::string::npos)
                << error.what();
        }
    }
}

TEST_F(ReadMesh, NamesThatEndWithABackslashComeBackFromObj) {
    const MeshObject objects[] = {{mesh, "liver\\"}, {mesh, "b"}};
    write_meshes(objects, folder / "a.obj");
    const std::vector<NamedMesh> read = read_meshes(folder / "a.obj");
    ASSERT_EQ(read.size(), 2u);
    EXPECT_EQ(read[0].name, "liver\\");
    expect_same(read[0].mesh, mesh);
}

TEST_F(ReadMesh, RefusesFacetsOfStlThatAreNoTriangles) {
    for (const auto& [one, other] : {std::pair{4, 2}, {2, 4}, {6, 3}, {3, 6}, {3, 0}})
        EXPECT_THROW(read_mesh(write("a.stl", "solid\n" + stl_facet(one) + stl_facet(other) + "endsolid\n")),
                     InputError)
            << one << " and " << other;
}

TEST_F(ReadMesh, RefusesPlyWhoseGeometryIsInAnotherForm) {
    const auto refusal = [&](const std::string& from, const std::string& to) {
        std::string text =
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
            "element face 1\nproperty list int int vertex_indices\nend_header\n5 0 0\n1 0 0\n0 1 0\n3 0 1 "
            "2\n";
        text.replace(text.find(from), from.size(), to);
        try {
            EXPECT_EQ(read_mesh(write("a.ply", text)).triangles.size(), 1u);
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    const auto says = [](const std::string& said, const std::string& why) {
        return said.find(why) != said.npos;
    };
    EXPECT_EQ(refusal("element face", "element tristrips 0\nelement face"), "");
    EXPECT_PRED2(says, refusal("element face", "element tristrips"), "has triangle strips");
    EXPECT_PRED2(says, refusal("vertex_indices", "corners"), "its faces have no list vertex_indices");
    EXPECT_PRED2(says, refusal("float y", "float Y"), "its points have no coordinate y");
    EXPECT_PRED2(says, refusal("float z", "list int float z"), "its points have no coordinate z");
    EXPECT_PRED2(says, refusal("element vertex", "element point"), "has no points");
}

TEST_F(ReadMesh, RefusesFilesThatAreCutOff) {
    for (const char* name : {"a.stl", "a.ply", "a.vtp", "a.obj"}) {
        write_mesh(mesh, folder / name);
        const std::string whole = read_file(folder / name);
        for (const double fraction : {0.0, 0.02, 0.1, 0.5, 0.97}) {
            const fs::path cut = write(std::string("cut-") + name,
                                       whole.substr(0, static_cast<std::size_t>(fraction * whole.size())));
            EXPECT_THROW(read_mesh(cut), InputError) << name << " " << fraction;
        }
    }
}

TEST_F(ReadMesh, RefusesObjThatIsCutOffInItsLastLine) {
    write_mesh(mesh, folder / "a.obj");
    std::string text = read_file(folder / "a.obj");
    text.pop_back();
    EXPECT_THROW(read_mesh(write("b.obj", text)), InputError);
    text.replace(0, text.find('\n'), "# by another program");
    EXPECT_NO_THROW(read_mesh(write("b.obj", text))) << "others may leave out the last newline";
}

TEST_F(ReadMesh, OnlyMarrowsObjMayBeEmpty) {
    write_mesh(Mesh{}, folder / "empty.obj");
    EXPECT_TRUE(read_mesh(folder / "empty.obj").points.empty());
    for (const char* text : {"", "hello", "# Marrow", "# a comment\n", "\x7f\x45\x4c\x46\n"})
        EXPECT_THROW(read_mesh(write("a.obj", text)), InputError) << text;
}

TEST_F(ReadMesh, CompressedFilesThatExpandEndlesslyAreRefused) {
    const std::string packed = gzipped(std::string(70 << 20, '\n'));
    for (const char* name : {"a.stl.gz", "a.ply.gz", "a.obj.gz"}) {
        try {
            read_mesh(write(name, packed));
            FAIL() << name;
        } catch (const InputError& error) {
            EXPECT_NE(std::string(error.what()).find("expands to more than 100 times"), std::string::npos)
                << error.what();
        }
    }
}

TEST_F(ReadMesh, RefusesCompressedFilesThatAreCutOffOrDamaged) {
    for (const char* name : {"a.stl.gz", "a.ply.gz", "a.obj.gz"}) {
        write_mesh(mesh, folder / name);
        const std::string whole = read_file(folder / name);
        for (const std::size_t size : {std::size_t{0}, std::size_t{7}, whole.size() / 2, whole.size() - 1})
            EXPECT_THROW(read_mesh(write(std::string("cut-") + name, whole.substr(0, size))), InputError)
                << name << " " << size;
        std::string damaged = whole;
        damaged[whole.size() - 6] ^= 1;  // in the checksum
        EXPECT_THROW(read_mesh(write(std::string("bad-") + name, damaged)), InputError) << name;
        EXPECT_THROW(read_mesh(write(std::string("plain-") + name, "not compressed")), InputError) << name;
    }
    // Several gzip streams, one after the other.
    write_mesh(mesh, folder / "a.obj.gz");
    const std::string once = read_file(folder / "a.obj.gz");
    const Mesh twice = read_mesh(write("b.obj.gz", once + once));
    EXPECT_EQ(twice.points.size(), 2 * mesh.points.size());
}

TEST_F(ReadMesh, DamagedBytesNeverGiveAnInvalidMesh) {
    Random random(4);
    for (const char* name : {"a.stl", "a.ply", "a.obj", "a.vtp", "a.stl.gz", "a.obj.gz"}) {
        write_mesh(mesh, folder / name);
        const std::string whole = read_file(folder / name);
        for (int trial = 0; trial < 300; ++trial) {
            std::string damaged = whole;
            // Most errors are possible in headers.
            const std::size_t reach = trial % 2 ? std::min<std::size_t>(1500, whole.size()) : whole.size();
            for (int i = 0; i < 3; ++i) damaged[random() % reach] = static_cast<char>(random());
            try {
                const Mesh read = read_mesh(write(std::string("b-") + name, damaged));
                measure(read);  // throws if a triangle names a missing point
            } catch (const Error&) {
            }
        }
    }
}

TEST_F(ReadMesh, RefusesOtherFiles) {
    EXPECT_THROW(read_mesh(write("a.stl", "not a mesh")), InputError);
    EXPECT_THROW(read_mesh(write("a.off", "OFF")), InputError);
    EXPECT_THROW(read_mesh(write("a.obj", "v 0 0 0\nf 1 1 2\n")), InputError);
    EXPECT_THROW(read_mesh(write("b.obj", "v 0 zero 0\n")), InputError);
    EXPECT_THROW(read_mesh(write("a.ply",
                                 "ply\nformat ascii 2\nelement vertex 99999999999\n"
                                 "property float x\nend_header\n1\n")),
                 InputError);
    EXPECT_THROW(read_mesh(write("a.vtp", "<VTKFile type=\"ImageData\"></VTKFile>")), InputError);
    EXPECT_THROW(read_mesh(folder / "missing.stl"), IoError);
    EXPECT_THROW(read_mesh(folder.path() / "..stl"), IoError);
}

TEST_F(ReadMesh, VtpThatExpandsEndlesslyIsRefused) {
    const auto expect_refused = [&](const std::string& text, const std::string& why) {
        try {
            read_mesh(write("a.vtp", text));
            FAIL() << why;
        } catch (const InputError& error) {
            EXPECT_NE(std::string(error.what()).find(why), std::string::npos) << error.what();
        }
    };
    // Each of many pieces refers to the same points.
    const std::string points(120'000, '\0');
    std::string text =
        "<VTKFile type=\"PolyData\" byte_order=\"LittleEndian\" header_type=\"UInt64\"><PolyData>";
    for (int i = 0; i < 2000; ++i)
        text +=
            "<Piece><Points><DataArray type=\"Float32\" format=\"appended\" offset=\"0\"/></Points></Piece>";
    const std::uint64_t size = points.size();
    text += "</PolyData><AppendedData encoding=\"raw\">_";
    text.append(reinterpret_cast<const char*>(&size), sizeof size);
    expect_refused(text + points, "more than 100 times the size");
    std::string pieces = "<VTKFile type=\"PolyData\"><PolyData>";
    for (int i = 0; i < 10'001; ++i) pieces += "<Piece/>";
    expect_refused(pieces + "</PolyData></VTKFile>", "more than 10000 pieces");
}

}  // namespace
}  // namespace marrow::test
