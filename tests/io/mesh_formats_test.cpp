// Files with several surfaces, 3MF and GLB, read by the libraries of other projects.
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <span>

#include <gtest/gtest.h>
#include <zlib.h>

#include <Model/COM/NMR_DLLInterfaces.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkStringArray.h>
#include <vtkXMLPolyDataReader.h>
#include <assimp/Importer.hpp>

#include <marrow/error.h>
#include <marrow/isosurface.h>
#include <marrow/measure.h>
#include <marrow/mesh_io.h>

#include "io/mesh/writer.h"
#include "support/fields.h"
#include "support/temporary_folder.h"

namespace marrow::test {
namespace {

// Rotated and shifted, so that coordinates have many digits and both signs.
Mesh ball(double radius, double x) {
    Geometry g = grid(21, 22, 19);
    const double c = std::cos(0.3), s = std::sin(0.3);
    g.direction = {{{c, -s, 0}, {s, c, 0}, {0, 0, 1}}};
    g.spacing = {0.7, 0.9, 1.1};
    g.origin = {-3.3 + x, -5.7, 1e-5};
    const Volume volume = sampled_in_space<float>(g, sphere(g.physical({10, 10.5, 9}), radius));
    return extract_isosurface(volume, 0);
}

// Two surfaces with difficult names.
struct Two {
    const Mesh first = ball(4, 0), second = ball(5, 100);
    const std::string first_name = "Skull & \"<jaw>\" ü", second_name = "skin\\2";
    const std::vector<MeshObject> objects{{first, first_name, std::array{1.0, 0.5, 0.0}},
                                          {second, second_name, std::array{0.0, 0.2, 1.0}}};
};

struct ReadObject {
    std::string name;
    std::array<int, 4> colour{};
    std::vector<Vec3f> points;
    std::vector<Triangle> triangles;
};

// Reads a file by lib3mf in strict mode.
std::vector<ReadObject> read_3mf(const std::filesystem::path& file) {
    using namespace NMR;
    std::vector<ReadObject> objects;
    PLib3MFModel* model = nullptr;
    PLib3MFModelReader* reader = nullptr;
    EXPECT_EQ(lib3mf_createmodel(&model), 0);
    EXPECT_EQ(lib3mf_model_queryreader(model, "3mf", &reader), 0);
    EXPECT_EQ(lib3mf_reader_setstrictmodeactive(reader, 1), 0);
    EXPECT_EQ(lib3mf_reader_readfromfileutf8(reader, file.c_str()), 0);
    DWORD warnings = 1, unit = 0;
    EXPECT_EQ(lib3mf_reader_getwarningcount(reader, &warnings), 0);
    EXPECT_EQ(warnings, 0u);
    EXPECT_EQ(lib3mf_model_getunit(model, &unit), 0);
    EXPECT_EQ(unit, static_cast<DWORD>(MODELUNIT_MILLIMETER));
    PLib3MFModelResourceIterator* items = nullptr;
    EXPECT_EQ(lib3mf_model_getmeshobjects(model, &items), 0);
    for (BOOL more = 0; lib3mf_resourceiterator_movenext(items, &more) == 0 && more;) {
        PLib3MFModelResource* object = nullptr;
        EXPECT_EQ(lib3mf_resourceiterator_getcurrent(items, &object), 0);
        ReadObject read;
        char name[256] = "";
        ULONG needed = 0;
        EXPECT_EQ(lib3mf_object_getnameutf8(object, name, sizeof name, &needed), 0);
        read.name = name;
        DWORD points = 0, triangles = 0, got = 0;
        EXPECT_EQ(lib3mf_meshobject_getvertexcount(object, &points), 0);
        EXPECT_EQ(lib3mf_meshobject_gettrianglecount(object, &triangles), 0);
        static_assert(sizeof(MODELMESHVERTEX) == sizeof(Vec3f) &&
                      sizeof(MODELMESHTRIANGLE) == sizeof(Triangle));
        read.points.resize(points);
        read.triangles.resize(triangles);
        EXPECT_EQ(lib3mf_meshobject_getvertices(
                      object, reinterpret_cast<MODELMESHVERTEX*>(read.points.data()), points, &got),
                  0);
        EXPECT_EQ(lib3mf_meshobject_gettriangleindices(
                      object, reinterpret_cast<MODELMESHTRIANGLE*>(read.triangles.data()), triangles, &got),
                  0);
        PLib3MFDefaultPropertyHandler* property = nullptr;
        EXPECT_EQ(lib3mf_object_createdefaultpropertyhandler(object, &property), 0);
        DWORD group = 0, index = 0;
        if (lib3mf_defaultpropertyhandler_getbasematerial(property, &group, &index) == 0 && group > 0) {
            PLib3MFModelBaseMaterial* material = nullptr;
            BYTE r = 0, g = 0, b = 0, a = 0;
            EXPECT_EQ(lib3mf_model_getbasematerialbyid(model, group, &material), 0);
            EXPECT_EQ(lib3mf_basematerial_getdisplaycolor(material, index, &r, &g, &b, &a), 0);
            read.colour = {r, g, b, a};
            lib3mf_release(material);
        }
        lib3mf_release(property);
        lib3mf_release(object);
        objects.push_back(std::move(read));
    }
    lib3mf_release(items);
    lib3mf_release(reader);
    lib3mf_release(model);
    return objects;
}

template <class A, class B>
bool same_bits(const A& a, const B& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof a[0]) == 0;
}

TEST(Write3mf, ReadsBackInLib3mfWithTheSameBits) {
    const TemporaryFolder folder;
    const Two two;
    write_meshes(two.objects, folder / "two.3mf");
    const auto objects = read_3mf(folder / "two.3mf");
    ASSERT_EQ(objects.size(), 2u);
    EXPECT_EQ(objects[0].name, two.first_name);
    EXPECT_EQ(objects[1].name, two.second_name);
    EXPECT_EQ(objects[0].colour, (std::array{255, 128, 0, 255}));
    EXPECT_EQ(objects[1].colour, (std::array{0, 51, 255, 255}));
    EXPECT_TRUE(same_bits(objects[0].points, two.first.points));
    EXPECT_TRUE(same_bits(objects[1].points, two.second.points));
    EXPECT_TRUE(same_bits(objects[0].triangles, two.first.triangles));
    EXPECT_TRUE(same_bits(objects[1].triangles, two.second.triangles));
}

TEST(Write3mf, ASurfaceWithoutNameAndColour) {
    const TemporaryFolder folder;
    const Mesh mesh = ball(4, 0);
    write_mesh(mesh, folder / "a.3mf", {.space = Space::RAS});
    const auto objects = read_3mf(folder / "a.3mf");
    ASSERT_EQ(objects.size(), 1u);
    EXPECT_EQ(objects[0].name, "");
    ASSERT_EQ(objects[0].points.size(), mesh.points.size());
    EXPECT_EQ(objects[0].points[5], (Vec3f{-mesh.points[5][0], -mesh.points[5][1], mesh.points[5][2]}));
}

TEST(Write3mf, LeavesOutTrianglesWithTwoEqualCorners) {
    const TemporaryFolder folder;
    const Mesh mesh = ball(4, 0);
    Mesh with_lines = mesh;
    with_lines.triangles.insert(with_lines.triangles.begin(), {0, 0, 2});
    for (const Triangle& line : {Triangle{1, 2, 2}, {3, 4, 3}, {5, 5, 5}})
        with_lines.triangles.push_back(line);
    write_mesh(with_lines, folder / "a.3mf");
    const auto objects = read_3mf(folder / "a.3mf");
    ASSERT_EQ(objects.size(), 1u);
    EXPECT_TRUE(same_bits(objects[0].points, mesh.points));
    EXPECT_TRUE(same_bits(objects[0].triangles, mesh.triangles));
}

// As .glb does, whose schema wants a triangle too.
TEST(Write3mf, RefusesASurfaceWithoutTriangles) {
    const TemporaryFolder folder;
    const Mesh mesh = ball(4, 0);
    Mesh line = mesh;
    line.triangles = {{0, 1, 1}};
    for (const Mesh& bad : {Mesh{}, Mesh{mesh.points, {}, {}}, line}) {
        EXPECT_THROW(write_meshes(std::array{MeshObject{mesh}, MeshObject{bad}}, folder / "a.3mf"),
                     InputError);
    }
    EXPECT_TRUE(folder.files().empty());
}

TEST(Write3mf, RefusesMoreThanItsSchemaAllows) {
    const Vec3f point{};
    const Triangle triangle{0, 1, 2};
    // Their elements are not read before their number is checked.
    const std::span<const Vec3f> points(&point, std::size_t{1} << 31);
    const std::span<const Triangle> triangles(&triangle, std::size_t{1} << 31);
    internal::io::MeshOutput nowhere([](const void*, std::size_t) {}, {});
    for (const MeshView& mesh : {MeshView(points, {&triangle, 1}), MeshView({&point, 1}, triangles)})
        EXPECT_THROW(internal::io::write_3mf_model(nowhere, std::array{MeshObject{mesh}}), LimitError);
}

TEST(Write3mf, TheSameBytesEveryTime) {
    const TemporaryFolder folder;
    const Two two;
    write_meshes(two.objects, folder / "a.3mf");
    write_meshes(two.objects, folder / "b.3mf");
    EXPECT_TRUE(read_file(folder / "a.3mf") == read_file(folder / "b.3mf"));
}

TEST(WriteMeshes, InvalidNamesAreReplaced) {
    const TemporaryFolder folder;
    const Mesh mesh = ball(4, 0);
    const MeshObject odd{mesh,
                         "a\x01"
                         "b\xff"
                         "c\n"};
    for (const char* name : {"a.3mf", "a.glb", "a.obj", "a.vtp"})
        write_meshes(std::array{odd}, folder / name);
    EXPECT_EQ(read_3mf(folder / "a.3mf")[0].name,
              "a\xef\xbf\xbd"
              "b\xef\xbf\xbd"
              "c\xef\xbf\xbd");
    Assimp::Importer importer;
    const aiScene* scene = importer.ReadFile((folder / "a.glb").string(), 0);
    ASSERT_TRUE(scene) << importer.GetErrorString();
    EXPECT_STREQ(scene->mMeshes[0]->mName.C_Str(),
                 "a\xef\xbf\xbd"
                 "b\xef\xbf\xbd"
                 "c\xef\xbf\xbd");
}

// Converts to metres, y up, left at +x, front at +z.
Vec3f in_gltf(const Vec3f& v, double scale) {
    return {static_cast<float>(v[0] * scale), static_cast<float>(v[2] * scale),
            static_cast<float>(-v[1] * scale)};
}

TEST(WriteGlb, ReadsBackInAssimpInMetresWithYUp) {
    const TemporaryFolder folder;
    const Two two;
    write_meshes(two.objects, folder / "two.glb");
    Assimp::Importer importer;
    const aiScene* scene = importer.ReadFile((folder / "two.glb").string(), aiProcess_ValidateDataStructure);
    ASSERT_TRUE(scene) << importer.GetErrorString();
    ASSERT_EQ(scene->mNumMeshes, 2u);
    for (unsigned i = 0; i < 2; ++i) {
        const aiMesh& read = *scene->mMeshes[i];
        const MeshView& mesh = two.objects[i].mesh;
        EXPECT_EQ(read.mName.C_Str(), two.objects[i].name);
        ASSERT_EQ(read.mNumVertices, mesh.points.size());
        ASSERT_EQ(read.mNumFaces, mesh.triangles.size());
        ASSERT_TRUE(read.HasNormals());
        for (std::size_t p = 0; p < mesh.points.size(); ++p) {
            const Vec3f at = in_gltf(mesh.points[p], 1e-3), normal = in_gltf(mesh.normals[p], 1);
            for (unsigned a = 0; a < 3; ++a) {
                ASSERT_NEAR(read.mVertices[p][a], at[a], 1e-7 * std::abs(at[a]));
                ASSERT_EQ(read.mNormals[p][a], normal[a]);
            }
        }
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
            for (unsigned c = 0; c < 3; ++c) ASSERT_EQ(read.mFaces[t].mIndices[c], mesh.triangles[t][c]);
        }
        aiColor4D colour;
        ASSERT_EQ(scene->mMaterials[read.mMaterialIndex]->Get(AI_MATKEY_BASE_COLOR, colour),
                  aiReturn_SUCCESS);
        const auto srgb = [](double linear) {
            return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
        };
        for (unsigned a = 0; a < 3; ++a) EXPECT_NEAR(srgb(colour[a]), (*two.objects[i].colour)[a], 1e-5);
    }
}

