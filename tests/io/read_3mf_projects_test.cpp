// read_mesh: 3MF projects as slicers save them, with objects that are assembled from others in several models
// of an archive (production extension), and hostile ones.
#include <functional>
#include <map>

#include <gtest/gtest.h>

#include <marrow/atomic_file.h>
#include <marrow/error.h>
#include <marrow/measure.h>
#include <marrow/mesh_check.h>
#include <marrow/mesh_io.h>

#include "io/bytes/archive_writer.h"
#include "support/temporary_folder.h"

namespace marrow::test {
namespace {

namespace fs = std::filesystem;

using Files = std::map<std::string, std::string>;

constexpr char kRelations[] =
    "<?xml version=\"1.0\" encoding=\"UTF-8\"?><Relationships "
    "xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\">"
    "<Relationship Target=\"/Metadata/plate_1.png\" Id=\"rel-2\" "
    "Type=\"http://schemas.openxmlformats.org/package/2006/relationships/metadata/thumbnail\"/>"
    "<Relationship Target=\"/3D/3dmodel.model\" Id=\"rel-1\" "
    "Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>";

// A tetrahedron with three edges of 10 units along the axes, at the origin.
constexpr char kTetrahedron[] =
    "<mesh><vertices><vertex x=\"0\" y=\"0\" z=\"0\"/><vertex x=\"10\" y=\"0\" z=\"0\"/>"
    "<vertex x=\"0\" y=\"10\" z=\"0\"/><vertex x=\"0\" y=\"0\" z=\"10\"/></vertices><triangles>"
    "<triangle v1=\"0\" v2=\"2\" v3=\"1\"/><triangle v1=\"0\" v2=\"1\" v3=\"3\"/>"
    "<triangle v1=\"1\" v2=\"2\" v3=\"3\"/><triangle v1=\"0\" v2=\"3\" v3=\"2\"/></triangles></mesh>";

// A model with the attributes that Bambu Studio and OrcaSlicer write.
std::string model(const std::string& resources, const std::string& items,
                  const std::string& unit = "millimeter", const std::string& required = "p") {
    return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model unit=\"" + unit +
           "\" xml:lang=\"en-US\" xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\" "
           "xmlns:BambuStudio=\"http://schemas.bambulab.com/package/2021\" "
           "xmlns:p=\"http://schemas.microsoft.com/3dmanufacturing/production/2015/06\" "
           "requiredextensions=\"" +
           required + "\">\n<metadata name=\"Application\">BambuStudio-01.08.00.62</metadata>\n<resources>" +
           resources + "</resources>\n<build p:UUID=\"2c7c17d8-22b5-4d84-8835-1976022ea369\">" + items +
           "</build>\n</model>";
}

std::string object(int id, const std::string& content, const std::string& type = "model") {
    return "<object id=\"" + std::to_string(id) + "\" p:UUID=\"0000000" + std::to_string(id) +
           "-61cb-4c03-9d28-80fed5dfa1dc\" type=\"" + type + "\">" + content + "</object>";
}

std::string transform(const std::string& numbers) {
    return numbers.empty() ? "" : " transform=\"" + numbers + "\"";
}

std::string component(int id, const std::string& numbers = "", const std::string& path = "") {
    return "<component " + (path.empty() ? "" : "p:path=\"" + path + "\" ") + "objectid=\"" +
           std::to_string(id) + "\" p:UUID=\"00010000-b206-40ff-9872-83e8017abed1\"" + transform(numbers) +
           "/>";
}

std::string components(const std::string& all) {
    return "<components>" + all + "</components>";
}

std::string item(int id, const std::string& numbers = "", const std::string& more = "") {
    return "<item objectid=\"" + std::to_string(id) + "\"" + transform(numbers) + more + " printable=\"1\"/>";
}

constexpr char kPart[] = "/3D/Objects/object_1.model";

class Project : public testing::Test {
  protected:
    fs::path archive(const Files& files) {
        const fs::path path = folder / "project.3mf";
        AtomicFile file(path);
        internal::io::ArchiveWriter zip(file, internal::io::ArchiveWriter::Format::zip);
        for (const auto& [name, text] : files) {
            zip.begin(name);
            zip.write(text.data(), text.size());
        }
        zip.finish();
        file.commit();
        return path;
    }
    // A project with one root model and, unless it is empty, one more.
    fs::path project(const std::string& root, const std::string& part = "") {
        Files files{{"_rels/.rels", kRelations},
                    {"3D/3dmodel.model", root},
                    {"Metadata/plate_1.png", "not a picture"},
                    {"Metadata/model_settings.config", "<config/>"}};
        if (!part.empty()) files["3D/Objects/object_1.model"] = part;
        return archive(files);
    }
    static std::string refusal(const fs::path& path) {
        try {
            read_mesh(path);
        } catch (const InputError& error) {
            return error.what();
        } catch (const LimitError& error) {
            return std::string("limit: ") + error.what();
        }
        return {};
    }
    static void expect_refused(const fs::path& path, const std::string& why) {
        const std::string said = refusal(path);
        EXPECT_NE(said.find(why), said.npos) << "'" << said << "' does not say '" << why << "'";
        EXPECT_EQ(said.find('\n'), said.npos);
    }
    const TemporaryFolder folder;
};

TEST_F(Project, OfSeveralModelsIsAssembled) {
    const fs::path path = project(
        model(object(2, components(component(1, "1 0 0 0 1 0 0 0 1 1 2 3", kPart) + component(3, "", kPart))),
              item(2, "1 0 0 0 1 0 0 0 1 128 128 0")),
        model(object(1, kTetrahedron) + object(3, kTetrahedron) + object(4, kTetrahedron), ""));
    Space space = Space::LPS;
    const Mesh mesh = read_mesh(path, &space);
    EXPECT_EQ(space, Space::none);
    ASSERT_EQ(mesh.points.size(), 8u) << "object 4 is not built";
    EXPECT_TRUE(mesh.points[0] == (Vec3f{129, 130, 3}));
    EXPECT_TRUE(mesh.points[5] == (Vec3f{138, 128, 0}));
    EXPECT_TRUE(mesh.triangles[4] == (Triangle{4, 6, 5}));
    EXPECT_NEAR(measure(mesh).volume, 2 * 1000 / 6.0, 1e-3);
}

TEST_F(Project, ModifiersAndSupportsAreNotPartsOfIt) {
    // As Bambu Studio 2.0 saves a part with a modifier, which is described in a file of its own.
    const std::string settings =
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?><config><object id=\"9\"><metadata key=\"name\" "
        "value=\"a\"/>"
        "<part id=\"1\" subtype=\"normal_part\"/><part id=\"2\" "
        "subtype=\"modifier_part\"/></object></config>";
    const auto used = [](int id) { return component(id, "1 0 0 0 1 0 0 0 1 0 0 0", kPart); };
    const fs::path path =
        archive({{"[Content_Types].xml", "<Types/>"},
                 {"_rels/.rels", kRelations},
                 {"3D/_rels/3dmodel.model.rels",
                  "<Relationships><Relationship Target=\"/3D/Objects/object_1.model\" Id=\"rel-1\" "
                  "Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>"},
                 {"3D/3dmodel.model", model(object(9, components(used(1) + used(2) + used(3) + used(4))),
                                            item(9, "1 0 0 0 1 0 0 0 1 5 0 0"))},
                 {"3D/Objects/object_1.model",
                  model(object(1, kTetrahedron) + object(2, kTetrahedron, "other") +
                            object(3, kTetrahedron, "support") + object(4, kTetrahedron, "solidsupport"),
                        "")},
                 {"Metadata/model_settings.config", settings},
                 {"Metadata/slice_info.config", "<config><header/></config>"},
                 {"Metadata/project_settings.config", "{}"}});
    const Mesh mesh = read_mesh(path);
    ASSERT_EQ(mesh.points.size(), 4u);
    EXPECT_TRUE(mesh.points[0] == (Vec3f{5, 0, 0}));
    EXPECT_EQ(read_meshes(path).size(), 1u);
}

// They may overlap, and would not be sound as one mesh.
TEST_F(Project, ComponentsAreMeshesOfTheirOwn) {
    const auto named = [](int id, const std::string& name) {
        std::string text = object(id, kTetrahedron);
        return text.insert(text.find(" type="), " name=\"" + name + "\"");
    };
    const std::string skull = object(3, components(component(1) + component(2, "1 0 0 0 1 0 0 0 1 5 0 0")));
    const auto meshes = read_meshes(project(model(named(1, "left") + named(2, "right") + skull, item(3))));
    ASSERT_EQ(meshes.size(), 2u);
    EXPECT_EQ(meshes[0].name, "left");
    EXPECT_EQ(meshes[1].name, "right");
    for (const NamedMesh& mesh : meshes) EXPECT_TRUE(check_mesh(mesh.mesh).is_sound());
}

TEST_F(Project, TransformsApplyFromTheInsideOut) {
    // The component moves by 5 along x; then the item turns x to y, doubles, and moves by 100 along x.
    const fs::path path = project(
        model(object(1, kTetrahedron) + object(2, components(component(1, "1 0 0 0 1 0 0 0 1 5 0 0"))),
              item(2, "0 2 0 -2 0 0 0 0 2 100 0 0")));
    const Mesh mesh = read_mesh(path);
    EXPECT_TRUE(mesh.points[0] == (Vec3f{100, 10, 0}));
    EXPECT_TRUE(mesh.points[1] == (Vec3f{100, 30, 0}));
    EXPECT_TRUE(mesh.points[2] == (Vec3f{80, 10, 0}));
    // Two mirrored levels face outward, and so does one.
    const std::string mirror = "-1 0 0 0 1 0 0 0 1 0 0 0";
    const std::string objects = object(1, kTetrahedron) + object(2, components(component(1, mirror)));
    EXPECT_NEAR(measure(read_mesh(project(model(objects, item(2))))).volume, 1000 / 6.0, 1e-3);
    EXPECT_NEAR(measure(read_mesh(project(model(objects, item(2, mirror))))).volume, 1000 / 6.0, 1e-3);
}

TEST_F(Project, EachModelHasItsUnit) {
    const fs::path path = project(model(object(2, components(component(1, "1 0 0 0 1 0 0 0 1 1 0 0", kPart))),
                                        item(2, "1 0 0 0 1 0 0 0 1 0 2 0"), "inch"),
                                  model(object(1, kTetrahedron), "", "centimeter"));
    const Mesh mesh = read_mesh(path);
    EXPECT_FLOAT_EQ(mesh.points[1][0], 100 + 25.4f)
        << "the mesh is in centimetres, and the moves are in inches";
    EXPECT_FLOAT_EQ(mesh.points[1][1], 50.8f);
}

TEST_F(Project, CopiesAreSeparate) {
    const std::string solid = object(1, kTetrahedron);
    const Mesh mesh = read_mesh(project(model(solid, item(1) + item(1, "1 0 0 0 1 0 0 0 1 50 0 0"))));
    ASSERT_EQ(mesh.points.size(), 8u);
    EXPECT_TRUE(mesh.points[4] == (Vec3f{50, 0, 0}));
    EXPECT_EQ(measure(mesh).components, 2);
}

TEST_F(Project, AnItemMayNameAnObjectOfAnotherModel) {
    const fs::path path = project(model("", item(1, "", std::string(" p:path=\"") + kPart + "\"")),
                                  model(object(1, kTetrahedron), ""));
    EXPECT_EQ(read_mesh(path).points.size(), 4u);
}

TEST_F(Project, PrefixesEntitiesAndEncodingsAreXmls) {
    // The core's namespace with a prefix, an element of the slice extension with a core name, CDATA, UTF-16.
    std::string text =
        "<c:model xmlns:c=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\" "
        "xmlns:s=\"urn:other\" "
        "c:unit=\"x\" unit=\"&#99;entimeter\"><c:metadata name=\"Description\"><![CDATA[SPACE=]]>&#82;AS"
        "</c:metadata><c:resources><c:object id=\"1\"><s:vertex x=\"no\"/><c:mesh><c:vertices><c:vertex "
        "x=\"1\" y=\"2\" z=\"3\"/><c:vertex x=\"2\" y=\"2\" z=\"3\"/><c:vertex x=\"1\" y=\"3\" "
        "z=\"3\"/></c:vertices>"
        "<c:triangles><c:triangle v1=\"0\" v2=\"1\" "
        "v3=\"2\"/></c:triangles></c:mesh></c:object></c:resources>"
        "<c:build><c:item objectid=\"1\"/></c:build></c:model>";
    Space space = Space::none;
    const Mesh mesh = read_mesh(project(text), &space);
    EXPECT_EQ(space, Space::RAS);
    ASSERT_EQ(mesh.points.size(), 3u);
    EXPECT_TRUE(mesh.points[0] == (Vec3f{-10, -20, 30}));
    std::string wide = "\xff\xfe";
    for (const char c : text) wide += {c, '\0'};
    EXPECT_TRUE(read_mesh(project(wide)).points == mesh.points);
}

// A fan of triangles. `vertex` and `triangle` write its elements, and `before` what comes between them.
std::string fan(int corners, const std::function<std::string(int)>& vertex,
                const std::function<std::string(int)>& triangle, const std::string& before = "\n   ") {
    std::string text = "<mesh><vertices>";
    for (int i = 0; i < corners; ++i) text += before + vertex(i);
    text += "</vertices><triangles>";
    for (int i = 1; i + 1 < corners; ++i) text += before + triangle(i);
    return text + "</triangles></mesh>";
}

TEST_F(Project, ElementsInAnyFormAreTheSameMesh) {
    constexpr int kCorners = 30'000;  // more than any piece of text holds
    const auto x = [](int i) { return std::to_string(i) + ".25"; };
    const auto n = [](int i) { return std::to_string(i); };
    const auto vertex = [&](int i) {
        return "<vertex x=\"" + x(i) + "\" y=\"-1e2\" z=\"" + n(i % 7) + "\"/>";
    };
    const auto triangle = [&](int i) {
        return "<triangle v1=\"0\" v2=\"" + n(i) + "\" v3=\"" + n(i + 1) + "\"/>";
    };
    const auto meshed = [&](const std::string& mesh) {
        return read_mesh(project(model(object(1, mesh), item(1))));
    };
    const Mesh plain = meshed(fan(kCorners, vertex, triangle));
    ASSERT_EQ(plain.points.size(), std::size_t{kCorners});
    ASSERT_EQ(plain.triangles.size(), std::size_t{kCorners - 2});
    EXPECT_TRUE(plain.points.back() == (Vec3f{kCorners - 1 + 0.25f, -100, (kCorners - 1) % 7}));
    EXPECT_TRUE(plain.triangles.back() == (Triangle{0, kCorners - 2, kCorners - 1}));

    const auto other_vertex = [&](int i) {  // every third one as usual
        if (i % 3 == 0) return vertex(i);
        if (i % 3 == 1) return "<vertex z='" + n(i % 7) + "' y='-100' x=' " + x(i) + "' />";
        return "<vertex x = \"" + x(i) + "\" y=\"-&#49;00\" z=\"" + n(i % 7) + "\"></vertex>";
    };
    const auto other_triangle = [&](int i) {
        if (i % 3 == 0) return triangle(i);
        if (i % 3 == 1)
            return "<triangle v1=\"0\" v2=\"" + n(i) + "\" v3=\"" + n(i + 1) + "\" paint_color=\"4\"/>";
        return "<triangle\nv1=\"0\" v2=\"" + n(i) + "\" v3=\"" + n(i + 1) + "\"   />";
    };
    const std::string hidden =
        "<!-- <vertex x=\"1\" y=\"2\" z=\"3\"/> <vertex x=\"1\" y=\"2\" z=\"3\"/>"
        "<triangle v1=\"0\" v2=\"0\" v3=\"0\"/> <triangle v1=\"0\" v2=\"0\" v3=\"0\"/> -->";
    for (const std::string& before : {std::string(), std::string("\r\n\t"), hidden}) {
        const Mesh other = meshed(fan(kCorners, other_vertex, other_triangle, before));
        EXPECT_TRUE(other.points == plain.points);
        EXPECT_TRUE(other.triangles == plain.triangles);
    }
    // Elements of another namespace are no vertices, also if only the namespace without a prefix changes.
    std::string foreign = fan(4, vertex, triangle);
    foreign.replace(foreign.find("<vertices>"), 10, "<vertices xmlns=\"urn:other\">");
    expect_refused(project(model(object(1, foreign), item(1))), "names point 0, which is missing");
    // Errors name the line, and the attribute.
    const auto broken = [&](int i) { return i == 4000 ? "<vertex x=\"1\" y=\"2\" z=\"3\">" : vertex(i); };
    expect_refused(project(model(object(1, fan(5000, broken, triangle)), item(1))), "invalid in line 5004");
    const auto bad = [&](int i) { return i == 4000 ? "<vertex x=\"1\" y=\"b\" z=\"3\"/>" : vertex(i); };
    expect_refused(project(model(object(1, fan(5000, bad, triangle)), item(1))),
                   "the attribute y of a vertex is not a number: 'b'");
}

TEST_F(Project, NeedsAllOfItsParts) {
    const std::string solid = object(1, kTetrahedron);
    const auto root = [](const std::string& used) { return model(object(2, components(used)), item(2)); };
    expect_refused(project(root(component(1, "", kPart))), "has no file '3d/objects/object_1.model'");
    expect_refused(project(root(component(7, "", kPart)), model(solid, "")),
                   "builds object '7', which is missing");
    expect_refused(project(root(component(1)), model(solid, "")), "builds object '1', which is missing");
    expect_refused(project(root(component(1, "", kPart)), "<model><resources>"),
                   "object_1.model': its XML is cut off");
    expect_refused(project(root(component(1, "", kPart)), "<svg/>"), "object_1.model': is not a 3D model");
    expect_refused(project(root(component(5, "", kPart)),
                           model(object(5, components(component(1, "", kPart))) + solid, "")),
                   "which only the root model may");
    expect_refused(project(root(component(1, "1 0 0", kPart)), model(solid, "")),
                   "transform of a component does not have 12 numbers");
    expect_refused(project(model(solid, item(1), "millimeter", "p b")), "needs the 3MF extension 'b'");
    expect_refused(project(model(solid, "")), "has no build items");
}

TEST_F(Project, ThatIsAPartOfItselfIsRefused) {
    expect_refused(project(model(object(1, components(component(1))), item(1))), "is a part of itself");
    expect_refused(
        project(model(object(1, components(component(2))) + object(2, components(component(1))), item(1))),
        "is a part of itself");
    expect_refused(project(model(object(2, components(component(1, "", kPart))), item(2)),
                           model(object(1, components(component(1))), "")),
                   "is a part of itself");
    std::string chain = object(1, kTetrahedron);
    for (int id = 2; id < 300; ++id) chain += object(id, components(component(id - 1)));
    EXPECT_EQ(refusal(project(model(chain, item(90)))), "");
    expect_refused(project(model(chain, item(299))), "nested too deeply");
}

TEST_F(Project, OfEndlessCopiesIsRefused) {
    // 2^60 copies of a tetrahedron, or of nothing, in a few kilobytes.
    for (const std::string& seed : {std::string(kTetrahedron), std::string()}) {
        std::string doubling = object(1, seed);
        for (int id = 2; id < 62; ++id)
            doubling += object(id, components(component(id - 1) + component(id - 1)));
        expect_refused(project(model(doubling, item(61))), "limit: '");
    }
    // More components than memory should hold.
    std::string nothing = "<components>";
    for (int i = 0; i < 100'001; ++i) nothing += "<component objectid=\"1\"/>";
    expect_refused(project(model(object(1, nothing + "</components>"), item(1))),
                   "has more than 100000 objects");
    // Many copies of a mesh that is not small.
    std::string points = "<mesh><vertices>";
    for (int i = 0; i < 20'000; ++i) points += "<vertex x=\"0\" y=\"0\" z=\"0\"/>";
    std::string copies;
    for (int i = 0; i < 6000; ++i) copies += component(1);
    expect_refused(
        project(model(object(1, points + "</vertices></mesh>") + object(2, components(copies)), item(2))),
        "limit: '");
}

TEST_F(Project, OfHostileXmlIsRefused) {
    const std::string solid = model(object(1, kTetrahedron), item(1));
    const std::string after_head = solid.substr(solid.find('\n'));
    // Entities that double: of 100 bytes come 2^40. Documents of 3MF have no document type.
    std::string entities = "<!DOCTYPE model [<!ENTITY a0 \"aaaaaaaaaa\">";
    for (int i = 1; i < 40; ++i) {
        const std::string before = "&a" + std::to_string(i - 1) + ";";
        entities += "<!ENTITY a" + std::to_string(i) + " \"" + before + before + "\">";
    }
    expect_refused(project("<?xml version=\"1.0\"?>" + entities + "]><model unit=\"&a39;\"/>"),
                   "document type");
    expect_refused(project("<!DOCTYPE model SYSTEM \"file:///etc/passwd\">" + after_head), "document type");
    const auto repeated = [](const char* text, int times) {
        std::string all;
        for (int i = 0; i < times; ++i) all += text;
        return all;
    };
    expect_refused(project("<model>" + repeated("<a>", 1'000'000)), "nested too deeply");
    expect_refused(project("<model unit=\"" + std::string(30'000'000, ' ') + "\"/>"),
                   "tag or comment of more");
    expect_refused(project("<model><!--" + std::string(30'000'000, '-')), "its XML is");
    expect_refused(project("<model>" + repeated("\xff", 10)), "its XML is invalid in line 1");
    expect_refused(project("<model></build>"), "its XML is invalid in line 1: mismatched tag");
    expect_refused(project("<model/><model/>"), "its XML is invalid");
    expect_refused(project("<model a=\"1\" a=\"2\"/>"), "duplicate attribute");
    expect_refused(project(""), "its XML is cut off");
}

TEST_F(Project, ThatExpandsEndlesslyIsRefused) {
    // 100 MB of spaces in 100 kB.
    expect_refused(project("<model>" + std::string(100'000'000, ' ') + "</model>"),
                   "expands to more than 100 times the size of the archive");
}

}  // namespace
}  // namespace marrow::test
