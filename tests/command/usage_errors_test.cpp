// Likely mistakes cause a warning, or an error that names the remedy.
#include <cstdlib>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "support/command_line.h"
#include "support/scan_files.h"

namespace marrow::test {
namespace {

class Mistake : public BallScan {};

TEST_F(Mistake, WarnsWhereNoSampleIsOutside) {
    const std::string whole = "the surface is the border of the scan";
    const auto warns = [&](const std::vector<std::string>& more) {
        std::vector<std::string> command{scan, "-o", folder / "box.ply"};
        command.insert(command.end(), more.begin(), more.end());
        return marrow_with(command).err.find(whole) != std::string::npos;
    };
    EXPECT_TRUE(warns({"--isovalue=-5000"}));
    EXPECT_FALSE(warns({"--type", "bone"}));
}

// At an integer isovalue the surface passes samples closely. Far from the origin, float32 cannot keep the
// points around them apart.
TEST_F(Mistake, WarnsOfPointsThatStlJoins) {
    write_nrrd(folder / "near.nrrd", 9, 9, 9,
               [](int x, int y, int z) { return std::abs(x - 4) + std::abs(y - 4) + std::abs(z - 4); });
    std::string text = read_file(folder / "near.nrrd");
    const std::string origin = "(10,20,30)";
    text.replace(text.find(origin), origin.size(), "(1e5,1e5,1e5)");
    write_file(folder / "far.nrrd", text);
    const auto warns = [&](const char* ramp, const char* file) {
        return marrow_with({folder / ramp, "-o", folder / file, "--isovalue", "6"})
                   .err.find("have the same coordinates") != std::string::npos;
    };
    EXPECT_TRUE(warns("far.nrrd", "a.stl"));
    EXPECT_FALSE(warns("far.nrrd", "a.ply"));
    EXPECT_FALSE(warns("near.nrrd", "a.stl"));
}

TEST_F(Mistake, NeverWritesOverTheScan) {
    const std::string before = read_file(scan);
    std::filesystem::copy_file(scan, folder / "scan.stl");
    std::filesystem::create_symlink(folder / "scan.stl", folder / "link.stl");
    for (const char* output : {"scan.stl", "link.stl"}) {
        const Outcome outcome = marrow_with({folder / "scan.stl", "-o", folder / output, "--type", "bone"});
        EXPECT_EQ(outcome.code, kUsage);
        EXPECT_NE(outcome.err.find("would overwrite the input"), outcome.err.npos) << outcome.err;
        EXPECT_EQ(read_file(folder / "scan.stl"), before);
    }
}

TEST_F(Mistake, NeverReplacesASliceByAPictureOrAScanByAPlot) {
    std::filesystem::create_directory(folder / "stack");
    for (const char* slice : {"0.png", "1.png"}) write_file(folder / "stack" / slice, "a slice");
    EXPECT_EQ(marrow_with({folder / "stack", "--spacing", "1,1,1", "--isovalue", "9", "--picture",
                           folder / "stack" / "1.png"})
                  .code,
              kUsage);
    EXPECT_EQ(read_file(folder / "stack" / "1.png"), "a slice");
    EXPECT_EQ(
        marrow_with({"info", folder / "stack", "--spacing", "1,1,1", "--picture", folder / "stack" / "1.png"})
            .code,
        kUsage);
    EXPECT_EQ(read_file(folder / "stack" / "1.png"), "a slice");
    // A slice may be a link, and what is in a folder below is no slice.
    std::filesystem::create_directory(folder / "store");
    write_file(folder / "store" / "2.png", "a slice");
    std::filesystem::create_symlink("../store/2.png", folder / "stack" / "2.png");
    std::filesystem::create_directory(folder / "stack" / "out");
    write_file(folder / "stack" / "out" / "plot.png", "an earlier plot");
    const auto plot = [&](const std::filesystem::path& file) {
        return marrow_with({"sweep", folder / "stack", "--spacing", "1,1,1", "--plot", file}).err;
    };
    EXPECT_NE(plot(folder / "stack" / "2.png").find("would overwrite the input"), std::string::npos);
    EXPECT_NE(plot(folder / "store" / "2.png").find("would overwrite the input"), std::string::npos);
    EXPECT_EQ(plot(folder / "stack" / "out" / "plot.png").find("would overwrite the input"),
              std::string::npos);
    EXPECT_EQ(read_file(folder / "store" / "2.png"), "a slice");
    std::filesystem::copy_file(scan, folder / "scan.svg");
    EXPECT_EQ(marrow_with({"sweep", folder / "scan.svg", "--plot", folder / "scan.svg"}).code, kUsage);
    EXPECT_EQ(read_file(folder / "scan.svg"), read_file(scan));
}

TEST_F(Mistake, MakesNoPictureASliceOfTheScan) {
    const std::string stack = folder / "stack";
    std::filesystem::create_directory(stack);
    for (const char* slice : {"/1.png", "/2.png", "/3.png"})
        write_file(stack + slice, png<std::uint8_t>(2, 2, {0, 0, 9, 99}));
    const auto refuses = [&](const std::string& command, const std::string& option,
                             const std::string& picture) {
        const Outcome outcome = marrow_with({command, stack, "--spacing", "1,1,1", option, picture});
        const bool refused = outcome.err.find("would become a slice") != std::string::npos;
        EXPECT_EQ(outcome.code, refused ? kUsage : 0) << outcome.err;
        EXPECT_EQ(std::filesystem::exists(picture), !refused);
        return refused;
    };
    EXPECT_TRUE(refuses("info", "--picture", stack + "/./4.png"));
    EXPECT_TRUE(refuses("sweep", "--plot", stack + "/4.png"));
    EXPECT_FALSE(refuses("info", "--picture", folder / "4.png"));
    EXPECT_FALSE(refuses("sweep", "--plot", stack + "/4.svg"));
}

TEST_F(Mistake, PrintsNoControlCharacterOfAName) {
    const std::string name = folder / "a\n\x1b[31mb";
    for (const std::vector<std::string>& command : {std::vector<std::string>{name},
                                                    {"check", name},
                                                    {scan, "-o", name + "/x.stl", "--isovalue", "0"}}) {
        const std::string err = marrow_with(command).err;
        EXPECT_NE(err.find("a\\x0a\\x1b[31mb"), err.npos) << err;
        EXPECT_EQ(std::count(err.begin(), err.end(), '\n'), 1) << err;
    }
    const Outcome written = marrow_with({scan, "-o", name + ".stl", "--isovalue", "0"});
    ASSERT_EQ(written.code, 0) << written.err;
    EXPECT_NE(written.out.find("a\\x0a\\x1b[31mb.stl: "), written.out.npos) << written.out;
}

TEST_F(Mistake, SaysThatAFileIsNoFolder) {
    const Outcome outcome = marrow_with({scan, "-o", scan + "/x.stl", "--isovalue", "0"});
    EXPECT_EQ(outcome.code, 3);
    EXPECT_NE(outcome.err.find("'" + scan + "' is not a folder"), outcome.err.npos) << outcome.err;
}

TEST_F(Mistake, GivesAnOpenSurfaceNoVolume) {
    const std::vector<std::string> command{scan,     "--isovalue", "0",        "-o", folder / "a.stl",
                                           "--keep", "0.5",        "--smooth", "5"};
    EXPECT_NE(marrow_with(command).out.find(", volume "), std::string::npos);
    std::vector<std::string> open = command;
    open.push_back("--open");
    const Outcome outcome = marrow_with(open);
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(outcome.out.find(", volume "), outcome.out.npos) << outcome.out;
}

TEST_F(Mistake, TakesNoFileThatBeginsWithAnEqualsSignByOversight) {
    const std::string file = folder / "x.stl";
    const Outcome outcome = marrow_with({scan, "--type", "bone", "-o=" + file});
    EXPECT_EQ(outcome.code, kUsage);
    EXPECT_NE(outcome.err.find("write '-o " + file + "'"), outcome.err.npos) << outcome.err;
    EXPECT_EQ(marrow_with({scan, "--type", "bone", "--output=" + file}).code, 0);
}

TEST_F(Mistake, NamesTheOneScanOfAFolder) {
    const Outcome outcome = marrow_with({folder.path().string(), "--type", "bone", "-o", folder / "x.stl"});
    EXPECT_EQ(outcome.code, kUnreadable);
    EXPECT_NE(outcome.err.find("open a NIfTI, NRRD or MetaImage file itself, such as '" + scan + "'"),
              outcome.err.npos)
        << outcome.err;
}

TEST_F(Mistake, ReportsAWordThatIsNeitherAFileNorACommand) {
    const Outcome outcome = marrow_with({"version"});
    EXPECT_EQ(outcome.code, kUnreadable);
    EXPECT_NE(outcome.err.find("no such file or folder, and no such command"), outcome.err.npos)
        << outcome.err;
    EXPECT_NE(marrow_with({"-", "--type", "bone"}).err.find("standard input"), std::string::npos);
}

TEST_F(Mistake, ChecksThePatternOfTheOutput) {
    for (const char* pattern : {"{nme}.stl", "{name}-{nme}.stl"}) {
        const Outcome outcome = marrow_with({scan, "--type", "bone", "-o", folder / pattern});
        EXPECT_EQ(outcome.code, kUsage) << pattern;
        EXPECT_NE(outcome.err.find("the only one is {name}"), outcome.err.npos) << outcome.err;
    }
    std::filesystem::create_directory(folder / "bone");
    EXPECT_EQ(marrow_with({scan, "--type", "bone", "-o", folder / "{name}/{name}.stl"}).code, 0);
    EXPECT_TRUE(std::filesystem::exists(folder / "bone/bone.stl"));
    for (const char* file : {"a.obj", "a.stl.gz", "a.STL.GZ"}) {
        const Outcome memory =
            marrow_with({scan, "--isovalue", "5", "--max-memory", "1G", "-o", folder / file});
        EXPECT_EQ(memory.code, kUsage) << file;
        EXPECT_NE(memory.err.find("--max-memory writes .stl or .ply"), memory.err.npos) << memory.err;
    }
}

TEST_F(Mistake, TakesLettersTogetherOfWhichTheLastHasAValue) {
    EXPECT_EQ(marrow_with({scan, "--type", "bone", "-qo", folder / "a=.stl"}).code, 0);
    EXPECT_EQ(marrow_with({scan, "--type", "bone", "-qo" + (folder / "b.stl").string()}).code, 0);
    EXPECT_TRUE(std::filesystem::exists(folder / "a=.stl") && std::filesystem::exists(folder / "b.stl"));
    EXPECT_EQ(marrow_with({scan, "--type", "bone", "-qx", folder / "c.stl"}).code, kUsage);
}

TEST_F(Mistake, NamesFilesAsTheyAre) {
    const std::string file = folder / "options.series.nrrd";
    std::filesystem::copy(scan, file);
    const Outcome outcome = marrow_with({file, "--isovalue", "0", "-o", folder / "a.stl", "--volume", "1"});
    EXPECT_NE(outcome.err.find("options.series.nrrd'"), outcome.err.npos) << outcome.err;
}

TEST_F(Mistake, SaysWhereTheScanIsIfTheBoxMissesIt) {
    const auto err = [&](const std::string& box) {
        const Outcome outcome = marrow_with({scan, "-o", folder / "a.stl", "--type", "bone", "--crop", box});
        EXPECT_EQ(outcome.code, kUsage);
        return outcome.err;
    };
    EXPECT_NE(err("1000,1100,0,1,0,1").find("it goes from 10 to 33, 20 to 44 and 30 to 54 mm in LPS"),
              std::string::npos);
    EXPECT_NE(err("vox:0,1000,0,1,0,1").find("whose samples are vox:0,23,0,24,0,12"), std::string::npos);
}

TEST_F(Mistake, NamesTheOptionThatDoesNotGoWithTheMode) {
    const std::vector<std::pair<std::vector<std::string>, std::string>> cases{
        {{"--labels", "--snap", "0.3"}, "--snap does not go with --labels"},
        {{"--labels", "--topology"}, "--topology does not go with --labels"},
        {{"--isovalue", "0", "--topology", "--snap", "0.3"}, "--topology does not go with --snap"},
        {{"--labels", "--keep-thin"}, "--keep-thin does not go with --labels"},
        {{"--isovalue", "0", "--keep-thin", "--no-alarm"}, "--keep-thin restores the walls that --no-alarm"},
        {{"--labels", "--type", "bone"}, "--type does not go with --labels"},
        {{"--labels", "--max-memory", "1G"}, "--max-memory does not go with --labels"},
        {{"--isovalue", "0", "--max-memory", "1G", "--blur", "1"}, "--blur does not go with --max-memory"},
        {{"--isovalue", "0", "--relax", "3"}, "--relax goes only with --labels"},
        {{"--isovalue", "otsu", "--max-memory", "1G"}, "--max-memory needs one --isovalue N"},
        {{"--type", "bone", "--max-memory", "1G"}, "such as --isovalue 225.5 for bone"},
        {{"--type", "bone", "--isovalue", "0", "--type", "bone"}, "the surface bone is given twice"},
        {{"--isovalue", "0", "--keep", "2"},
         "--keep takes a fraction above 0, at most 1, such as 0.5 for half, not '2'"},
        {{"--isovalue", "0", "--largest", "--components", "3"}, "--largest and --components both say"},
        {{"-o", "-"}, "-o is given twice"},
        {{}, "no surface is given: add --isovalue N, --isovalue otsu, or for CT --type bone"},
        {{"--isovalue", "0", "--threads", "x"}, "--threads takes a whole number, at least 0, not 'x'"},
        {{"--isovalue", "0", "--threads", "1", "--threads", "2"}, "--threads is given twice"},
    };
    for (const auto& [options, message] : cases) {
        std::vector<std::string> command{scan, "-o", folder / "a.stl"};
        command.insert(command.end(), options.begin(), options.end());
        const Outcome outcome = marrow_with(command);
        EXPECT_EQ(outcome.code, kUsage) << message;
        EXPECT_NE(outcome.err.find(message), outcome.err.npos) << outcome.err;
    }
}

// The first word that is wrong is reported, and what it was probably meant to be.
TEST_F(Mistake, SuggestsOptionsAndCommands) {
    const std::vector<std::pair<std::vector<std::string>, std::string>> cases{
        {{scan, "-o", "a.stl", "--isovlaue", "200"}, "no option --isovlaue: did you mean --isovalue?"},
        {{scan, "--smoth", "20", "-o", "a.stl"}, "no option --smoth: did you mean --smooth?"},
        {{scan, "-t", "bone"},
         "no option -t: did you mean --type, --topology, --trust, --triangles or --threads?"},
        {{scan, "--max-mem=1G"}, "no option --max-mem: did you mean --max-memory?"},
        {{scan, "--colour", "red"}, "no option --colour (see"},
        {{"inf", scan}, "no command 'inf': did you mean info?"},
        {{"swepe", scan, "-o", "a.csv"}, "no command 'swepe': did you mean sweep?"},
        {{"info", scan, "--isovalue", "3"}, "no option --isovalue (see marrow info --help)"},
        {{"check"}, "MESH is required (see marrow check --help)"},
        {{"help", "chekc"}, "no command 'chekc': did you mean check?"},
        {{"--json", "info", scan}, "'info' must come first"},
        {{scan, "--smooth", "-o", "a.stl"}, "--smooth needs a value, but -o follows"},
        {{scan, "-o"}, "-o needs a value"},
        {{scan, "--isovalue=", "-o", "a.stl"}, "--isovalue= needs a value"},
        {{scan, "other.nrrd", "-o", "a.stl"}, "several inputs"},
        {{"distance", scan, "-o", "a.stl"},
         "'distance': there is no such command, and no such file or folder"},
        {{"sweep"}, "no scan is given: name a file or folder (see marrow sweep --help)"},
        {{scan, "-o", "a.stl", "--isovalue", "0", "--open=maybe"},
         "--open takes no value (see marrow --help)"},
        {{"info", scan, "--json=true"}, "--json takes no value (see marrow info --help)"},
    };
    for (const auto& [command, message] : cases) {
        const Outcome outcome = marrow_with(command);
        EXPECT_EQ(outcome.code, kUsage) << message;
        EXPECT_NE(outcome.err.find(message), outcome.err.npos) << outcome.err;
    }
}

TEST_F(Mistake, NeverTakesAFileForAMistypedCommand) {
    std::filesystem::copy_file(scan, folder / "inf");
    const auto here = std::filesystem::current_path();
    std::filesystem::current_path(folder.path());
    const Outcome outcome = marrow_with({"inf", "-o", "a.stl", "--isovalue", "0"});
    std::filesystem::current_path(here);
    EXPECT_NE(outcome.code, kUsage) << outcome.err;
}

// CLI11 has meanings of its own for brackets, commas and the names of commands.
TEST_F(Mistake, TakesEveryNameOfAFileAsItIs) {
    const auto here = std::filesystem::current_path();
    std::filesystem::current_path(folder.path());
    const std::vector<std::string> names{"[ball.nrrd]", "[a,b]", "a,b", "sweep", "help"};
    for (const std::string& name : names) std::filesystem::copy_file("ball.nrrd", name);
    std::vector<std::string> all{"info", "--json"};
    all.insert(all.end(), names.begin(), names.end());
    const auto json = nlohmann::json::parse(marrow_with(all).out);
    ASSERT_EQ(json["inputs"].size(), names.size());
    for (std::size_t i = 0; i < names.size(); ++i) {
        EXPECT_EQ(json["inputs"][i]["input"], names[i]);
        EXPECT_EQ(json["inputs"][i]["series"][0]["description"], names[i]);
        const Outcome mesh = marrow_with({"-o", "a.stl", "--isovalue", "0", "--", names[i]});
        EXPECT_EQ(mesh.code, kOk) << mesh.err;
    }
    std::filesystem::current_path(here);
}

TEST_F(Mistake, SaysThatAMapOfLabelsNeedsLabels) {
    write_nrrd(folder / "map.nrrd", 20, 20, 20, [](int x, int y, int) { return x < 5 ? 0 : y < 10 ? 3 : 7; });
    for (const std::vector<std::string>& more : {std::vector<std::string>{}, {"--type", "bone"}}) {
        std::vector<std::string> command{folder / "map.nrrd", "-o", folder / "a.stl"};
        command.insert(command.end(), more.begin(), more.end());
        const Outcome outcome = marrow_with(command);
        EXPECT_EQ(outcome.code, kUsage);
        EXPECT_NE(outcome.err.find("looks like a label map"), outcome.err.npos) << outcome.err;
    }
}

// The name of the surface is that of the preset, however it is written.
TEST_F(Mistake, TypesMayBeWrittenInAnyCase) {
    EXPECT_EQ(marrow_with({scan, "-o", folder / "{name}.ply", "--type", "Bone", "-q"}).code, kOk);
    EXPECT_TRUE(std::filesystem::exists(folder / "bone.ply"));
}

TEST_F(Mistake, AMeshNeverGoesToStandardOutput) {
    const Outcome outcome = marrow_with({scan, "-o", "-", "--isovalue", "0"});
    EXPECT_EQ(outcome.code, kUsage);
    EXPECT_NE(outcome.err.find("cannot be written to standard output"), outcome.err.npos) << outcome.err;
    EXPECT_EQ(outcome.out, "");
}

TEST_F(Mistake, NamesArchives) {
    write_file(folder / "scans.tgz", "\x1f\x8b\x08");
    const Outcome outcome = marrow_with({folder / "scans.tgz", "-o", folder / "a.stl", "--isovalue", "0"});
    EXPECT_EQ(outcome.code, kUnreadable);
    EXPECT_NE(outcome.err.find("is an archive; unpack it first"), outcome.err.npos) << outcome.err;
}

TEST_F(Mistake, ANegativeNumberIsAValue) {
    EXPECT_EQ(marrow_with({scan, "-o", folder / "a.ply", "--isovalue", "-100"}).code, kOk);
    EXPECT_EQ(marrow_with({scan, "-o", folder / "a.ply", "--isovalue=-100"}).code, kOk);
}

TEST(Help, OfACommandIsTheSameBothWays) {
    for (const char* command : {"info", "check", "sweep"}) {
        const Outcome help = marrow_with({"help", command});
        EXPECT_EQ(help.code, kOk);
        EXPECT_EQ(help.out, marrow_with({command, "--help"}).out);
        EXPECT_NE(help.out.find("Usage: marrow "), help.out.npos);
    }
    EXPECT_EQ(marrow_with({"help"}).out, marrow_with({"--help"}).out);
}

TEST(Help, ComesBeforeMistakes) {
    EXPECT_EQ(marrow_with({"--isovlaue", "3", "--help"}).code, kOk);
}

// Scripts that read JSON from standard output find the reason there, wherever the fault is.
TEST_F(Mistake, IsAnObjectWithJson) {
    const std::vector<std::pair<std::vector<std::string>, int>> cases{
        {{scan, "--isovlaue", "3", "--json"}, kUsage},
        {{"missing.nrrd", "-o", folder / "a.stl", "--isovalue", "0", "--json"}, kUnreadable},
        {{scan, "-o", folder / "a.stl", "--isovalue", "0", "--series", "1", "--json"}, kUsage},
        {{scan, "-o", folder / "a.stl", "--isovalue", "5000", "--json"}, kEmpty},
    };
    for (const auto& [command, code] : cases) {
        const Outcome outcome = marrow_with(command);
        EXPECT_EQ(outcome.code, code);
        const auto json = nlohmann::json::parse(outcome.out);
        EXPECT_EQ(json["exit_code"], code);
        EXPECT_EQ("marrow: " + json["error"].get<std::string>() + "\n", outcome.err);
    }
    EXPECT_EQ(marrow_with({scan, "--isovlaue", "3"}).out, "");
}

}  // namespace
}  // namespace marrow::test
