// read_mesh: 3MF and GLB, as Marrow and others write them, damaged, and with unsupported features.
#include <cmath>
#include <cstring>
#include <functional>
#include <map>

#include <gtest/gtest.h>

#include <Model/COM/NMR_DLLInterfaces.h>
#include <assimp/scene.h>
#include <assimp/Exporter.hpp>

#include <marrow/error.h>
#include <marrow/isosurface.h>
#include <marrow/measure.h>
#include <marrow/mesh_io.h>

#include "io/bytes/archive_writer.h"
#include "support/fields.h"
#include "support/mesh_checks.h"
#include "support/temporary_folder.h"

namespace marrow::test {
namespace {

namespace fs = std::filesystem;

Mesh ball(double x) {
    Geometry g = grid(13, 14, 12);
    g.origin = {x, -40, 100};
    const Volume volume = sampled_in_space<float>(g, sphere({6.113 + x, -33.571, 106.297}, 4.137));
    return extract_isosurface(volume, 0);
}

constexpr char kRelations[] =
    "<Relationships><Relationship Id=\"m\" Target=\"/3D/3dmodel.model\" "
    "Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>";

void write_zip(const fs::path& path, const std::map<std::string, std::string>& files) {
    AtomicFile file(path);
    internal::io::ArchiveWriter zip(file, internal::io::ArchiveWriter::Format::zip);
    for (const auto& [name, text] : files) {
        zip.begin(name);
        zip.write(text.data(), text.size());
    }
    zip.finish();
    file.commit();
}

std::string object(const std::string& content, int id = 1) {
    return "<object id=\"" + std::to_string(id) + "\">" + content + "</object>";
}

std::string glb(std::string json, const std::string& buffer) {
    json.resize((json.size() + 3) / 4 * 4, ' ');
    const auto word = [](std::size_t value) {
        const auto small = static_cast<std::uint32_t>(value);
        std::string bytes(4, '\0');
        std::memcpy(bytes.data(), &small, 4);
        return bytes;
    };
    return "glTF" + word(2) + word(28 + json.size() + buffer.size()) + word(json.size()) + "JSON" + json +
           word(buffer.size()) + std::string("BIN\0", 4) + buffer;
}

class ReadObjects : public testing::Test {
  protected:
    // Writes a 3MF file with these resources and build items.
    fs::path model(const std::string& resources, const std::string& items = "<item objectid=\"1\"/>",
                   const std::string& attributes = "") {
        const fs::path path = folder / "model.3mf";
        write_zip(path,
                  {{"_rels/.rels", kRelations},
                   {"3D/3dmodel.model", "<?xml version=\"1.0\"?><model " + attributes + "><resources>" +
                                            resources + "</resources><build>" + items + "</build></model>"}});
        return path;
    }
    fs::path file(const std::string& name, const std::string& bytes) {
        write_file(folder / name, bytes);
        return folder / name;
    }
    // Why a file is refused; empty if it is read.
    static std::string refusal(const fs::path& path) {
        try {
            read_mesh(path);
        } catch (const InputError& error) {
            return error.what();
        }
        return {};
    }
    const TemporaryFolder folder;
    const Mesh first = ball(0), second = ball(50);
};

// Two triangles of a tetrahedron, with attributes in unusual order, a comment, and the text of another tag.
const std::string kTetrahedron =
    "<mesh><vertices><vertex y='0' z='0' x='0'/><!-- <vertex/> --><vertex x=\"1e1\" y=\"0\" z=\"0\" "
    "note=\">\"/>"
    "<vertex x=\"0\" y=\"10\" z=\"0\" /><vertex x=\"0\" y=\"0\" z=\"10\"></vertex></vertices><triangles>"
    "<triangle v1=\"0\" v2=\"2\" v3=\"1\"/><triangle v1=\"0\" v2=\"1\" v3=\"3\"/>"
    "<triangle v1=\"1\" v2=\"2\" v3=\"3\"/><triangle v1=\"0\" v2=\"3\" v3=\"2\"/></triangles></mesh>";

TEST_F(ReadObjects, SurfacesOf3mfKeepTheirBitsAndOrder) {
    for (const Space space : {Space::LPS, Space::RAS}) {
        write_meshes(std::array{MeshObject{first, "a", {}}, MeshObject{second, "b", {}}}, folder / "a.3mf",
                     {.space = space});
        Space stated = Space::none;
        const Mesh read = read_mesh(folder / "a.3mf", &stated);
        EXPECT_EQ(stated, space);
        const std::size_t points = first.points.size(), triangles = first.triangles.size();
        ASSERT_EQ(read.points.size(), points + second.points.size());
        ASSERT_EQ(read.triangles.size(), triangles + second.triangles.size());
        EXPECT_TRUE(std::equal(first.points.begin(), first.points.end(), read.points.begin()));
        EXPECT_TRUE(std::equal(second.points.begin(), second.points.end(), read.points.begin() + points));
        EXPECT_TRUE(std::equal(first.triangles.begin(), first.triangles.end(), read.triangles.begin()));
        EXPECT_EQ(read.triangles[triangles][0], second.triangles[0][0] + points);
        EXPECT_EQ(manifold_fault(read), "");
    }
}

TEST_F(ReadObjects, SurfacesOfGlbComeBackInMillimetres) {
    write_meshes(std::array{MeshObject{first, "a", {}}, MeshObject{second, "b", {}}}, folder / "a.glb");
    Space stated = Space::none;
    const Mesh read = read_mesh(folder / "a.glb", &stated);
    EXPECT_EQ(stated, Space::LPS);
    ASSERT_EQ(read.points.size(), first.points.size() + second.points.size());
    for (std::size_t i = 0; i < read.points.size(); ++i) {
        const Vec3f& expected =
            i < first.points.size() ? first.points[i] : second.points[i - first.points.size()];
        for (std::size_t a = 0; a < 3; ++a)
            ASSERT_LE(std::abs(read.points[i][a] - expected[a]), std::abs(expected[a]) * 0x1p-23f);
    }
    EXPECT_EQ(manifold_fault(read), "");
    EXPECT_NEAR(measure(read).volume, measure(first).volume + measure(second).volume, 0.01);
}

TEST_F(ReadObjects, ItemsOf3mfAreMovedTurnedAndScaled) {
    const Mesh plain = read_mesh(model(object(kTetrahedron)));
    EXPECT_EQ(measure(plain).boundary_edges, 0);
    EXPECT_NEAR(measure(plain).volume, 1000 / 6.0, 1e-9);
    const Mesh inches = read_mesh(model(object(kTetrahedron), "<item objectid=\"1\"/>", "unit=\"inch\""));
    EXPECT_FLOAT_EQ(inches.points[1][0], 254);
    // Mirrored, scaled by two, and translated, in centimetres.
    const Mesh moved =
        read_mesh(model(object(kTetrahedron), "<item objectid=\"1\" transform=\"0 2 0 2 0 0 0 0 2 7 8 9\"/>",
                        "unit=\"centimeter\""));
    EXPECT_TRUE(moved.points[1] == (Vec3f{70, 280, 90}));
    EXPECT_NEAR(measure(moved).volume, 8e6 / 6, 1) << "it still faces outward";
    // Objects without a build item are ignored.
    EXPECT_EQ(read_mesh(model(object(kTetrahedron) + object(kTetrahedron, 2))).points.size(), 4u);
}

TEST_F(ReadObjects, ReadsWhatLib3mfWrites) {
    using namespace NMR;
    PLib3MFModel* model = nullptr;
    PLib3MFModelMeshObject* object = nullptr;
    PLib3MFModelBuildItem* item = nullptr;
    PLib3MFModelWriter* writer = nullptr;
    ASSERT_EQ(lib3mf_createmodel(&model), 0);
    ASSERT_EQ(lib3mf_model_setunit(model, MODELUNIT_CENTIMETER), 0);
    ASSERT_EQ(lib3mf_model_addmeshobject(model, &object), 0);
    std::vector<MODELMESHVERTEX> points(first.points.size());
    std::vector<MODELMESHTRIANGLE> triangles(first.triangles.size());
    std::memcpy(points.data(), first.points.data(), points.size() * sizeof points[0]);
    std::memcpy(triangles.data(), first.triangles.data(), triangles.size() * sizeof triangles[0]);
    ASSERT_EQ(lib3mf_meshobject_setgeometry(object, points.data(), static_cast<DWORD>(points.size()),
                                            triangles.data(), static_cast<DWORD>(triangles.size())),
              0);
    MODELTRANSFORM transform{{{1, 0, 0, 5}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
    ASSERT_EQ(lib3mf_model_addbuilditem(model, object, &transform, &item), 0);
    ASSERT_EQ(lib3mf_model_querywriter(model, "3mf", &writer), 0);
    ASSERT_EQ(lib3mf_writer_writetofileutf8(writer, (folder / "lib.3mf").c_str()), 0);
    Space stated = Space::RAS;
    const Mesh read = read_mesh(folder / "lib.3mf", &stated);
    EXPECT_EQ(stated, Space::none);
    EXPECT_TRUE(read.triangles == first.triangles);
    ASSERT_EQ(read.points.size(), first.points.size());
    EXPECT_NEAR(read.points[7][0], 10 * (first.points[7][0] + 5), 0.02) << "lib3mf writes few digits";
    EXPECT_NEAR(read.points[7][2], 10 * first.points[7][2], 0.02);
    for (auto* one : std::initializer_list<PLib3MFBase*>{writer, item, object, model}) lib3mf_release(one);
}

TEST_F(ReadObjects, ReadsWhatAssimpWrites) {
    aiScene scene;
    scene.mRootNode = new aiNode("surface");
    scene.mRootNode->mNumMeshes = 1;
    scene.mRootNode->mMeshes = new unsigned[1]{0};
    scene.mNumMeshes = scene.mNumMaterials = 1;
    scene.mMeshes = new aiMesh* [1] { new aiMesh };
    scene.mMaterials = new aiMaterial* [1] { new aiMaterial };
    aiMesh& mesh = *scene.mMeshes[0];
    mesh.mPrimitiveTypes = aiPrimitiveType_TRIANGLE;
    mesh.mNumVertices = static_cast<unsigned>(first.points.size());
    mesh.mVertices = new aiVector3D[mesh.mNumVertices];
    for (unsigned i = 0; i < mesh.mNumVertices; ++i)
        mesh.mVertices[i] = {first.points[i][0], first.points[i][1], first.points[i][2]};
    mesh.mNumFaces = static_cast<unsigned>(first.triangles.size());
    mesh.mFaces = new aiFace[mesh.mNumFaces];
    for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
        mesh.mFaces[i].mNumIndices = 3;
        mesh.mFaces[i].mIndices =
            new unsigned[3]{first.triangles[i][0], first.triangles[i][1], first.triangles[i][2]};
    }
    Assimp::Exporter exporter;
    ASSERT_EQ(exporter.Export(&scene, "glb2", (folder / "a.glb").string()), aiReturn_SUCCESS);
    const Mesh read = read_mesh(folder / "a.glb");
    EXPECT_TRUE(read.triangles == first.triangles) << "its indices are of 16 bits";
    ASSERT_EQ(read.points.size(), first.points.size());
    EXPECT_FLOAT_EQ(read.points[7][1], -1000 * first.points[7][2]);
}

TEST_F(ReadObjects, RefusesFilesThatAreCutOff) {
    for (const char* name : {"a.3mf", "a.glb"}) {
        write_mesh(first, folder / name);
        const std::string whole = read_file(folder / name);
        for (std::size_t size = 0; size < whole.size(); size += 1 + whole.size() / 97)
            EXPECT_NE(refusal(file(std::string("cut-") + name, whole.substr(0, size))), "") << name << size;
    }
}

TEST_F(ReadObjects, DamagedBytesNeverGiveAnInvalidMesh) {
    Random random(7);
    const auto damaged = [&](std::string bytes, std::size_t reach) {
        for (int i = 0; i < 3; ++i) bytes[random() % reach] = static_cast<char>(random());
        return bytes;
    };
    const auto read = [](const fs::path& path) {
        try {
            measure(read_mesh(path));  // throws if a triangle names a missing point
        } catch (const Error&) {
        }
    };
    write_mesh(first, folder / "a.glb");
    write_mesh(first, folder / "a.3mf");
    const std::string in_glb = read_file(folder / "a.glb"), archive = read_file(folder / "a.3mf");
    for (int trial = 0; trial < 400; ++trial) {
        read(file("b.glb", damaged(in_glb, trial % 2 ? 1000 : in_glb.size())));
        read(file("b.3mf", damaged(archive, archive.size())));
        read(file("c.3mf", archive.substr(0, archive.size() - 300) +
                               damaged(archive.substr(archive.size() - 300), 300)));
        read(model(damaged(object(kTetrahedron), object(kTetrahedron).size())));
    }
}

TEST_F(ReadObjects, RefusesNumbersThatDoNotFitTheirModel) {
    const auto with = [&](const std::string& from, const std::string& to) {
        std::string text = object(kTetrahedron);
        const std::size_t at = text.find(from);
        EXPECT_NE(at, text.npos) << from;
        return refusal(model(text.replace(at, from.size(), to)));
    };
    EXPECT_EQ(with("v3=\"1\"", "v3=\"3\""), "");
    EXPECT_NE(with("v3=\"1\"", "v3=\"4\"").find("names point 4, which is missing"), std::string::npos);
    EXPECT_NE(with("v3=\"1\"", "v3=\"-1\"").find("names point -1"), std::string::npos);
    EXPECT_NE(with("v3=\"1\"", "v3=\"18446744073709551617\"").find("v3 of a triangle is not a number"),
              std::string::npos);
    EXPECT_NE(with("v3=\"1\"", "").find("v3 of a triangle is not a number"), std::string::npos);
    EXPECT_NE(with("x=\"1e1\"", "x=\"inf\"").find("NaN or infinite"), std::string::npos);
    EXPECT_NE(with("x=\"1e1\"", "x=\"1e99\"").find("NaN or infinite"), std::string::npos);
    EXPECT_NE(with("x=\"1e1\"", "x=\"ten\"").find("x of a vertex is not a number: 'ten'"), std::string::npos);
    EXPECT_NE(with("<object id=\"1\">", "").find("outside objects"), std::string::npos);
}

TEST_F(ReadObjects, RefusesUnsupported3mfFeatures) {
    const auto says = [](const std::string& why, const std::string& part) {
        EXPECT_NE(why.find(part), why.npos) << "'" << why << "' does not say '" << part << "'";
    };
    const std::string solid = object(kTetrahedron), item = "<item objectid=\"1\"/>";
    says(refusal(model(solid, "")), "has no build items");
    says(refusal(model(solid, "<item objectid=\"5\"/>")), "builds object '5', which is missing");
    says(refusal(model(solid + solid)), "two objects '1'");
    says(refusal(model(solid, item, "unit=\"furlong\"")), "unknown unit 'furlong'");
    says(refusal(model(solid, item, "requiredextensions=\"p\"")),
         "needs the 3MF extension 'p', which is not supported");
    says(refusal(model(solid, "<item objectid=\"1\" transform=\"1 2 3\"/>")), "12 numbers");
    write_zip(folder / "a.3mf", {{"_rels/.rels", kRelations}});
    says(refusal(folder / "a.3mf"), "has no file '3d/3dmodel.model'");
    write_zip(folder / "a.3mf", {{"_rels/.rels", "<Relationships/>"}});
    says(refusal(folder / "a.3mf"), "names no 3D model");
    write_zip(folder / "a.3mf", {{"_rels/.rels", kRelations}, {"3D/3dmodel.model", "<model>" + solid}});
    says(refusal(folder / "a.3mf"), "cut off");
    says(refusal(file("a.3mf", "PK, but no archive at all")), "not a complete ZIP archive");
    const std::string archive = read_file(model(solid));
    const std::size_t in_file = archive.rfind("PK\3\4"), in_directory = archive.rfind("PK\1\2");
    // Changes a value of the last file, which stands in the file's header and in the directory.
    const auto with = [&](std::size_t at, const std::string& bytes, bool both = true) {
        std::string changed = archive;
        changed.replace(in_directory + at, bytes.size(), bytes);
        if (both) changed.replace(in_file + at - 2, bytes.size(), bytes);
        return refusal(file("b.3mf", changed));
    };
    says(with(8, "\1"), "is encrypted");
    says(with(10, "\x0c"), "is damaged or not supported");
    for (const std::size_t at : {16, 20, 24}) {  // checksum, compressed size, size
        says(with(at, "\xf0\xff\xff\x7f"), "is damaged");
        says(with(at, "\xf0\xff\xff\x7f", false), "is damaged");
    }
    says(with(42, "\xf0\xff\xff\xff", false), "is damaged");  // offset
}

class ReadGlb : public ReadObjects {
  protected:
    // Reads a tetrahedron whose description has `from` replaced.
    std::string with(const std::string& from, const std::string& to) {
        std::string json =
            "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":"
            "0}],"
            "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":1}]}],"
            "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"},"
            "{\"bufferView\":1,\"componentType\":5121,\"count\":12,\"type\":\"SCALAR\"}],"
            "\"bufferViews\":[{\"buffer\":0,\"byteLength\":64,\"byteStride\":16},"
            "{\"buffer\":0,\"byteOffset\":64,\"byteLength\":12}],\"buffers\":[{\"byteLength\":76}]}";
        const std::size_t at = json.find(from);
        EXPECT_NE(at, json.npos) << from;
        const float points[16] = {0, 0, 0, 9, .01f, 0, 0, 9, 0, .01f, 0, 9, 0, 0, .01f, 9};
        std::string buffer(76, '\0');
        std::memcpy(buffer.data(), points, 64);
        std::memcpy(buffer.data() + 64, "\0\2\1\0\1\3\1\2\3\0\3\2", 12);
        return refusal(file("a.glb", glb(json.replace(at, from.size(), to), buffer)));
    }
    void expect_refused(const std::string& from, const std::string& to, const std::string& why) {
        const std::string said = with(from, to);
        EXPECT_NE(said.find(why), said.npos) << "'" << said << "' does not say '" << why << "'";
    }
};

