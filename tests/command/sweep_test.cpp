// `marrow sweep` on the command line, and files of several surfaces.
#include <cstdio>
#include <sstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "support/command_line.h"
#include "support/dicom_series.h"

namespace marrow::test {
namespace {

using Json = nlohmann::json;
using Names = std::set<std::string>;

class Sweep : public BallScan {};

TEST_F(Sweep, WritesATableAndAPlot) {
    const Outcome outcome = marrow_with({"sweep", scan, "--from", "-500", "--to", "500", "-n", "11", "-o",
                                         folder / "a.csv", "--plot", folder / "a.svg"});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    std::istringstream table(read_file(folder / "a.csv"));
    std::string line;
    std::getline(table, line);
    EXPECT_EQ(line, "isovalue,volume_mm3,area_mm2,components,triangles,shift_mm,plateau");
    double last_volume = 1e9;
    for (int i = 0; i < 11; ++i) {
        ASSERT_TRUE(std::getline(table, line));
        double isovalue = 0, volume = 0;
        ASSERT_EQ(std::sscanf(line.c_str(), "%lf,%lf", &isovalue, &volume), 2);
        EXPECT_EQ(isovalue, -500 + 100 * i);
        EXPECT_LT(volume, last_volume);
        last_volume = volume;
    }
    EXPECT_FALSE(std::getline(table, line));
    const std::string svg = read_file(folder / "a.svg");
    EXPECT_EQ(svg.find("<svg "), 0u);
    EXPECT_NE(svg.find("</svg>"), svg.npos);
}

// A sweep measures what an extraction with the same filters would enclose.
TEST_F(Sweep, FiltersTheScanAsExtractionDoes) {
    for (const std::vector<std::string>& filter :
         {std::vector<std::string>{"--crop", "vox:0,12,0,24,0,12"}, {"--median", "1"}, {"--blur", "2"}}) {
        std::vector<std::string> sweep{"sweep", scan, "--from", "0", "--to", "100", "-n", "2", "--json"};
        std::vector<std::string> extract{scan, "-o", folder / "a.ply", "--isovalue", "0", "--json"};
        sweep.insert(sweep.end(), filter.begin(), filter.end());
        extract.insert(extract.end(), filter.begin(), filter.end());
        const Json measured = Json::parse(marrow_with(sweep).out)["sweep"][0];
        const Json extracted = Json::parse(marrow_with(extract).out);
        EXPECT_EQ(measured["triangles"], extracted["triangles"]) << filter[0];
    }
}

TEST_F(Sweep, HasNoShiftForTheFirstIsovalue) {
    const std::vector<std::string> command{"sweep", scan, "--from", "0", "--to", "100", "-n", "2"};
    const std::string table = marrow_with(command).out, row = table.substr(table.find('\n') + 1);
    EXPECT_EQ(row.substr(0, row.find('\n')).substr(row.find('\n') - 2), ",,") << row;
    std::vector<std::string> as_json = command;
    as_json.push_back("--json");
    const Json json = Json::parse(marrow_with(as_json).out);
    EXPECT_TRUE(json["sweep"][0]["shift_mm"].is_null());
    EXPECT_GT(json["sweep"][1]["shift_mm"], 0);
}

TEST_F(Sweep, DrawsAPngToo) {
    ASSERT_EQ(marrow_with({"sweep", scan, "-n", "5", "--plot", folder / "a.png", "-q"}).code, 0);
    EXPECT_EQ(read_file(folder / "a.png").substr(1, 3), "PNG");
}

TEST_F(Sweep, LabelsAxesWithRoundNumbers) {
    ASSERT_EQ(marrow_with({"sweep", scan, "--from", "-523", "--to", "891", "-n", "9", "--plot",
                           folder / "a.svg", "-o", folder / "a.csv"})
                  .code,
              0);
    const std::string svg = read_file(folder / "a.svg");
    for (const char* tick : {">-500<", ">0<", ">500<"}) EXPECT_NE(svg.find(tick), svg.npos) << tick;
    for (std::size_t at = svg.find("\">"); at != svg.npos; at = svg.find("\">", at + 1)) {
        const std::string number = svg.substr(at + 2, svg.find('<', at) - at - 2);
        if (number.empty() || number.find_first_not_of("-0123456789.e+") != number.npos) continue;
        EXPECT_EQ(number.find('e'), number.npos) << number;
        std::string digits;  // one that counts, and zeros
        for (const char c : number) digits += c >= '1' && c <= '9' ? std::string(1, c) : "";
        EXPECT_LE(digits.size(), 2u) << number;
    }
}

TEST_F(Sweep, RefusesARangeWithoutASurface) {
    const Outcome above = marrow_with({"sweep", scan, "--from", "5000", "--to", "6000", "-o",
                                       folder / "a.csv", "--plot", folder / "a.svg"});
    EXPECT_EQ(above.code, kEmpty);
    EXPECT_NE(above.err.find("-1000 to 1000"), above.err.npos) << above.err;
    EXPECT_EQ(folder.files(), (Names{"ball.nrrd"}));
}

TEST(SweepOfFloats, WarnsOfNonFiniteSamples) {
    const TemporaryFolder folder;
    std::string text =
        "NRRD0005\ntype: float\ndimension: 3\nsizes: 4 4 4\nendian: little\nencoding: raw\n"
        "space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\nspace: "
        "left-posterior-superior\n\n";
    for (int i = 0; i < 64; ++i) {
        const float sample = i % 9 == 0 ? std::nanf("") : static_cast<float>(i % 7);
        text.append(reinterpret_cast<const char*>(&sample), sizeof sample);
    }
    write_file(folder / "nan.nrrd", text);
    const Outcome outcome = marrow_with({"sweep", folder / "nan.nrrd", "-n", "3"});
    EXPECT_EQ(outcome.code, 0);
    EXPECT_NE(outcome.err.find("8 samples are NaN"), outcome.err.npos) << outcome.err;
}

TEST_F(Sweep, AgreesWithTheExtractedSurface) {
    const Outcome outcome = marrow_with({"sweep", scan, "--from", "0", "--to", "100", "-n", "2", "--json"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const Json first = Json::parse(outcome.out)["sweep"][0];
    const Json alone =
        Json::parse(marrow_with({scan, "-o", folder / "a.stl", "--isovalue", "0", "--json"}).out);
    for (const char* name : {"isovalue", "components", "triangles"}) EXPECT_EQ(first[name], alone[name]);
    for (const char* name : {"volume_mm3", "area_mm2"})
        EXPECT_NEAR(first[name].get<double>(), alone[name].get<double>(), 1e-5 * alone[name].get<double>());
}

TEST_F(Sweep, CoversTheRangeOfAllSamplesByDefault) {
    const Outcome outcome = marrow_with({"sweep", scan, "-n", "3"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(outcome.out.find("\n-1000,"), outcome.out.find('\n'));
    EXPECT_NE(outcome.out.find("\n1000,"), outcome.out.npos);
}

TEST(SweepOfPadding, BeginsAndEndsAtOtherSamples) {
    const TemporaryFolder folder;
    write_series(folder, 3, "slice", [](DicomWriter& s, int k) {
        std::vector<std::int16_t> samples = slice_samples(k);
        samples.front() = 4095;
        s.pixels(columns, rows, samples);
        s.number(0x00280120, 4095);
    });
    const Outcome outcome = marrow_with({"sweep", folder.path(), "-n", "3", "--json"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const Json sweep = Json::parse(outcome.out)["sweep"];
    EXPECT_EQ(sweep[0]["isovalue"], 1);
    EXPECT_EQ(sweep[2]["isovalue"], 212);
}

TEST_F(Sweep, DrawsIsovaluesThatAreNeighbouringNumbers) {
    EXPECT_EQ(marrow_with({"sweep", scan, "--from", "1", "--to", "1.0000000000000004", "-n", "2", "--plot",
                           folder / "near.svg"})
                  .code,
              0);
    const Outcome outcome =
        marrow_with({"sweep", scan, "--from", "1", "--to", "1.0000000000000004", "-n", "50"});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(std::count(outcome.out.begin(), outcome.out.end(), '\n'), 1 + 3) << outcome.out;
}

TEST_F(Sweep, DrawsTheLargestNumbers) {
    const Outcome outcome = marrow_with(
        {"sweep", scan, "--from=-1.7e308", "--to=1.7e308", "-n", "5", "--plot", folder / "far.svg"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const std::string drawing = read_file(folder / "far.svg");
    EXPECT_EQ(drawing.find("nan"), drawing.npos);
    EXPECT_NE(drawing.find("points=\"80.0,"), drawing.npos);
    EXPECT_NE(drawing.find(" 720.0,"), drawing.npos);
}

TEST_F(Sweep, PrintsSmallNumbers) {
    std::string header = read_file(scan);
    const std::string wide = "(1,0,0) (0,1,0) (0,0,2)";
    header.replace(header.find(wide), wide.size(), "(0.001,0,0) (0,0.001,0) (0,0,0.002)");
    write_file(folder / "tiny.nrrd", header);
    const auto row = [&](const std::string& file) {
        std::istringstream lines(marrow_with({"sweep", file, "--from", "0", "--to", "500", "-n", "2"}).out);
        std::string line;
        std::getline(lines, line);
        std::getline(lines, line);
        double isovalue = 0, volume = 0, area = 0;
        EXPECT_EQ(std::sscanf(line.c_str(), "%lf,%lf,%lf", &isovalue, &volume, &area), 3) << line;
        return std::pair{volume, area};
    };
    const auto [volume, area] = row(scan);
    const auto [tiny_volume, tiny_area] = row(folder / "tiny.nrrd");
    EXPECT_NEAR(tiny_volume * 1e9, volume, volume / 1000);
    EXPECT_NEAR(tiny_area * 1e6, area, area / 1000);
}

TEST_F(Sweep, RefusesWhatMakesNoSense) {
    for (const std::vector<std::string>& more :
         std::vector<std::vector<std::string>>{{"--from", "5", "--to", "5"},
                                               {"--from", "x"},
                                               {"-n", "1"},
                                               {"-o", "a.txt"},
                                               {"--plot", "a.jpg"}}) {
        std::vector<std::string> command{"sweep", scan};
        command.insert(command.end(), more.begin(), more.end());
        EXPECT_EQ(marrow_with(command).code, kUsage) << more[0];
    }
    EXPECT_EQ(marrow_with({"sweep", scan}, true).code, kCancelled);
}

TEST_F(Sweep, SeveralSurfacesGoIntoOneFile) {
    const Outcome outcome =
        marrow_with({scan, "-o", folder / "two.glb", "--type", "bone", "--type", "skin", "--json"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(folder.files(), (Names{"ball.nrrd", "two.glb"}));
    const std::string file = read_file(folder / "two.glb");
    EXPECT_NE(file.find("\"name\":\"bone\""), file.npos);
    EXPECT_NE(file.find("\"name\":\"skin\""), file.npos);
    EXPECT_EQ(marrow_with({scan, "-o", folder / "two.stl", "--type", "bone", "--type", "skin"}).code, kUsage);
    EXPECT_EQ(marrow_with({scan, "-o", folder / "a.glb", "--type", "bone", "--space", "RAS"}).code, kUsage);
}

}  // namespace
}  // namespace marrow::test
