// The command line on the first device of Vulkan, which is a software device here.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "support/command_line.h"

namespace marrow::test {
namespace {

class OnDevice : public BallScan {
  protected:
    // Runs on the CPU and on the device. Expects the same files, and returns the outcome on the device.
    Outcome compare(const std::vector<std::string>& arguments) {
        const std::string cpu = folder / "cpu", device = folder / "device";
        const auto run = [&](const std::string& output, const std::string& choice) {
            std::filesystem::create_directory(output);
            std::vector<std::string> all{"-o", output + "/{name}.ply", "--device", choice};
            all.insert(all.end(), arguments.begin(), arguments.end());
            return marrow_with(all);
        };
        EXPECT_EQ(run(cpu, "cpu").code, 0);
        const Outcome outcome = run(device, "0");
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        std::size_t files = 0;
        for (const auto& entry : std::filesystem::directory_iterator(cpu)) {
            EXPECT_EQ(read_file(entry.path()), read_file(device / entry.path().filename()));
            ++files;
        }
        EXPECT_GT(files, 0u);
        return outcome;
    }

    // Writes the samples value(x) of another type.
    template <class T, class F>
    std::string write_slope(const char* type, const F& value) {
        std::string text = std::string("NRRD0005\ntype: ") + type +
                           "\ndimension: 3\nsizes: 6 5 4\nspace: left-posterior-superior\n"
                           "space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\n"
                           "endian: little\nencoding: raw\n\n";
        for (int i = 0; i < 6 * 5 * 4; ++i) {
            const T sample = value(i % 6);
            text.append(reinterpret_cast<const char*>(&sample), sizeof sample);
        }
        write_file(folder / "slope.nrrd", text);
        return folder / "slope.nrrd";
    }

