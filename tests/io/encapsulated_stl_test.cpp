// Meshes in DICOM objects (Encapsulated STL), written and read, and read by DCMTK.
#include <gtest/gtest.h>

#include <dcmtk/config/osconfig.h>

#include <dcmtk/dcmdata/dcdeftag.h>
#include <dcmtk/dcmdata/dcfilefo.h>

#include <marrow/error.h>
#include <marrow/isosurface.h>
#include <marrow/mesh_io.h>
#include <marrow/scan_io.h>

#include "support/dicom_series.h"
#include "support/fields.h"
#include "support/mesh_checks.h"

namespace marrow::test {
namespace {

namespace fs = std::filesystem;

Mesh ball(double radius) {
    Geometry g = grid(13, 14, 12);
    g.origin = {-3.3, -40, 100};
    const Volume volume = sampled_in_space<float>(g, sphere({2.8, -33.571, 106.297}, radius));
    return extract_isosurface(volume, 0);
}

class EncapsulatedStl : public testing::Test {
  protected:
    EncapsulatedStl() {
        fs::create_directory(folder / "scan");
        for (int k = 0; k < 3; ++k) {
            DicomWriter s = slice(k, 2.0 * k);
            s.text(0x00080018, "UI", "1.2.3." + std::to_string(k));
            s.text(0x00100010, "PN", "Schmidt^Anna");
            s.text(0x00100020, "LO", "4711");
            s.text(0x00080050, "SH", "A-1");
            s.text(0x0020000d, "UI", "1.2.99");
            s.text(0x00200052, "UI", "1.2.77");
            s.write(folder / "scan" / (std::to_string(k) + ".dcm"));
        }
        ScanInfo info;
        read_scan(folder / "scan", {}, &info);
        scan_files = info.series.dicom_files;
    }

    fs::path write(const Mesh& surface, const std::string& name, bool keep_patient = false,
                   const char* file = "a.dcm") const {
        write_meshes(std::array{MeshObject{surface, name, {}}}, folder / file,
                     {.scan_files = scan_files, .keep_patient = keep_patient});
        return folder / file;
    }

    // The text of an element, as DCMTK reads it.
    static std::string text(const fs::path& path, const DcmTagKey& tag) {
        DcmFileFormat file;
        EXPECT_TRUE(file.loadFile(path.c_str()).good()) << path;
        OFString value;
        EXPECT_TRUE(file.getDataset()->findAndGetOFStringArray(tag, value).good()) << tag.toString();
        return value.c_str();
    }

    static std::string refusal(const fs::path& path) {
        try {
            read_mesh(path);
        } catch (const InputError& error) {
            return error.what();
        }
        return {};
    }

