// `marrow info` on the command line.
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
    contains(text, "* 1.2.3");
    contains(text, "1 x 1 x 2 mm");
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
}

TEST(Info, SeveralSeriesAreListedAndNoneIsChosen) {
    TemporaryFolder folder;
    write_series(folder, 3, "a");
    write_series(folder, 3, "b", [](DicomWriter& s, int) { s.text(0x0020000e, "UI", "1.2.4"); });
    Json json = info({folder.path()});
    EXPECT_TRUE(json["chosen"].is_null());
    contains(json["refused"], "choose one");
    json = info({folder.path(), "--series", "1.2.4"});
    EXPECT_EQ(json["series"][json["chosen"].get<std::size_t>()]["series"], "1.2.4");
    EXPECT_EQ(marrow_with({"info", folder.path(), "--series", "1.2.5"}).code, 4);
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
    EXPECT_TRUE(json["inputs"][0]["refused"].is_null());
    contains(json["inputs"][1]["refused"], "not a scan");
    contains(json["inputs"][2]["refused"], "no such file");
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
        if (one["refused"].is_null()) {
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