TEST(WriteGlb, HasItsOwnAxes) {
    const TemporaryFolder folder;
    EXPECT_THROW(write_mesh(ball(4, 0), folder / "a.glb", {.space = Space::RAS}), InputError);
    EXPECT_TRUE(folder.files().empty());
}

TEST(WriteMeshes, AssimpFindsTheObjectsOf3mfAndObj) {
    const TemporaryFolder folder;
    const Two two;
    for (const char* name : {"two.3mf", "two.obj"}) {
        SCOPED_TRACE(name);
        write_meshes(two.objects, folder / name);
        Assimp::Importer importer;
        const aiScene* scene = importer.ReadFile((folder / name).string(), 0);
        ASSERT_TRUE(scene) << importer.GetErrorString();
        ASSERT_EQ(scene->mNumMeshes, 2u);
        for (unsigned i = 0; i < 2; ++i) {
            const MeshView& mesh = two.objects[i].mesh;
            const aiMesh& read = *scene->mMeshes[i];
            ASSERT_EQ(read.mNumFaces, mesh.triangles.size());
            for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
                for (unsigned c = 0; c < 3; ++c) {
                    const Vec3f& expected = mesh.points[mesh.triangles[t][c]];
                    const aiVector3D& p = read.mVertices[read.mFaces[t].mIndices[c]];
                    for (unsigned a = 0; a < 3; ++a)
                        ASSERT_NEAR(p[a], expected[a], 1e-5 * std::abs(expected[a]));
                }
            }
        }
    }
}