TEST_F(ReadGlb, ReadsInterleavedPointsAndBytes) {
    EXPECT_EQ(with("\"scene\":0,", ""), "");
    const Mesh read = read_mesh(folder / "a.glb");
    EXPECT_TRUE(read.points == (Buffer<Vec3f>{{0, 0, 0}, {10, 0, 0}, {0, 0, 10}, {0, -10, 0}}));
    EXPECT_EQ(manifold_fault(read), "");
    EXPECT_NEAR(measure(read).volume, 1000 / 6.0, 1e-4);
}

TEST_F(ReadGlb, RefusesNumbersThatDoNotFit) {
    const std::string beyond = "reaches beyond its buffer";
    expect_refused("\"count\":4", "\"count\":5", beyond);
    expect_refused("\"count\":4", "\"count\":4294967295", beyond);
    expect_refused("\"count\":4", "\"count\":3", "names point 3, which is missing");
    expect_refused("\"count\":4", "\"count\":-4", "lacks a number");
    expect_refused("\"count\":4", "\"count\":1e30", "lacks a number");
    expect_refused("\"count\":4,", "", "lacks a number");
    expect_refused("\"count\":12", "\"count\":11", "incomplete triangle");
    expect_refused("\"count\":12", "\"count\":0", "shows no triangles");
    expect_refused("\"byteLength\":64", "\"byteLength\":60,\"byteOffset\":17", beyond);
    expect_refused("\"byteOffset\":64", "\"byteOffset\":4294967295", beyond);
    expect_refused("\"byteStride\":16", "\"byteStride\":8", beyond);
    expect_refused("\"indices\":1", "\"indices\":2", "missing element of its accessors");
    expect_refused("\"indices\":1", "\"indices\":0", "of the wrong type");
    expect_refused("\"mesh\":0", "\"mesh\":1", "missing element of its meshes");
    expect_refused("\"nodes\":[0]", "\"nodes\":[7]", "missing element of its nodes");
    expect_refused("5121", "5120", "component type 5120");
    expect_refused("{\"asset\"", "[\"asset\"", "JSON is not valid");
}