    const TemporaryFolder folder;
    const Mesh mesh = ball(4.137);
    std::vector<fs::path> scan_files;
};

TEST_F(EncapsulatedStl, KeepsTheTrianglesAndTheirSpace) {
    const fs::path path = write(mesh, "skull");
    Space space = Space::none;
    const Mesh read = read_mesh(path, &space);
    EXPECT_EQ(space, Space::LPS);
    EXPECT_EQ(manifold_fault(read), "");
    ASSERT_EQ(read.triangles.size(), mesh.triangles.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        for (std::size_t c = 0; c < 3; ++c)
            ASSERT_TRUE(read.points[read.triangles[t][c]] == mesh.points[mesh.triangles[t][c]]);
    }
}

TEST_F(EncapsulatedStl, HoldsTheStlFileAsDcmtkReadsIt) {
    const fs::path path = write(mesh, "Schädel");
    write_mesh(mesh, folder / "a.stl");
    DcmFileFormat file;
    ASSERT_TRUE(file.loadFile(path.c_str()).good());
    const Uint8* bytes = nullptr;
    unsigned long size = 0;
    ASSERT_TRUE(file.getDataset()->findAndGetUint8Array(DCM_EncapsulatedDocument, bytes, &size).good());
    EXPECT_TRUE(std::string(reinterpret_cast<const char*>(bytes), size) == read_file(folder / "a.stl"));
    Uint32 stated = 0;
    ASSERT_TRUE(file.getDataset()->findAndGetUint32(DCM_EncapsulatedDocumentLength, stated).good());
    EXPECT_EQ(stated, size);
    EXPECT_EQ(text(path, DCM_SOPClassUID), "1.2.840.10008.5.1.4.1.1.104.3");
    EXPECT_EQ(text(path, DCM_MIMETypeOfEncapsulatedDocument), "model/stl");
    EXPECT_EQ(text(path, DCM_Modality), "M3D");
    EXPECT_EQ(text(path, DCM_SpecificCharacterSet), "ISO_IR 192");
    EXPECT_EQ(text(path, DCM_DocumentTitle), "Schädel");
    EXPECT_EQ(text(path, DCM_FrameOfReferenceUID), "1.2.77");
    OFString unit, scheme;
    DcmItem* units = nullptr;
    ASSERT_TRUE(file.getDataset()->findAndGetSequenceItem(DCM_MeasurementUnitsCodeSequence, units).good());
    EXPECT_TRUE(units->findAndGetOFString(DCM_CodeValue, unit).good());
    EXPECT_TRUE(units->findAndGetOFString(DCM_CodingSchemeDesignator, scheme).good());
    EXPECT_EQ(unit, "mm");
    EXPECT_EQ(scheme, "UCUM");
}

TEST_F(EncapsulatedStl, StatesThePatientOnlyOnRequest) {
    const fs::path anonymous = write(mesh, "skull");
    const std::string bytes = read_file(anonymous);
    for (const char* secret : {"Schmidt", "Anna", "4711", "A-1", "1.2.99", "1.2.3.0"})
        EXPECT_EQ(bytes.find(secret), bytes.npos) << secret;
    EXPECT_EQ(text(anonymous, DCM_PatientName), "");
    EXPECT_EQ(text(anonymous, DCM_PatientIdentityRemoved), "YES");

    const fs::path kept = write(mesh, "skull", true, "kept.dcm");
    EXPECT_EQ(text(kept, DCM_PatientName), "Schmidt^Anna");
    EXPECT_EQ(text(kept, DCM_PatientID), "4711");
    EXPECT_EQ(text(kept, DCM_AccessionNumber), "A-1");
    EXPECT_EQ(text(kept, DCM_StudyInstanceUID), "1.2.99");
    EXPECT_NE(text(kept, DCM_SOPInstanceUID), text(anonymous, DCM_SOPInstanceUID));
    DcmFileFormat file;
    ASSERT_TRUE(file.loadFile(kept.c_str()).good());
    for (long k = 0; k < 3; ++k) {
        DcmItem* source = nullptr;
        OFString uid;
        ASSERT_TRUE(file.getDataset()->findAndGetSequenceItem(DCM_SourceInstanceSequence, source, k).good());
        ASSERT_TRUE(source->findAndGetOFString(DCM_ReferencedSOPInstanceUID, uid).good());
        EXPECT_EQ(uid, ("1.2.3." + std::to_string(k)).c_str());
    }
}

TEST_F(EncapsulatedStl, AlwaysHasAStudy) {
    for (const fs::path& path : scan_files) {
        DcmFileFormat file;
        ASSERT_TRUE(file.loadFile(path.c_str()).good());
        ASSERT_TRUE(file.getDataset()->findAndDeleteElement(DCM_StudyInstanceUID).good());
        ASSERT_TRUE(file.saveFile(path.c_str()).good());
    }
    EXPECT_EQ(text(write(mesh, "skull", true), DCM_StudyInstanceUID),
              text(write(mesh, "skull", false, "b.dcm"), DCM_StudyInstanceUID));
    EXPECT_EQ(text(folder / "a.dcm", DCM_StudyInstanceUID).find("2.25."), 0u);
}

// A value has an even number of bytes, so that one of an odd number is followed by a byte of zero.
TEST_F(EncapsulatedStl, TextMayBePadded) {
    for (const std::string space : {"", " "}) {
        const std::string stl = "solid" + space +
                                "\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
                                "vertex 0 1 0\nendloop\nendfacet\nendsolid";
        DcmFileFormat file;
        ASSERT_TRUE(file.loadFile(write(mesh, "skull").c_str()).good());
        ASSERT_TRUE(file.getDataset()
                        ->putAndInsertUint8Array(DCM_EncapsulatedDocument,
                                                 reinterpret_cast<const Uint8*>(stl.data()), stl.size())
                        .good());
        ASSERT_TRUE(file.saveFile((folder / "b.dcm").c_str()).good());
        EXPECT_EQ(read_mesh(folder / "b.dcm").triangles.size(), 1u) << stl.size() << " bytes";
    }
}

TEST_F(EncapsulatedStl, UidsTellSurfacesApart) {
    const fs::path a = write(mesh, "skull"), same = write(mesh, "skull", false, "same.dcm"),
                   other = write(ball(3.2), "skull", false, "other.dcm"),
                   renamed = write(mesh, "skin", false, "renamed.dcm");
    EXPECT_EQ(read_file(a), read_file(same)) << "the same surface is the same object";
    std::set<std::string> uids;
    for (const fs::path& path : {a, other, renamed}) {
        uids.insert(text(path, DCM_SOPInstanceUID));
        uids.insert(text(path, DCM_SeriesInstanceUID));
        EXPECT_EQ(text(path, DCM_StudyInstanceUID), text(a, DCM_StudyInstanceUID)) << "one scan, one study";
    }
    EXPECT_EQ(uids.size(), 6u);
    for (const std::string& uid : uids) {
        EXPECT_EQ(uid.find("2.25."), 0u);
        EXPECT_LE(uid.size(), 44u) << "a number of 128 bits";
        EXPECT_NE(uid[5], '0');
    }
}

TEST_F(EncapsulatedStl, OtherScansGetAFrameOfReferenceOfTheirOwn) {
    scan_files.clear();
    const std::string own = text(write(mesh, "skull"), DCM_FrameOfReferenceUID);
    EXPECT_EQ(own.find("2.25."), 0u);
    EXPECT_THROW(write(mesh, "skull", true), OptionError);
}

TEST_F(EncapsulatedStl, HasOneSurfaceInLps) {
    EXPECT_THROW(write_mesh(mesh, folder / "b.dcm", {.space = Space::RAS}), InputError);
    EXPECT_THROW(write_mesh(mesh, folder / "b.dcm", {.space = Space::none}), InputError);
    EXPECT_THROW(write_meshes(std::array{MeshObject{mesh}, MeshObject{mesh}}, folder / "b.dcm"), InputError);
    EXPECT_EQ(folder.files(), (std::set<std::string>{"scan"}));
}

TEST_F(EncapsulatedStl, UnitsOfOthersBecomeMillimetres) {
    std::string bytes = read_file(write(mesh, "skull"));
    for (const auto& [unit, factor] : {std::pair("um", 0.001), std::pair("cm", 10.0)}) {
        std::string changed = bytes;
        const std::size_t at = changed.find("mm");  // the code's value
        changed.replace(at, 2, unit);
        write_file(folder / "b.dcm", changed);
        EXPECT_FLOAT_EQ(read_mesh(folder / "b.dcm").points[0][2],
                        static_cast<float>(read_mesh(folder / "a.dcm").points[0][2] * factor));
    }
    bytes.replace(bytes.find("mm"), 2, "zz");
    write_file(folder / "b.dcm", bytes);
    EXPECT_NE(refusal(folder / "b.dcm").find("its unit is missing or unknown: 'zz'"), std::string::npos);
}

TEST_F(EncapsulatedStl, OtherAndDamagedFilesAreRefused) {
    EXPECT_NE(refusal(scan_files[0]).find("holds no surface"), std::string::npos);
    write_file(folder / "text.dcm", "no DICOM");
    EXPECT_NE(refusal(folder / "text.dcm"), "");
    const std::string whole = read_file(write(mesh, "skull"));
    for (std::size_t size = 0; size < whole.size() - 60; size += 1 + whole.size() / 97) {
        write_file(folder / "cut.dcm", whole.substr(0, size));
        EXPECT_NE(refusal(folder / "cut.dcm"), "") << size;
    }
}

}  // namespace
}  // namespace marrow::test