TEST(WriteMeshes, VtpKeepsSurfacesApart) {
    const TemporaryFolder folder;
    const Two two;
    write_meshes(two.objects, folder / "two.vtp");
    vtkNew<vtkXMLPolyDataReader> reader;
    reader->SetFileName((folder / "two.vtp").c_str());
    reader->Update();
    vtkPolyData* data = reader->GetOutput();
    const auto first = static_cast<vtkIdType>(two.first.triangles.size());
    ASSERT_EQ(data->GetNumberOfPolys(), first + static_cast<vtkIdType>(two.second.triangles.size()));
    vtkDataArray* surface = data->GetCellData()->GetArray("Surface");
    vtkDataArray* colours = data->GetCellData()->GetArray("Colors");
    auto* names = vtkStringArray::SafeDownCast(data->GetFieldData()->GetAbstractArray("Names"));
    ASSERT_TRUE(surface && colours && names);
    EXPECT_EQ(names->GetValue(0), two.first_name);
    EXPECT_EQ(names->GetValue(1), two.second_name);
    EXPECT_EQ(surface->GetTuple1(first - 1), 0);
    EXPECT_EQ(surface->GetTuple1(first), 1);
    EXPECT_EQ(colours->GetComponent(0, 1), 128);
    EXPECT_EQ(colours->GetComponent(first, 2), 255);
    vtkIdType n = 0;
    const vtkIdType* corners = nullptr;
    data->GetPolys()->GetCellAtId(first, n, corners);
    double p[3];
    data->GetPoint(corners[0], p);
    EXPECT_EQ(static_cast<float>(p[0]), two.second.points[two.second.triangles[0][0]][0]);
}