    static nlohmann::json json(const Outcome& outcome) { return nlohmann::json::parse(outcome.out); }
};

TEST_F(OnDevice, WritesTheSameFiles) {
    const Outcome outcome = compare({scan, "--isovalue", "0", "--isovalue", "250.5"});
    EXPECT_NE(outcome.out.find("triangles at isovalue 250.5, on llvmpipe"), outcome.out.npos) << outcome.out;
    EXPECT_EQ(outcome.err, "");
    const Outcome with_steps = compare({scan, "--isovalue", "100", "--open", "--blur", "1", "--smooth", "5",
                                        "--keep", "0.5", "--crop", "vox:0,12,0,24,0,12", "--json"});
    EXPECT_TRUE(json(with_steps)["device"].get<std::string>().starts_with("llvmpipe"));
}

TEST_F(OnDevice, TheResultsSayThatTheCpuExtracts) {
    const Outcome outcome = marrow_with({scan, "-o", folder / "a.stl", "--isovalue", "0", "--json"});
    EXPECT_EQ(json(outcome)["device"], "cpu");
    const Outcome text = marrow_with({scan, "-o", folder / "a.stl", "--isovalue", "0"});
    EXPECT_EQ(text.out.find(", on "), text.out.npos);
}

TEST_F(OnDevice, TheCpuDoesWhatTheDeviceCannot) {
    const std::string integers = write_slope<std::int32_t>("int32", [](int x) { return x; });
    const Outcome of_integers = compare({integers, "--isovalue", "2.5", "--json"});
    EXPECT_EQ(json(of_integers)["device"], "cpu");
    EXPECT_NE(of_integers.err.find("warning: the CPU extracted instead of llvmpipe"), std::string::npos);
    EXPECT_NE(of_integers.err.find(": GPUs take no samples of type int32\n"), std::string::npos);
    EXPECT_EQ(json(of_integers)["warnings"].size(), 1u);

    const Outcome snapped = compare({scan, "--isovalue", "0", "--snap", "0.3"});
    EXPECT_NE(snapped.err.find(": GPUs neither snap points nor give exact topology\n"), std::string::npos)
        << snapped.err;
}

TEST_F(OnDevice, TheCpuTakesOverWhereTheDeviceFails) {
    // The differences are denormal numbers, which the device finds out during the extraction.
    const std::string tiny =
        write_slope<float>("float", [](int x) { return static_cast<float>(x) * 1e-40f; });
    const Outcome outcome = compare({tiny, "--isovalue", "2.5e-40", "--json"});
    EXPECT_EQ(json(outcome)["device"], "cpu");
    EXPECT_NE(outcome.err.find("warning: the CPU extracted instead of llvmpipe"), std::string::npos);
}

TEST_F(OnDevice, WallsThatAreTooThinAreRestoredByTheCpu) {
    // A box of bone in air, open on two sides, with a wall across it.
    const std::string frame = folder / "frame.nrrd";
    write_nrrd(frame, 40, 40, 24, [](int x, int y, int z) {
        const bool within = x > 6 && x < 33 && y > 6 && y < 33 && z > 6 && z < 17;
        const bool is_frame = within && !(x > 11 && x < 28 && y > 11 && y < 28);
        return is_frame ? 1200 : within && z == 12 ? -100 : -1000;
    });
    const auto surface = json(compare({frame, "--type", "bone", "--keep-thin", "--json"}));
    ASSERT_TRUE(surface["thin_walls"]["restored"].get<bool>());
    EXPECT_EQ(surface["device"], "cpu");
    EXPECT_TRUE(json(compare({frame, "--type", "bone", "--json"}))["device"].get<std::string>().starts_with(
        "llvmpipe"));
}

TEST_F(OnDevice, SoftwareDevicesAreUsedOnlyIfTheyAreNamed) {
    const auto extract_on = [&](const std::string& device) {
        return marrow_with({scan, "-o", folder / "a.stl", "--isovalue", "0", "--json", "--device", device});
    };
    EXPECT_EQ(json(extract_on("auto"))["device"], "cpu");
    EXPECT_EQ(extract_on("auto").err, "");
    EXPECT_TRUE(json(extract_on("LLVM"))["device"].get<std::string>().starts_with("llvmpipe"));

    const Outcome gpu = extract_on("gpu");
    EXPECT_EQ(gpu.code, 3);
    EXPECT_NE(gpu.err.find("marrow: there is no GPU: device 0 (llvmpipe"), std::string::npos) << gpu.err;
    EXPECT_EQ(json(gpu)["exit_code"], 3);
    const Outcome unknown = extract_on("voodoo");
    EXPECT_EQ(unknown.code, 3);
    EXPECT_NE(unknown.err.find("there is no device 'voodoo': there is 0 (llvmpipe"), std::string::npos);
}

TEST_F(OnDevice, TheDeviceIsForIsosurfacesInMemory) {
    for (const char* option : {"--labels", "--max-memory=1G"}) {
        const Outcome outcome = marrow_with({scan, "-o", folder / "a.stl", option, "--device", "0"});
        EXPECT_EQ(outcome.code, 2);
        EXPECT_NE(outcome.err.find("--device is for isosurfaces of a scan in memory"), std::string::npos)
            << outcome.err;
    }
}

TEST_F(OnDevice, TheListHasEachDevice) {
    const Outcome outcome = marrow_with({"devices"});
    EXPECT_EQ(outcome.code, 0);
    EXPECT_TRUE(outcome.out.starts_with("device  name ")) << outcome.out;
    EXPECT_NE(outcome.out.find("\n0       llvmpipe (LLVM "), std::string::npos);
    EXPECT_NE(outcome.out.find("  software  "), std::string::npos);
    EXPECT_TRUE(outcome.out.ends_with(
        "\n--device auto uses the CPU; a software device is used only if its number or name is given.\n"));

    const auto list = json(marrow_with({"devices", "--json"}));
    EXPECT_EQ(list["auto"], "cpu");
    EXPECT_TRUE(list["why_none"].is_null());
    ASSERT_EQ(list["devices"].size(), 1u);
    const auto& device = list["devices"][0];
    EXPECT_EQ(device["number"], 0);
    EXPECT_TRUE(device["name"].get<std::string>().starts_with("llvmpipe"));
    EXPECT_EQ(device["kind"], "software");
    EXPECT_TRUE(device["driver"].get<std::string>().starts_with("llvmpipe Mesa"));
    EXPECT_GT(device["memory_bytes"].get<std::uint64_t>(), std::uint64_t{1} << 28);
    EXPECT_TRUE(device["unusable"].is_null());
}

}  // namespace
}  // namespace marrow::test
