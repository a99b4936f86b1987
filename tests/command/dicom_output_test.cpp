// marrow SCAN -o FILE.dcm: surfaces as DICOM objects.
#include <gtest/gtest.h>

#include <dcmtk/config/osconfig.h>

#include <dcmtk/dcmdata/dcdeftag.h>
#include <dcmtk/dcmdata/dcfilefo.h>

#include "support/command_line.h"
#include "support/dicom_series.h"

namespace marrow::test {
namespace {

class DicomOutput : public testing::Test {
  protected:
    DicomOutput() {
        std::filesystem::create_directory(scan);
        for (int k = 0; k < 4; ++k) {
            DicomWriter s = slice(k, 2.0 * k);
            s.text(0x00200052, "UI", "1.2.77");
            s.write(scan / (std::to_string(k) + ".dcm"));
        }
    }
    static std::string text(const std::filesystem::path& path, const DcmTagKey& tag) {
        DcmFileFormat file;
        EXPECT_TRUE(file.loadFile(path.c_str()).good()) << path;
        OFString value;
        file.getDataset()->findAndGetOFStringArray(tag, value);
        return value.c_str();
    }
    const TemporaryFolder folder;
    const std::filesystem::path scan = folder / "scan", file = folder / "skull.dcm";
};

TEST_F(DicomOutput, IsInTheFrameOfReferenceOfTheScan) {
    const Outcome outcome = marrow_with({scan, "-o", file, "--isovalue", "102.5", "--verify"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(text(file, DCM_FrameOfReferenceUID), "1.2.77");
    EXPECT_EQ(text(file, DCM_PatientName), "");
    const Outcome check = marrow_with({"check", file});
    EXPECT_EQ(check.code, 0) << check.err;
    EXPECT_NE(check.out.find("closed               yes"), std::string::npos) << check.out;
}

TEST_F(DicomOutput, NamesThePatientOnRequest) {
    ASSERT_EQ(marrow_with({scan, "-o", file, "--isovalue", "102.5", "--keep-patient"}).code, 0);
    EXPECT_EQ(text(file, DCM_PatientName), "SECRET^NAME");
    const std::string nrrd = folder / "ball.nrrd";
    write_nrrd(nrrd, 12, 12, 12, ball(5.3, 5.7, 5.4, 3.2));
    const Outcome outcome = marrow_with({nrrd, "-o", file, "--isovalue", "0.5", "--keep-patient"});
    EXPECT_EQ(outcome.code, 2);
    EXPECT_NE(outcome.err.find("--keep-patient needs a DICOM scan"), std::string::npos) << outcome.err;
    EXPECT_EQ(text(file, DCM_PatientName), "SECRET^NAME") << "the old file stays";
}

TEST_F(DicomOutput, RefusesOptionsAndFilesThatDoNotFit) {
    const auto expect_usage_error = [](const std::vector<std::string>& arguments, const std::string& why) {
        const Outcome outcome = marrow_with(arguments);
        EXPECT_EQ(outcome.code, 2);
        EXPECT_NE(outcome.err.find(why), std::string::npos) << outcome.err;
    };
    const std::string in = scan, out = file;
    expect_usage_error({in, "-o", folder / "a.stl", "--isovalue", "1", "--keep-patient"}, "add -o OUT.dcm");
    expect_usage_error({in, "-o", out, "--isovalue", "1", "--space", "RAS"},
                       "--space does not go with .glb and .dcm");
    expect_usage_error({in, "-o", out, "--isovalue", "1", "--isovalue", "2"}, "can hold only one surface");
    expect_usage_error({in, "-o", scan / "0.dcm", "--isovalue", "1"}, "would overwrite the input");
    // A folder is searched with its folders, and a file stands for its series.
    expect_usage_error({folder.path(), "-o", scan / "0.dcm", "--isovalue", "102.5"},
                       "would overwrite the input");
    expect_usage_error({scan / "1.dcm", "-o", scan / "0.dcm", "--isovalue", "102.5"},
                       "would overwrite the input");
    std::filesystem::copy_file(scan / "0.dcm", folder / "OTHER.DCM");
    expect_usage_error({folder.path(), "-o", folder / "OTHER.DCM", "--isovalue", "102.5"},
                       "would overwrite the input");
    EXPECT_EQ(text(folder / "OTHER.DCM", DCM_Modality), "CT");
    EXPECT_EQ(text(scan / "0.dcm", DCM_Modality), "CT");
    EXPECT_FALSE(std::filesystem::exists(file));
}

}  // namespace
}  // namespace marrow::test
