// `marrow check` on the command line.
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <marrow/isosurface.h>
#include <marrow/mesh_io.h>
#include <marrow/scan_io.h>

#include "support/command_line.h"

namespace marrow::test {
namespace {

using Json = nlohmann::json;

class CheckCommand : public BallScan {};

TEST_F(CheckCommand, ChecksMeshes) {
    const std::string stl = folder / "ball.stl";
    ASSERT_EQ(marrow_with({scan, "-o", stl, "--isovalue", "0.5", "--verify"}).code, 0);
    const Outcome text = marrow_with({"check", stl, "--strict"});
    EXPECT_EQ(text.code, 0) << text.out;
    EXPECT_EQ(text.out.find(stl + ": sound"), 0u) << text.out;
    const Json json = Json::parse(marrow_with({"check", stl, "--json", "--min-wall", "2"}).out);
    EXPECT_EQ(json["closed"], true);
    EXPECT_EQ(json["genus"], 0);
    EXPECT_EQ(json["space"], "LPS");
    EXPECT_EQ(json["thin_walls"]["triangles"], 0);
    EXPECT_EQ(marrow_with({"check", stl, "--strict", "--min-wall", "30"}).code, 6);

    std::string bytes = read_file(stl);  // one triangle less
    bytes[80] = static_cast<char>(bytes[80] - 1);
    if (bytes[80] == -1) bytes[81] = static_cast<char>(bytes[81] - 1);
    bytes.resize(bytes.size() - 50);
    write_file(stl, bytes);
    EXPECT_EQ(marrow_with({"check", stl}).code, 0);
    EXPECT_EQ(marrow_with({"check", stl, "--strict"}).code, 6);
    EXPECT_EQ(Json::parse(marrow_with({"check", stl, "--json"}).out)["boundary_edges"], 3);
    EXPECT_EQ(marrow_with({"check", folder / "missing.stl"}).code, 3);
    EXPECT_EQ(marrow_with({"check", scan}).code, 3);
}

TEST_F(CheckCommand, ChecksTheOtherMeshesIfOneCannotBeRead) {
    const std::string stl = folder / "ball.stl", bad = folder / "bad.stl", gone = folder / "gone.stl";
    ASSERT_EQ(marrow_with({scan, "-o", stl, "--isovalue", "0.5"}).code, 0);
    write_file(bad, "no mesh");
    const Outcome text = marrow_with({"check", stl, bad, gone, stl});
    EXPECT_EQ(text.code, 3);
    EXPECT_EQ(text.out.find(stl + ": sound"), 0u) << text.out;
    EXPECT_NE(text.out.rfind(stl + ": sound"), 0u) << "the second, too";
    EXPECT_NE(text.err.find("bad.stl"), text.err.npos);
    EXPECT_NE(text.err.find("gone.stl"), text.err.npos);
    EXPECT_EQ(std::count(text.err.begin(), text.err.end(), '\n'), 2) << text.err;
    const Outcome outcome = marrow_with({"check", bad, stl, "--json"});
    EXPECT_EQ(outcome.code, 3);
    const Json json = Json::parse(outcome.out), &meshes = json["meshes"];
    ASSERT_EQ(meshes.size(), 2u);
    EXPECT_EQ(json["exit_code"], 3);
    EXPECT_EQ(json["error"], meshes[0]["error"]);
    EXPECT_FALSE(Json::parse(marrow_with({"check", stl, stl, "--json"}).out).contains("error"));
    EXPECT_NE(meshes[0]["error"].get<std::string>().find("bad.stl"), std::string::npos);
    EXPECT_EQ(meshes[1]["sound"], true);
    EXPECT_EQ(marrow_with({"check", stl}, true).code, 130);
}

// Two overlapping balls are two sound objects, not one surface that passes through itself.
TEST_F(CheckCommand, ChecksTheObjectsOfAFileOneByOne) {
    const auto object = [&](const char* name, double cx, bool closed) {
        const std::string nrrd = folder / "object.nrrd";
        write_nrrd(nrrd, 34, 25, 13, ball(cx, 12, 6, 8));
        const Volume volume = read_scan(nrrd);
        NamedMesh named{name, extract_isosurface(volume, 0.5)};
        if (!closed) named.mesh.triangles.pop_back();
        return named;
    };
    const std::string both = folder / "both.3mf";
    const auto write = [&](const NamedMesh& a, const NamedMesh& b) {
        const MeshObject objects[] = {{a.mesh, a.name}, {b.mesh, b.name}};
        write_meshes(objects, both);
    };
    write(object("left", 12, true), object("right", 20, true));
    const Outcome text = marrow_with({"check", both, "--strict"});
    EXPECT_EQ(text.code, 0) << text.out;
    EXPECT_EQ(text.out.find(both + ": sound, 2 objects\n  left: sound; "), 0u) << text.out;
    EXPECT_NE(text.out.find("\n  left and right pass through each other at "), text.out.npos) << text.out;
    const Json json = Json::parse(marrow_with({"check", both, "--json", "--min-wall", "30"}).out);
    EXPECT_EQ(json["sound"], true);
    EXPECT_EQ(json["self_intersections"], 0);
    EXPECT_EQ(json["components"], 2);
    ASSERT_EQ(json["objects"].size(), 2u);
    EXPECT_EQ(json["objects"][1]["name"], "right");
    for (const char* sum : {"points", "triangles", "area_mm2", "volume_mm3"})
        EXPECT_EQ(json[sum], json["objects"][0][sum].get<double>() + json["objects"][1][sum].get<double>())
            << sum;
    EXPECT_EQ(json["thin_walls"]["triangles"], json["triangles"]);
    EXPECT_LT(json["bounds_mm"][0][0], json["objects"][1]["bounds_mm"][0][0]);
    EXPECT_EQ(json["bounds_mm"][1], json["objects"][1]["bounds_mm"][1]);
    ASSERT_EQ(json["crossings"].size(), 1u);
    EXPECT_EQ(json["crossings"][0]["objects"], (Json{0, 1}));
    EXPECT_GT(json["crossings"][0]["triangle_pairs"], 10);

    write_file(
        folder / "names.obj",
        "o \x1b[31mred\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\no \xff\nv 0 0 1\nv 1 0 1\nv 0 1 1\nf 4 5 6\n");
    const std::string names = marrow_with({"check", folder / "names.obj"}).out;
    EXPECT_NE(names.find("  \\x1b[31mred: "), names.npos) << names;
    EXPECT_EQ(names.find_first_of("\x1b\xff"), names.npos) << names;

    write(object("left", 12, true), object("", 20, false));
    const Outcome open = marrow_with({"check", both, "--strict"});
    EXPECT_EQ(open.code, 6);
    EXPECT_NE(open.out.find("  left: sound; "), open.out.npos) << open.out;
    EXPECT_NE(open.out.find("  object 2: NOT sound\n    closed               no: 3 open edges"),
              open.out.npos)
        << open.out;
}

TEST_F(CheckCommand, ReportsThinWallsWithoutCallingThemUnsound) {
    const std::string stl = folder / "ball.stl";
    ASSERT_EQ(marrow_with({scan, "-o", stl, "--isovalue", "0.5"}).code, 0);
    const Outcome thin = marrow_with({"check", stl, "--min-wall", "30"});
    EXPECT_EQ(thin.code, 0);
    EXPECT_EQ(thin.out.find(stl + ": sound, with walls below 30 mm\n"), 0u) << thin.out;
    const Outcome strict = marrow_with({"check", stl, "--min-wall", "30", "--strict", "--json"});
    EXPECT_EQ(strict.code, 6);
    const Json json = Json::parse(strict.out);
    EXPECT_EQ(json["sound"], true);
    EXPECT_EQ(json["exit_code"], 6);
    EXPECT_EQ(json["error"], "'" + stl + "' has walls thinner than 30 mm");
    EXPECT_EQ(strict.err, "marrow: '" + stl + "' has walls thinner than 30 mm\n");
    // A file that cannot be read decides the exit code.
    const Outcome missing =
        marrow_with({"check", stl, folder / "gone.stl", "--min-wall", "30", "--strict", "--json"});
    EXPECT_EQ(missing.code, 3);
    EXPECT_EQ(Json::parse(missing.out)["exit_code"], 3);
}

TEST_F(CheckCommand, GivesBoundsInTheSpaceOfTheFile) {
    const std::string file = folder / "ball.ply";
    const Outcome made = marrow_with({scan, "-o", file, "--isovalue", "0.5", "--space", "RAS", "--json"});
    ASSERT_EQ(made.code, 0) << made.err;
    const Json checked = Json::parse(marrow_with({"check", file, "--json"}).out);
    EXPECT_EQ(checked["space"], "RAS");
    EXPECT_EQ(checked["bounds_mm"], Json::parse(made.out)["bounds_mm"]);
}

TEST_F(CheckCommand, PrintsSmallNumbers) {
    const std::string tiny = folder / "tiny.obj";
    write_file(tiny,
               "v 0 0 0\nv 0.01 0 0\nv 0 0.01 0\nv 0 0 0.01\n"
               "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
    const std::string text = marrow_with({"check", tiny}).out;
    EXPECT_NE(text.find(" 0.0002366 mm2, 1.667e-07 mm3"), text.npos) << text;
}

TEST_F(CheckCommand, GivesOpenMeshesNoVolume) {
    const std::string open = folder / "open.obj", huge = folder / "huge.obj";
    write_file(open, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    const Outcome text = marrow_with({"check", open});
    EXPECT_NE(text.out.find("0.50 mm2, - (an open mesh has no volume)"), text.out.npos) << text.out;
    EXPECT_TRUE(Json::parse(marrow_with({"check", open, "--json"}).out)["volume_mm3"].is_null());
    write_file(huge, "v 0 0 0\nv 1e30 0 0\nv 0 1e30 0\nv 0 0 1e30\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
    const Outcome large = marrow_with({"check", huge});
    EXPECT_NE(large.out.find("2.36603e+60 mm2, 1.66667e+89 mm3"), large.out.npos) << large.out;
}

}  // namespace
}  // namespace marrow::test
