// `marrow info` on the command line.
#include <cmath>
#include <fstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "support/command_line.h"
#include "support/dicom_series.h"
#include "support/reading_checks.h"

namespace marrow::test {
namespace {

using Json = nlohmann::json;

Json info(std::vector<std::string> arguments, int code = 0) {
    arguments.insert(arguments.begin(), {"info", "--json"});
    const Outcome outcome = marrow_with(arguments);
    EXPECT_EQ(outcome.code, code) << outcome.err;
    return Json::parse(outcome.out);
}

TEST(Info, SaysWhatWouldBeReadAndWhy) {
    TemporaryFolder folder;
    write_series(folder, 4, "a");
    DicomWriter scout = slice(7, 0);
    scout.text(0x0020000e, "UI", "1.2.7");
    scout.text(0x00080008, "CS", "ORIGINAL\\PRIMARY\\LOCALIZER");
    scout.write(folder / "scout");
    const Json json = info({folder.path()});
    EXPECT_EQ(json["format"], "DICOM");
    EXPECT_EQ(json["files"], 5);
    EXPECT_TRUE(json["refused"].is_null());
    contains(json["reason"], "scout");
    ASSERT_EQ(json["series"].size(), 2u);
    const Json chosen = json["series"][json["chosen"].get<std::size_t>()];
    EXPECT_EQ(chosen["series"], "1.2.3");
    EXPECT_EQ(chosen["dims"], Json({3, 2, 4}));
    EXPECT_EQ(chosen["spacing_mm"], Json({1.0, 1.0, 2.0}));
    EXPECT_EQ(chosen["hounsfield_units"], true);
    EXPECT_EQ(chosen["smallest_feature_mm"], 4);
    EXPECT_EQ(chosen["memory_bytes"], 3 * 2 * 4 * 2);
    EXPECT_EQ(chosen["tilt_degrees"], 0);
    const std::string text = marrow_with({"info", folder.path()}).out;
    contains(text, "*  1  CT");
    contains(text, "1 x 1 x 2 mm");
}

// Series of one description differ in their number, echo, image type, orientation or kernel.
TEST(Info, TellsSeriesApart) {
    TemporaryFolder folder;
    const auto write = [&](const char* id, const char* number, const char* echo, const char* orientation) {
        write_series(folder, 3, id, [&](DicomWriter& s, int k) {
            s.text(0x0020000e, "UI", id);
            s.text(0x00200011, "IS", number);
            s.text(0x00180081, "DS", echo);
            s.text(0x00181210, "SH", "Br38");
            s.text(0x00200037, "DS", orientation);
            if (std::string(number) == "8") s.position(std::to_string(2 * k) + "\\0\\0");
        });
    };
    write("1.2.4.1", "7", "12.5", "1\\0\\0\\0\\1\\0");
    write("1.2.5.2", "8", "25", "0\\1\\0\\0\\0\\-1");
    const Json json = info({folder.path()});
    const Json &first = json["series"][0], &second = json["series"][1];
    EXPECT_EQ(first["series_number"], 7);
    EXPECT_EQ(first["echo_time_ms"], 12.5);
    EXPECT_EQ(first["kernel"], "Br38");
    EXPECT_EQ(first["plane"], "axial");
    EXPECT_EQ(second["plane"], "sagittal");
    const std::string text = marrow_with({"info", folder.path()}).out;
    contains(text, "2 of 2 series can be read: choose one with --series");
    contains(text, "series 8, 3 x 2 x 3, 1 x 1 x 2 mm, sagittal, echo time 25 ms, kernel Br38");

    // Any of these names the second.
    for (const char* name : {"2", "1.2.5", "1.2.5.2"})
        EXPECT_EQ(info({folder.path(), "--series", name})["chosen"], 1) << name;
    EXPECT_TRUE(info({folder.path(), "--series", "1.2"})["chosen"].is_null());
    EXPECT_EQ(marrow_with({"info", folder.path(), "--series", "3"}).code, kUsage);
}

TEST(Info, SaysWhatIsovalueAndCropNeed) {
    TemporaryFolder folder;
    write_nrrd(folder / "ball.nrrd", 24, 25, 13, ball(12, 12, 6, 8));
    const Json json = info({folder / "ball.nrrd"});
    EXPECT_EQ(json["values"]["type"], "int16");
    EXPECT_EQ(json["values"]["lower"], -1000);
    EXPECT_EQ(json["values"]["upper"], 1000);
    EXPECT_EQ(json["values"]["may_be_hounsfield_units"], true);
    EXPECT_EQ(json["values"]["labels"], Json::array());
    EXPECT_EQ(json["series"][0]["origin_mm"], Json({10.0, 20.0, 30.0}));
    EXPECT_EQ(json["series"][0]["bounds_mm"], Json({{10.0, 20.0, 30.0}, {33.0, 44.0, 54.0}}));
    const std::string text = marrow_with({"info", folder / "ball.nrrd"}).out;
    contains(text, "int16 from -1000 to 1000, probably Hounsfield units");
    // The bounds are an argument of --crop that keeps all.
    contains(text, "10,33,20,44,30,54 mm");
    EXPECT_TRUE(info({folder / "ball.nrrd", "--headers"})["values"].is_null());
}

TEST(Info, PrintsBoundsThatCropNothing) {
    const TemporaryFolder folder;
    const std::string scan = folder / "ball.nrrd";
    write_nrrd(scan, 24, 25, 13, ball(12, 12, 6, 8));
    std::string header = read_file(scan);
    const auto replace = [&](const std::string& before, const std::string& after) {
        header.replace(header.find(before), before.size(), after);
    };
    replace("(1,0,0)", "(0.48828125,0,0)");
    replace("(10,20,30)", "(-123.4564,-77.77777,200.12345)");
    write_file(scan, header);
    const std::string text = marrow_with({"info", scan}).out;
    const auto begin = text.find("-123.4564,");
    const std::string box = text.substr(begin, text.find(" mm", begin) - begin);
    ASSERT_EQ(marrow_with({scan, "--isovalue=-999", "-o", folder / "whole.ply"}).code, kOk);
    ASSERT_EQ(marrow_with({scan, "--isovalue=-999", "-o", folder / "boxed.ply", "--crop", box}).code, kOk);
    EXPECT_TRUE(read_file(folder / "whole.ply") == read_file(folder / "boxed.ply")) << box;
}

TEST(Info, SaysWhatTheHeadersDoNotState) {
    TemporaryFolder folder;
    using List = std::vector<std::string>;
    const auto not_stated = [&](const std::vector<std::string>& arguments) {
        return info(arguments)["series"][0]["not_stated"].get<List>();
    };
    write_series(folder, 3, "ct/s");
    EXPECT_EQ(not_stated({folder / "ct"}), List());
    write_nrrd(folder / "a.nrrd", 4, 4, 4, [](int x, int, int) { return x; });
    EXPECT_EQ(not_stated({folder / "a.nrrd"}), (List{"modality", "unit of the values"}));
    write_file(folder / "slice/1.png", png(2, 2, std::vector<std::uint8_t>{1, 2, 3, 4}));
    EXPECT_EQ(not_stated({folder / "slice"}),
              (List{"spacing", "orientation in the patient", "modality", "unit of the values"}));
    const std::string text = marrow_with({"info", folder / "slice", "--spacing", "1,1,1"}).out;
    contains(text, "not stated       orientation in the patient, modality, unit of the values");
    contains(text, "(axial; assumed)");
}

// Slices of 40 x 20 mm with a bright corner at the patient's right, front and top.
class Thumbnail : public testing::Test {
  protected:
    // Writes a scan of 10 x 10 x 10 samples with these directions, and reads its picture.
    Volume of(const std::string& directions, int bright_x, int bright_y) {
        std::string text =
            "NRRD0005\ntype: short\ndimension: 3\nsizes: 10 10 10\nspace: left-posterior-superior\n"
            "space directions: " +
            directions + "\nspace origin: (0,0,0)\nendian: little\nencoding: raw\n\n";
        for (int z = 0; z < 10; ++z) {
            for (int y = 0; y < 10; ++y) {
                for (int x = 0; x < 10; ++x) {
                    const bool bright = (x < 5) == (bright_x == 0) && (y < 5) == (bright_y == 0);
                    text += bytes_of(static_cast<std::int16_t>(bright ? 500 : -500));
                }
            }
        }
        write_file(folder / "scan.nrrd", text);
        const Outcome outcome = marrow_with({"info", folder / "scan.nrrd", "--picture", folder / "t.png"});
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        ScanOptions options;
        options.spacing = Vec3d{1, 1, 1};
        return read_scan(folder / "t.png", options);
    }

