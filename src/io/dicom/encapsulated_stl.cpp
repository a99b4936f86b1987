// Reads and writes Encapsulated STL objects (DICOM PS3.3, A.85.1). The elements that surround the STL file
// are written by DCMTK; the file itself is written as a stream between them.
#include "encapsulated_stl.h"

#include <array>
#include <initializer_list>
#include <set>
#include <vector>

#include <dcmtk/config/osconfig.h>

#include <dcmtk/dcmdata/dcdeftag.h>
#include <dcmtk/dcmdata/dcfilefo.h>
#include <dcmtk/dcmdata/dcostrmb.h>
#include <dcmtk/dcmdata/dcuid.h>

#include <marrow/error.h>
#include <marrow/version.h>

#include "data_set.h"
#include "file.h"
#include "io/bytes/text.h"
#include "tags.h"

namespace marrow::internal::io {

namespace {

constexpr char kMimeType[] = "model/stl";

// A UID below 2.25, which is a UUID as a decimal number (PS3.5, B.2). The UUID is made of a 128-bit FNV-1a
// hash, as version 8 of RFC 9562 allows.
std::string uid_of(std::initializer_list<std::string_view> content) {
    __extension__ using Wide = unsigned __int128;
    constexpr Wide kPrime = (Wide{1} << 88) + 0x13b;
    Wide hash = (Wide{0x6c62272e07bb0142} << 64) + 0x62b821756295c58d;
    for (const std::string_view part : content) {
        for (const char c : part) hash = (hash ^ static_cast<unsigned char>(c)) * kPrime;
    }
    hash = (hash & ~(Wide{0xf} << 76)) | Wide{8} << 76;  // version
    hash = (hash & ~(Wide{3} << 62)) | Wide{2} << 62;    // variant
    std::string digits;
    for (; hash > 0; hash /= 10) digits += static_cast<char>('0' + static_cast<int>(hash % 10));
    return "2.25." + std::string(digits.rbegin(), digits.rend());
}

template <class T>
std::string_view bytes_of(std::span<const T> values) {
    return {reinterpret_cast<const char*>(values.data()), values.size_bytes()};
}

void check(const OFCondition& done) {
    if (done.bad()) throw LimitError(std::string("cannot make a DICOM object: ") + done.text());
}

// VRs are given here, so that nothing depends on whether DCMTK finds its dictionary.
void put(DcmItem& item, const DcmTagKey& tag, DcmEVR vr, const std::string& value) {
    check(item.putAndInsertString(DcmTag(tag, DcmVR(vr)), value.c_str()));
}

DcmItem& add_item(DcmItem& to, const DcmTagKey& sequence) {
    DcmItem* item = nullptr;
    check(to.findOrCreateSequenceItem(DcmTag(sequence, DcmVR(EVR_SQ)), item, -2));  // -2 appends
    return *item;
}

void put_millimetres(DcmItem& to) {
    DcmItem& unit = add_item(to, DCM_MeasurementUnitsCodeSequence);
    put(unit, DCM_CodeValue, EVR_SH, "mm");
    put(unit, DCM_CodingSchemeDesignator, EVR_SH, "UCUM");
    put(unit, DCM_CodeMeaning, EVR_LO, "mm");
}

// The attributes that describe the patient and the study, which are present in each
// object, perhaps without a value.
struct Attribute {
    DcmTagKey tag;
    DcmEVR vr;
};
const std::array kPatientAndStudy{
    Attribute{DCM_StudyDate, EVR_DA},        Attribute{DCM_StudyTime, EVR_TM},
    Attribute{DCM_AccessionNumber, EVR_SH},  Attribute{DCM_ReferringPhysicianName, EVR_PN},
    Attribute{DCM_StudyDescription, EVR_LO}, Attribute{DCM_PatientName, EVR_PN},
    Attribute{DCM_PatientID, EVR_LO},        Attribute{DCM_IssuerOfPatientID, EVR_LO},
    Attribute{DCM_PatientBirthDate, EVR_DA}, Attribute{DCM_PatientSex, EVR_CS},
    Attribute{DCM_StudyInstanceUID, EVR_UI}, Attribute{DCM_StudyID, EVR_SH},
};

DicomTag number_of(const DcmTagKey& tag) {
    return DicomTag{tag.getGroup()} << 16 | tag.getElement();
}

// The frame of reference of all files; empty if they have none, or several.
std::string frame_of_reference(std::span<const std::filesystem::path> files) {
    std::set<std::string> found;
    for (const std::filesystem::path& path : files)
        found.insert(parse_dicom_header(path).data_set.text(tag::kFrameOfReferenceUid));
    return found.size() == 1 ? *found.begin() : std::string();
}

void put_patient_and_study(DcmItem& to, std::span<const std::filesystem::path> scan) {
    const ParsedDicom first = parse_dicom_header(scan.front());
    for (const auto& [tag, vr] : kPatientAndStudy)
        put(to, tag, vr, readable_text(first.data_set, number_of(tag), first.data_set));
    for (const std::filesystem::path& path : scan) {
        const ParsedDicom file = parse_dicom_header(path);
        DcmItem& source = add_item(to, DCM_SourceInstanceSequence);
        put(source, DCM_ReferencedSOPClassUID, EVR_UI, file.data_set.text(tag::kSopClassUid));
        put(source, DCM_ReferencedSOPInstanceUID, EVR_UI, file.data_set.text(tag::kSopInstanceUid));
    }
}

void put_nobody(DcmItem& to) {
    for (const auto& [tag, vr] : kPatientAndStudy) put(to, tag, vr, "");
    put(to, DCM_PatientIdentityRemoved, EVR_CS, "YES");
    put(to, DCM_DeidentificationMethod, EVR_LO, "No attribute of patient or study is written");
}

// All elements but the STL file.
void fill(DcmItem& to, const StlObject& object) {
    const std::string surface = uid_of({bytes_of(object.mesh.points), bytes_of(object.mesh.triangles)});
    std::string frame = frame_of_reference(object.scan);
    if (frame.empty()) frame = uid_of({"frame of reference", surface});
    put(to, DCM_SpecificCharacterSet, EVR_CS, "ISO_IR 192");
    put(to, DCM_SOPClassUID, EVR_UI, UID_EncapsulatedSTLStorage);
    if (object.keep_patient)
        put_patient_and_study(to, object.scan);
    else
        put_nobody(to);
    OFString study;
    to.findAndGetOFString(DCM_StudyInstanceUID, study);
    if (study.empty()) {  // the surfaces of one scan belong to one study
        study = uid_of({"study", frame}).c_str();
        put(to, DCM_StudyInstanceUID, EVR_UI, study.c_str());
    }
    put(to, DCM_SOPInstanceUID, EVR_UI, uid_of({"instance", surface, object.title, study.c_str()}));
    put(to, DCM_SeriesInstanceUID, EVR_UI, uid_of({"series", surface, object.title, study.c_str()}));
    put(to, DCM_Modality, EVR_CS, "M3D");
    put(to, DCM_SeriesNumber, EVR_IS, "1");
    put(to, DCM_SeriesDescription, EVR_LO, "Surface by Marrow, for research use only");
    put(to, DCM_FrameOfReferenceUID, EVR_UI, frame);
    put(to, DCM_PositionReferenceIndicator, EVR_LO, "");
    put(to, DCM_Manufacturer, EVR_LO, "Marrow");
    put(to, DCM_ManufacturerModelName, EVR_LO, "Marrow");
    put(to, DCM_DeviceSerialNumber, EVR_LO, "0");
    put(to, DCM_SoftwareVersions, EVR_LO, MARROW_VERSION);
    put(to, DCM_InstanceNumber, EVR_IS, "1");
    // The same surface is always the same object, so that it states no time.
    put(to, DCM_ContentDate, EVR_DA, "");
    put(to, DCM_ContentTime, EVR_TM, "");
    put(to, DCM_AcquisitionDateTime, EVR_DT, "");
    put(to, DCM_BurnedInAnnotation, EVR_CS, "NO");
    put(to, DCM_DocumentTitle, EVR_ST, object.title);
    check(to.insertEmptyElement(DcmTag(DCM_ConceptNameCodeSequence, DcmVR(EVR_SQ))));
    put_millimetres(to);
    put(to, DCM_ModelModification, EVR_CS, "NO");
    put(to, DCM_ModelMirroring, EVR_CS, "NO");
    put(to, DCM_MIMETypeOfEncapsulatedDocument, EVR_LO, kMimeType);
    check(to.putAndInsertUint32(DcmTag(DCM_EncapsulatedDocumentLength, DcmVR(EVR_UL)), object.bytes));
}

template <class Object, class... More>
std::string written(Object& object, More... more) {
    std::string bytes(std::size_t{1} << 24, '\0');
    DcmOutputBufferStream stream(bytes.data(), static_cast<offile_off_t>(bytes.size()));
    object.transferInit();
    check(object.write(stream, EXS_LittleEndianExplicit, EET_ExplicitLength, nullptr, more...));
    object.transferEnd();
    void* begin = nullptr;
    offile_off_t size = 0;
    stream.flushBuffer(begin, size);
    return {static_cast<const char*>(begin), static_cast<std::size_t>(size)};
}

}  // namespace

EncapsulatedStl read_encapsulated_stl(const std::filesystem::path& path) {
    const ParsedDicom file = parse_dicom(path);
    const DicomDataSet& data_set = file.data_set;
    const auto refuse = [&](const std::string& why) { throw InputError(quoted(path) + ": " + why); };
    if (data_set.text(tag::kSopClassUid) != UID_EncapsulatedSTLStorage)
        refuse("holds no surface: only DICOM objects with an encapsulated STL file do");
    const std::string_view stl = data_set.bytes(tag::kEncapsulatedDocument);
    if (stl.empty() || data_set.text(tag::kMimeType) != kMimeType) refuse("its STL file is missing");
    const std::vector<DicomDataSet> units = data_set.items(tag::kMeasurementUnits);
    const std::string unit = units.empty() ? std::string() : units.front().text(tag::kCodeValue);
    const std::optional<double> scale = millimetres(unit);
    if (!scale) refuse("its unit is missing or unknown: " + quoted(unit));
    return {std::string(stl), *scale};
}

StlWrapping wrap_stl(const StlObject& object) {
    if (object.keep_patient && object.scan.empty())
        throw OptionError("options.keep_patient needs a DICOM scan: no other states a patient");
    DcmFileFormat before;
    DcmDataset& data_set = *before.getDataset();
    fill(data_set, object);
    // What comes after the STL file moves to a data set of its own.
    DcmDataset after;
    for (unsigned long i = 0; i < data_set.card();) {
        if (data_set.getElement(i)->getTag() < DCM_EncapsulatedDocument)
            ++i;
        else
            check(after.insert(data_set.remove(i)));
    }
    std::string element{"\x42\0\x11\0OB\0\0", 8};
    for (int i = 0; i < 4; ++i) element += static_cast<char>(object.bytes >> (8 * i) & 0xff);
    return {written(before, EGL_recalcGL, EPD_noChange) + element,
            written(after, EGL_recalcGL, EPD_noChange)};
}

}  // namespace marrow::internal::io