TEST(WriteMeshes, RefusesSeveralInAFormatForOne) {
    const TemporaryFolder folder;
    const Two two;
    EXPECT_THROW(write_meshes(two.objects, folder / "a.stl"), InputError);
    EXPECT_THROW(write_meshes(two.objects, folder / "a.ply.gz"), InputError);
    EXPECT_THROW(write_meshes({}, folder / "a.3mf"), InputError);
    EXPECT_THROW(write_mesh(two.first, folder / "a.3mf.gz"), InputError);
    EXPECT_TRUE(folder.files().empty());
}

TEST(WriteMeshes, GzippedFilesHoldTheSameBytes) {
    const TemporaryFolder folder;
    const Mesh mesh = ball(4, 0);
    for (const std::string ending : {".stl", ".ply", ".obj"}) {
        const std::string plain = folder / ("a" + ending), packed = plain + ".gz";
        write_mesh(mesh, plain);
        write_mesh(mesh, packed);
        const std::string expected = read_file(plain);
        std::string read(expected.size() + 1, '\0');
        gzFile file = gzopen(packed.c_str(), "rb");
        ASSERT_TRUE(file);
        EXPECT_EQ(gzread(file, read.data(), static_cast<unsigned>(read.size())),
                  static_cast<int>(expected.size()));
        EXPECT_EQ(gzclose(file), Z_OK);
        read.pop_back();
        EXPECT_TRUE(read == expected);
        EXPECT_LT(read_file(packed).size(), expected.size());
    }
}

TEST(Write3mf, BytesDoNotDependOnTheTimeZone) {
    const TemporaryFolder folder;
    const Mesh mesh = ball(4, 0);
    std::set<std::string> written;
    for (const char* zone : {"Pacific/Auckland", "America/Los_Angeles"}) {
        setenv("TZ", zone, 1);
        tzset();
        write_mesh(mesh, folder / "a.3mf");
        written.insert(read_file(folder / "a.3mf"));
    }
    unsetenv("TZ");
    tzset();
    EXPECT_EQ(written.size(), 1u);
}

TEST(WriteMeshes, ProgressRisesToOneThroughAllObjects) {
    const TemporaryFolder folder;
    const Two two;
    for (const char* name : {"a.3mf", "a.glb", "a.obj", "a.vtp"}) {
        double last = 0;
        write_meshes(two.objects, folder / name, {.progress = [&](double fraction) {
                         EXPECT_GE(fraction, last);
                         last = fraction;
                         return true;
                     }});
        EXPECT_NEAR(last, 1, 1e-12);
        EXPECT_THROW(write_meshes(two.objects, folder / name, {.progress = [](double f) { return f < 0.6; }}),
                     Cancelled);
    }
    EXPECT_EQ(folder.files().size(), 4u);
}

}  // namespace
}  // namespace marrow::test
