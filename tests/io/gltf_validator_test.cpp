// Khronos' validator finds nothing in the GLB files that are written. Skipped where it is not installed
// (scripts/install-gltf-validator).
#include <cstdlib>

#include <gtest/gtest.h>

#include <marrow/isosurface.h>
#include <marrow/mesh_io.h>

#include "support/fields.h"
#include "support/temporary_folder.h"

namespace marrow::test {
namespace {

Mesh ball() {
    const Volume volume = sampled_in_space<float>(grid(9, 10, 8), sphere({4, 4.5, 3.7}, 3));
    return extract_isosurface(volume, 0);
}

class GltfValidator : public testing::Test {
  protected:
    void SetUp() override {
        if (node("console.log('there')") != "there\n")
            GTEST_SKIP()
                << "gltf-validator is not installed (scripts/install-gltf-validator " MARROW_GLTF_VALIDATOR
                   ")";
    }

    // What a script prints in which `validator` is the module; empty if it fails.
    std::string node(const std::string& script) const {
        write_file(folder / "run.js", "const validator = require('" MARROW_GLTF_VALIDATOR
                                      "/node_modules/gltf-validator');\n" +
                                          script);
        const std::string command =
            "node '" + (folder / "run.js").string() + "' > '" + (folder / "said").string() + "' 2>&1";
        return std::system(command.c_str()) == 0 ? read_file(folder / "said") : std::string();
    }

    // The issues that the validator finds in a file, one a line; also hints.
    std::string issues(const std::string& name) const {
        return node(
            "validator.validateBytes(new Uint8Array(require('fs').readFileSync('" + (folder / name).string() +
            "'))).then(report => { for (const m of report.issues.messages) console.log(m.code, m.message, "
            "m.pointer); console.log('checked', report.info.totalTriangleCount); });");
    }

    const TemporaryFolder folder;
};

TEST_F(GltfValidator, FindsNothing) {
    const Mesh mesh = ball();
    const std::string checked =
        (testing::Message() << "checked " << mesh.triangles.size() << "\n").GetString();
    write_mesh(mesh, folder / "plain.glb");
    EXPECT_EQ(issues("plain.glb"), checked);
    MeshView flat = mesh;
    flat.normals = {};
    write_mesh(flat, folder / "flat.glb", {.space = Space::none});
    EXPECT_EQ(issues("flat.glb"), checked);
    const std::vector<Rgb8> colours(mesh.points.size(), Rgb8{10, 128, 255});
    MeshObject coloured{mesh};
    coloured.point_colours = colours;
    write_meshes(std::array{coloured}, folder / "coloured.glb");
    EXPECT_EQ(issues("coloured.glb"), checked);
    const std::array objects{MeshObject{mesh, "bone \"é\\\n\xff", {{1, 0.5, 0}}},
                             MeshObject{mesh, "skin", {}}, MeshObject{mesh, "", {{2, -1, 0.25}}}};
    write_meshes(objects, folder / "parts.glb");
    EXPECT_EQ(issues("parts.glb"),
              (testing::Message() << "checked " << 3 * mesh.triangles.size() << "\n").GetString());
}

TEST_F(GltfValidator, FindsAWrongBound) {
    const Mesh mesh = ball();
    write_mesh(mesh, folder / "a.glb");
    std::string bytes = read_file(folder / "a.glb");
    bytes[bytes.find("\"min\":[") + 7] = '9';
    write_file(folder / "a.glb", bytes);
    EXPECT_NE(issues("a.glb").find("ACCESSOR_MIN_MISMATCH"), std::string::npos) << issues("a.glb");
}

}  // namespace
}  // namespace marrow::test