    const TemporaryFolder folder;
};

TEST_F(Thumbnail, LiesAsRadiologistsShowIt) {
    struct Case {
        const char* directions;
        int x, y;  // the bright corner: 0 at the first samples, 1 at the last
    };
    // The bright corner is always at the top left: at the patient's right or front, and front or top.
    for (const Case& c : {Case{"(4,0,0) (0,2,0) (0,0,1)", 0, 0}, Case{"(-4,0,0) (0,2,0) (0,0,1)", 1, 0},
                          Case{"(4,0,0) (0,-2,0) (0,0,1)", 0, 1}, Case{"(4,0,0) (0,0,2) (0,1,0)", 0, 1},
                          Case{"(0,4,0) (0,0,-2) (1,0,0)", 0, 0}}) {
        SCOPED_TRACE(c.directions);
        const Volume picture = of(c.directions, c.x, c.y);
        ASSERT_EQ(picture.geometry().dims, (std::array<std::int64_t, 3>{256, 128, 1}));
        const auto* pixels = picture.samples<std::uint8_t>();
        EXPECT_EQ(pixels[0], 255);
        EXPECT_EQ(pixels[255], 0);
        EXPECT_EQ(pixels[127 * 256], 0);
    }
    // The first index axis runs down.
    const Volume turned = of("(0,4,0) (2,0,0) (0,0,1)", 1, 0);
    ASSERT_EQ(turned.geometry().dims, (std::array<std::int64_t, 3>{128, 256, 1}));
    EXPECT_EQ(turned.samples<std::uint8_t>()[255 * 128], 255);
}

TEST_F(Thumbnail, NeedsASeriesThatWouldBeRead) {
    write_series(folder, 3, "a/s");
    write_series(folder, 3, "a/t", [](DicomWriter& s, int) { s.text(0x0020000e, "UI", "1.2.4"); });
    const Outcome several = marrow_with({"info", folder / "a", "--picture", folder / "t.png"});
    EXPECT_EQ(several.code, kGeometry);
    contains(several.err, "--series");
    contains(several.out, "choose one with --series");
    const Json json = info({folder / "a", "--picture", folder / "t.png"}, kGeometry);
    EXPECT_EQ(json["exit_code"], kGeometry);
    EXPECT_EQ("marrow: " + json["error"].get<std::string>() + "\n", several.err);
    EXPECT_EQ(json["series"].size(), 2u);
    EXPECT_EQ(marrow_with({"info", folder / "a", "--headers", "--picture", folder / "t.png"}).code, kUsage);
    EXPECT_EQ(marrow_with({"info", folder / "a", folder / "a", "--picture", folder / "t.png"}).code, kUsage);
    EXPECT_FALSE(fs::exists(folder / "t.png"));
}

TEST(Info, NamesVolumesOfOtherFormatsOnADisc) {
    TemporaryFolder folder;
    write_series(folder, 3, "disc/s");
    write_nrrd(folder / "disc/more/a.nrrd", 4, 4, 4, [](int x, int, int) { return x; });
    write_file(folder / "disc/icon.png", png(2, 2, std::vector<std::uint8_t>{1, 2, 3, 4}));
    const Json json = info({folder / "disc"});
    EXPECT_EQ(json["files"], 3);
    ASSERT_EQ(json["warnings"].size(), 1u);
    contains(json["warnings"][0], "1 volume in other formats");
    contains(json["warnings"][0], "a.nrrd");
}

TEST(Info, ListsTheLabelsOfALabelMap) {
    TemporaryFolder folder;
    write_nrrd(folder / "map.nrrd", 20, 20, 20, [](int x, int y, int) { return x < 5 ? 0 : y < 10 ? 3 : 7; });
    const Json labels = info({folder / "map.nrrd"})["values"]["labels"];
    ASSERT_EQ(labels.size(), 2u);
    EXPECT_EQ(labels[0]["label"], 3);
    EXPECT_EQ(labels[1]["samples"], 15 * 10 * 20);
}

// They would be refused as label maps.
TEST(Info, CallsNoVolumeALabelMapThatHasOtherNumbersToo) {
    TemporaryFolder folder;
    const std::string file = folder / "map.nrrd";
    const auto has_labels = [&](double one_sample) {
        std::vector<float> samples(200 * 200 * 210);
        for (std::size_t i = 0; i < samples.size(); ++i) samples[i] = i % 200 < 100 ? 1 : 2;
        samples[200 * 201 + 7] = static_cast<float>(one_sample);
        std::ofstream out(file, std::ios::binary);
        out << "NRRD0004\ntype: float\ndimension: 3\nsizes: 200 200 210\nencoding: raw\nendian: little\n"
               "spacings: 1 1 1\n\n";
        out.write(reinterpret_cast<const char*>(samples.data()),
                  static_cast<std::streamsize>(samples.size() * sizeof(float)));
        out.close();
        return !info({file})["values"]["labels"].empty();
    };
    EXPECT_TRUE(has_labels(3));
    for (const double other : {0.5, 16777218.0, HUGE_VAL, std::nan("")})
        EXPECT_FALSE(has_labels(other)) << other;
}

TEST(Info, EscapesWhatCouldChangeATerminal) {
    TemporaryFolder folder;
    write_series(folder, 3, "s", [](DicomWriter& s, int) {
        s.text(0x00080005, "CS", "ISO_IR 192");
        s.text(0x0008103e, "LO", "\xc2\x9b!");
        s.text(0x00181210, "SH", "\xc2\x9b");
        s.text(0x00100010, "PN", "\xc2\x9bpatient ");
    });
    const Outcome outcome = marrow_with({"info", folder.path(), "--show-patient"});
    EXPECT_NE(outcome.out.find("\\xc2\\x9bpatient"), outcome.out.npos) << outcome.out;
    EXPECT_EQ(outcome.out.find('\x9b'), outcome.out.npos) << outcome.out;
}

TEST(Info, NamesAMosaic) {
    TemporaryFolder folder;
    DicomWriter mosaic = slice(0, 0);
    mosaic.text(0x00080008, "CS", "ORIGINAL\\PRIMARY\\M\\ND\\MOSAIC");
    mosaic.write(folder / "one.dcm");
    for (const std::vector<std::string>& more : {std::vector<std::string>{}, {"--spacing", "1,1,3"}}) {
        std::vector<std::string> command{folder / "one.dcm", "-o", folder / "a.stl", "--isovalue", "3"};
        command.insert(command.end(), more.begin(), more.end());
        const Outcome outcome = marrow_with(command);
        EXPECT_EQ(outcome.code, kUnreadable);
        contains(outcome.err, "Siemens mosaic");
    }
    contains(info({folder / "one.dcm"})["refused"], "Siemens mosaic");
}

TEST(Info, SaysWhatSpacingASingleSliceNeeds) {
    TemporaryFolder folder;
    slice(0, 0).write(folder / "one.dcm");
    const auto err = [&](const std::vector<std::string>& more) {
        std::vector<std::string> command{folder / "one.dcm", "-o", folder / "a.stl", "--isovalue", "3"};
        command.insert(command.end(), more.begin(), more.end());
        return marrow_with(command).err;
    };
    contains(err({}), "set --spacing to 1,1,Z");
    contains(err({"--spacing", "0.5,0.5,2"}),
             "state a spacing of 1 x 1 mm, not 0.5 x 0.5; set --spacing to 1,1,2");
    EXPECT_EQ(err({"--spacing", "1,1,2"}), "");
}

TEST(Info, DescribesAFileOfSeveralVolumes) {
    MARROW_TEST_SCAN(file, "n_nifti/nasty_nifti/nibabel/example4d.nii.gz");
    const Json json = info({file});
    contains(json["refused"], "choose one from 0 to 1 with --volume");
    EXPECT_EQ(json["series"][0]["dims"], Json({128, 96, 24}));
}

TEST(Info, FindsGapsTiltAndMissingRescale) {
    TemporaryFolder gap, tilt;
    write_series(gap, 6);
    fs::remove(gap / "slice3");
    Json json = info({gap.path()});
    contains(json["refused"], "uneven");
    ASSERT_EQ(json["series"][0]["gaps"].size(), 1u);
    contains(json["series"][0]["gaps"][0], "4 mm between");
    EXPECT_TRUE(json["series"][0]["spacing_mm"][2].is_null());
    json = info({gap.path(), "--resample"});
    EXPECT_EQ(json["chosen"], 0);
    EXPECT_EQ(json["series"][0]["dims"][2], 6);

    write_series(tilt, 4, "s", [](DicomWriter& s, int k) {
        s.position("0\\" + std::to_string(-0.5 * k) + "\\" + std::to_string(2.0 * k));
        s.elements.erase(0x00281053);
    });
    json = info({tilt.path()});
    EXPECT_NEAR(json["series"][0]["tilt_degrees"], 14.036, 1e-3);
    EXPECT_EQ(json["series"][0]["hounsfield_units"], false);
    EXPECT_EQ(json["values"]["may_be_hounsfield_units"], false);
}

TEST(Info, ASeriesOfSeveralVolumesCanBeRead) {
    TemporaryFolder folder;
    const auto write = [&](const char* prefix, const char* series, const char* echo) {
        write_series(folder, 3, prefix, [&](DicomWriter& s, int) {
            s.text(0x0020000e, "UI", series);
            s.text(0x00180081, "DS", echo);
        });
    };
    write("a", "1.2.3", "10");
    write("b", "1.2.3", "20");
    write("c", "1.2.4", "10");
    contains(info({folder.path()})["refused"],
             "2 of 2 series can be read: choose one with --series, and one of its volumes with --volume");
}

TEST(Info, SeveralSeriesAreListedAndNoneIsChosen) {
    TemporaryFolder folder;
    write_series(folder, 3, "a");
    write_series(folder, 3, "b", [](DicomWriter& s, int) { s.text(0x0020000e, "UI", "1.2.4"); });
    Json json = info({folder.path()});
    EXPECT_TRUE(json["chosen"].is_null());
    contains(json["refused"], "2 of 2 series can be read: choose one");
    json = info({folder.path(), "--series", "1.2.4"});
    EXPECT_EQ(json["series"][json["chosen"].get<std::size_t>()]["series"], "1.2.4");
    EXPECT_EQ(marrow_with({"info", folder.path(), "--series", "1.2.5"}).code, kUsage);
}

TEST(Info, PrintsPatientNamesOnlyOnRequest) {
    TemporaryFolder folder;
    write_series(folder, 3);
    for (const bool json : {false, true}) {
        std::vector<std::string> command{"info", folder.path()};
        if (json) command.push_back("--json");
        const Outcome quiet = marrow_with(command);
        EXPECT_EQ((quiet.out + quiet.err).find("SECRET"), std::string::npos);
        command.push_back("--show-patient");
        contains(marrow_with(command).out, "SECRET^NAME");
    }
}

TEST(Info, SeveralInputsMakeATable) {
    TemporaryFolder folder;
    write_series(folder, 3, "good/s");
    write_file(folder / "letter.txt", "Dear colleague");
    const Json json = info({folder / "good", folder / "letter.txt", folder / "missing"}, 3);
    ASSERT_EQ(json["inputs"].size(), 3u);
    EXPECT_TRUE(json["inputs"][0].at("refused").is_null());
    EXPECT_FALSE(json["inputs"][0].contains("error"));
    for (const auto& [input, why] : {std::pair(1, "not a scan"), {2, "no such file"}}) {
        contains(json["inputs"][input]["error"], why);
        EXPECT_EQ(json["inputs"][input]["refused"], json["inputs"][input]["error"]);
        EXPECT_EQ(json["inputs"][input]["exit_code"], 3);
    }
    const Outcome text = marrow_with({"info", folder / "good", folder / "letter.txt"});
    EXPECT_EQ(text.code, 3);
    contains(text.out, "3 x 2 x 3");
    contains(text.err, "not a scan");
}

TEST(Info, OddRealFilesAreRightOrRefusedInOneLine) {
    MARROW_TEST_SCAN(data, "");
    std::vector<std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(data)) {
        if (entry.is_regular_file() &&
            entry.path().lexically_relative(data).begin()->native().starts_with("n_"))
            files.push_back(entry.path());
    }
    if (files.empty()) GTEST_SKIP() << "no odd files in MARROW_TEST_DATA";
    std::vector<std::string> command{"info", "--json"};
    command.insert(command.end(), files.begin(), files.end());
    const Json json = Json::parse(marrow_with(command).out);
    ASSERT_EQ(json["inputs"].size(), files.size());
    std::size_t good = 0;
    for (const Json& one : json["inputs"]) {
        SCOPED_TRACE(one["input"]);
        if (one.at("refused").is_null()) {
            ++good;
            EXPECT_TRUE(one["chosen"].is_number());
        } else {
            const std::string why = one["refused"];
            EXPECT_NE(why, "");
            EXPECT_EQ(why.find('\n'), why.npos);
        }
    }
    EXPECT_GT(good, 20u);
    EXPECT_LT(good, files.size());
}

}  // namespace
}  // namespace marrow::test