TEST_F(ReadGlb, RefusesUnsupportedFeatures) {
    expect_refused("\"scene\":0", "\"extensionsRequired\":[\"KHR_draco_mesh_compression\"]",
                   "extension: 'KHR_draco_mesh_compression'");
    expect_refused("\"mesh\":0", "\"mesh\":0,\"translation\":[1,0,0]", "a node with a translation");
    expect_refused("\"mesh\":0", "\"children\":[1]", "nested nodes");
    expect_refused("\"indices\":1", "\"indices\":1,\"mode\":5", "strips");
    expect_refused(",\"indices\":1", "", "without indices");
    expect_refused("\"bufferView\":0", "\"sparse\":{},\"bufferView\":0", "sparse");
    expect_refused("\"buffers\":[{", "\"buffers\":[{\"uri\":\"../a.bin\",", "outside the file");
    // A small file that uses the same bytes many times.
    expect_refused("\"nodes\":[0]", "\"nodes\":[0,0,0]", "several times");
    EXPECT_NE(refusal(file("a.glb", "glTF")).find("is not a .glb file"), std::string::npos);
    for (const std::string& opened : {std::string(20'000'000, '['), [] {
                                          std::string nested;
                                          for (int i = 0; i < 100'000; ++i) nested += "{\"a\":[";
                                          return nested;
                                      }()})
        EXPECT_NE(refusal(file("a.glb", glb(opened, ""))).find("nested too deeply"), std::string::npos);
    EXPECT_NE(refusal(file("a.glb", glb("[1,2", ""))).find("JSON is not valid"), std::string::npos);
}

}  // namespace
}  // namespace marrow::test
