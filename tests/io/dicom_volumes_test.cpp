// Which slices of a DICOM series are one volume, and which are several: the rows in docs/reliability.md.
#include <gtest/gtest.h>

#include <algorithm>

#include <marrow/error.h>

#include "support/dicom_objects.h"
#include "support/reading_checks.h"

namespace marrow::test {
namespace {

// None of these says which volume a slice belongs to, unless slices have the same position.
TEST(DicomVolumes, OneEvenStackIsOneVolumeWhateverItsSlicesSay) {
    const std::vector<std::pair<const char*, std::function<void(DicomWriter&, int)>>> changes = {
        {"frame of reference",
         [](DicomWriter& s, int k) { s.text(0x00200052, "UI", "1.2.9." + std::to_string(k)); }},
        {"study date",
         [](DicomWriter& s, int k) { s.text(0x00080020, "DA", "2020010" + std::to_string(k)); }},
        {"kernel", [](DicomWriter& s, int k) { s.text(0x00181210, "SH", k % 2 ? "STANDARD" : "Standard"); }},
        {"modality", [](DicomWriter& s, int k) { s.text(0x00080060, "CS", k == 1 ? "" : "CT"); }},
        {"echo", [](DicomWriter& s, int k) { s.text(0x00180086, "IS", std::to_string(k % 2)); }},
        {"acquisition", [](DicomWriter& s, int k) { s.text(0x00200012, "IS", std::to_string(k / 3)); }},
        {"image type",
         [](DicomWriter& s, int k) { s.text(0x00080008, "CS", k < 2 ? "ORIGINAL\\PRIMARY" : "DERIVED"); }},
        {"missing tags", [](DicomWriter& s, int k) {
             for (const std::uint32_t tag : {0x00200052u, 0x00080060u, 0x00080008u}) {
                 if (k == 2) s.elements.erase(tag);
             }
         }}};
    for (const auto& [name, change] : changes) {
        SCOPED_TRACE(name);
        TemporaryFolder folder;
        write_series(folder, 6, "s", change);
        ScanInfo info;
        EXPECT_EQ(samples_of<std::int16_t>(read_scan(folder.path(), {}, &info)), volume_samples(6));
        const bool frames = std::string(name) == "frame of reference";
        ASSERT_EQ(info.warnings.size(), frames ? 1u : 0u);
        if (frames) contains(info.warnings[0], "6 frames of reference");
        EXPECT_EQ(inspect_scan(folder.path()).series.size(), 1u);
    }
}

TEST(DicomVolumes, FramesOfReferenceSplitWhatIsNotEven) {
    // Six slices are even and six others are beside them: two volumes, unless each slice has a frame of its
    // own.
    for (const bool own : {false, true}) {
        TemporaryFolder folder;
        const auto change = [&](double shift, const std::string& uid) {
            return [=](DicomWriter& s, int k) {
                s.position("10\\20\\" + std::to_string(2.0 * k + shift));
                s.text(0x00200052, "UI", own ? uid + std::to_string(k) : uid);
            };
        };
        write_series(folder, 6, "a", change(0, "1.2.8"));
        write_series(folder, 6, "b", change(0.5, "1.2.7"));
        contains(refusal<GeometryError>(folder.path()), own ? "uneven" : "2 series");
    }
}

// Writes volumes of four slices at the same positions, to files whose names say nothing.
void write_volumes(const TemporaryFolder& folder, int volumes,
                   const std::function<void(DicomWriter&, int volume, int k)>& change) {
    for (int volume = 0; volume < volumes; ++volume) {
        for (int k = 0; k < 4; ++k) {
            DicomWriter s = slice(10 * volume + k, 2.0 * k);
            change(s, volume, k);
            s.write(folder / std::to_string((7 * volume + 5 * k) % 97));
        }
    }
}

std::vector<std::int16_t> samples_of_volume(int volume) {
    std::vector<std::int16_t> out = volume_samples(4);
    for (std::int16_t& sample : out) sample = static_cast<std::int16_t>(sample + 1000 * volume);
    return out;
}

void expect_volumes(const TemporaryFolder& folder, const std::vector<std::string>& differences) {
    const std::string what = refusal<GeometryError>(folder.path());
    contains(what, std::to_string(differences.size()) + " volumes (0: " + differences[0]);
    contains(what, "options.volume");
    const ScanReport report = inspect_scan(folder.path());
    ASSERT_EQ(report.series.size(), 1u);
    EXPECT_EQ(report.series[0].volumes, differences);
    EXPECT_EQ(report.series[0].series.dims[2], 4);
    EXPECT_FALSE(report.chosen);
    EXPECT_EQ(report.series[0].volume_count, static_cast<std::int64_t>(differences.size()));
    ASSERT_EQ(report.series[0].middle_slices.size(), differences.size());
    ScanOptions options;
    for (std::size_t v = 0; v < differences.size(); ++v) {
        options.volume = static_cast<std::int64_t>(v);
        const auto samples = samples_of_volume(static_cast<int>(v));
        EXPECT_EQ(samples_of<std::int16_t>(read_scan(folder.path(), options)), samples);
        const auto middle = samples_of<std::int32_t>(read_dicom_image(report.series[0].middle_slices[v]));
        EXPECT_EQ(std::vector<std::int16_t>(middle.begin(), middle.end()),
                  std::vector<std::int16_t>(samples.begin() + 12, samples.begin() + 18));
        EXPECT_TRUE(inspect_scan(folder.path(), options).chosen);
    }
    options.volume = static_cast<std::int64_t>(differences.size());
    contains(refusal<OptionError>(folder.path(), options), "has no volume");
}

TEST(DicomVolumes, AnAttributeTellsVolumesApart) {
    struct Case {
        std::uint32_t tag;
        const char* vr;
        std::array<std::string, 3> values;
        std::vector<std::string> differences;
    };
    const std::vector<Case> cases = {
        {0x00180081, "DS", {"4.5", "30", "100"}, {"echo time 4.5 ms", "echo time 30 ms", "echo time 100 ms"}},
        {0x00180086, "IS", {"1", "2", "10"}, {"echo 1", "echo 2", "echo 10"}},
        {0x00200100, "IS", {"9", "10", "11"}, {"time point 9", "time point 10", "time point 11"}},
        {0x00181060,
         "DS",
         {"0", "50", "700"},
         {"trigger time 0 ms", "trigger time 50 ms", "trigger time 700 ms"}},
        {0x00200012, "IS", {"1", "2", "3"}, {"acquisition 1", "acquisition 2", "acquisition 3"}},
        {0x00541300,
         "DS",
         {"100", "200", "3000"},
         {"frame time 100 ms", "frame time 200 ms", "frame time 3000 ms"}},
        {0x00181210, "SH", {"B20f", "B70f", "H30s"}, {"kernel B20f", "kernel B70f", "kernel H30s"}},
        {0x00189087,
         "FD",
         {bytes_of(0.0), bytes_of(500.0), bytes_of(1000.0)},
         {"b-value 0 s/mm2", "b-value 500 s/mm2", "b-value 1000 s/mm2"}},
        {0x00080008,
         "CS",
         {"ORIGINAL\\PRIMARY\\M\\ND", "ORIGINAL\\PRIMARY\\P\\ND", "ORIGINAL\\PRIMARY\\R\\ND"},
         {"image type M", "image type P", "image type R"}}};
    for (const Case& c : cases) {
        SCOPED_TRACE(c.differences[0]);
        TemporaryFolder folder;
        write_volumes(folder, 3, [&](DicomWriter& s, int volume, int) {
            const std::string& value = c.values[static_cast<std::size_t>(volume)];
            if (std::string(c.vr) == "FD")
                s.elements[c.tag] = {"FD", value};
            else
                s.text(c.tag, c.vr, value);
        });
        expect_volumes(folder, c.differences);
    }
}

TEST(DicomVolumes, ControlCharactersAreEscaped) {
    TemporaryFolder folder;
    write_volumes(folder, 2, [](DicomWriter& s, int volume, int) {
        s.text(0x00181210, "SH", volume == 0 ? "B20\nf" : "B\x1b[1m");
    });
    const std::string what = refusal<GeometryError>(folder.path());
    EXPECT_EQ(std::count_if(what.begin(), what.end(), [](unsigned char c) { return c < 0x20; }), 0) << what;
    contains(what, "kernel B20?f");
}

TEST(DicomVolumes, SeveralAttributesTogether) {
    TemporaryFolder folder;
    write_volumes(folder, 4, [](DicomWriter& s, int volume, int) {
        s.text(0x00180081, "DS", volume < 2 ? "10" : "20");
        s.text(0x00200100, "IS", std::to_string(1 + volume % 2));
    });
    expect_volumes(folder, {"echo time 10 ms, time point 1", "echo time 10 ms, time point 2",
                            "echo time 20 ms, time point 1", "echo time 20 ms, time point 2"});
    // A list that has no room for all says so.
    contains(refusal<GeometryError>(folder.path()),
             "2: echo time 20 ms, time point 1; and 1 more); choose one");
}

// A heart beats a little faster or slower while each slice is scanned.
TEST(DicomVolumes, TimesThatDifferFromSliceToSliceCountByTheirOrder) {
    TemporaryFolder folder;
    write_volumes(folder, 3, [](DicomWriter& s, int volume, int k) {
        s.text(0x00181060, "DS", std::to_string(volume * (30 + k)));
    });
    expect_volumes(folder,
                   {"trigger time 0 to 0 ms", "trigger time 30 to 33 ms", "trigger time 60 to 66 ms"});
}

// Each time is that of one slice, which is no volume.
TEST(DicomVolumes, TwoPositionsSufficeForTheOrderOfTimes) {
    TemporaryFolder folder;
    for (int volume = 0; volume < 2; ++volume) {
        for (int k = 0; k < 2; ++k) {
            DicomWriter s = slice(k, 2.0 * k);
            s.text(0x00181060, "DS", std::to_string(10 + 30 * volume + k));
            s.write(folder / (std::to_string(volume) + "-" + std::to_string(k)));
        }
    }
    ScanOptions options;
    options.volume = 1;
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(folder.path(), options)), volume_samples(2));
    EXPECT_EQ(inspect_scan(folder.path()).series.at(0).volume_count, 2);
}

TEST(DicomVolumes, InstancesNumberedVolumeByVolumeTellThemApartWithAWarning) {
    TemporaryFolder folder;
    write_volumes(folder, 2, [](DicomWriter& s, int volume, int k) {
        s.text(0x00200013, "IS", std::to_string(40 * volume + k + 1));
    });
    expect_volumes(folder, {"InstanceNumber 1 to 4", "InstanceNumber 41 to 44"});
    ScanOptions options;
    options.volume = 1;
    ScanInfo info;
    read_scan(folder.path(), options, &info);
    contains(info.warnings.at(0), "told apart by the order of their InstanceNumber alone");
}

TEST(DicomVolumes, SlicesThatNothingTellsApartAreRefused) {
    const std::vector<std::pair<const char*, std::function<void(DicomWriter&, int, int)>>> changes = {
        {"nothing", [](DicomWriter&, int, int) {}},
        {"instances in no order",
         [](DicomWriter& s, int volume, int k) { s.text(0x00200013, "IS", std::to_string(2 * k + volume)); }},
        {"another value at each position", [](DicomWriter& s, int volume, int k) {
             s.text(0x00200012, "IS", std::to_string(10 * k + volume));
         }}};
    for (const auto& [name, change] : changes) {
        SCOPED_TRACE(name);
        TemporaryFolder folder;
        write_volumes(folder, 2, change);
        contains(refusal<GeometryError>(folder.path()), "have the same position");
    }
}

TEST(DicomVolumes, AVolumeWithoutASliceIsRefusedAndTheOthersAreRead) {
    TemporaryFolder folder;
    for (int volume = 0; volume < 2; ++volume) {
        for (int k = 0; k < 6; ++k) {
            if (volume == 1 && k == 2) continue;
            DicomWriter s = slice(10 * volume + k, 2.0 * k);
            s.text(0x00200100, "IS", std::to_string(volume + 1));
            s.write(folder / std::to_string(10 * volume + k));
        }
    }
    ScanOptions options;
    options.volume = 0;
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(folder.path(), options)), volume_samples(6));
    options.volume = 1;
    contains(refusal<GeometryError>(folder.path(), options), "uneven");
}

TEST(DicomVolumes, AnOrdinaryScanIsVolumeZero) {
    TemporaryFolder folder;
    write_series(folder, 3);
    ScanOptions options;
    options.volume = 0;
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(folder.path(), options)), volume_samples(3));
    EXPECT_TRUE(inspect_scan(folder.path()).series.at(0).volumes.empty());
    options.volume = 1;
    contains(refusal<OptionError>(folder.path(), options), "has no volume 1");
}

// Functional groups of an enhanced file: time points by TemporalPositionIndex, or by a dimension of its own.
TEST(DicomVolumes, FramesOfAnEnhancedFile) {
    const auto form = DicomWriter::Form::explicit_little;
    const auto sequence = [&](std::uint32_t tag, const std::string& content) {
        return DicomWriter::element(tag, "SQ", DicomWriter::item(content), form);
    };
    for (const bool dimension : {false, true}) {
        TemporaryFolder folder;
        DicomWriter out = enhanced(8);
        std::string items;
        std::vector<std::int16_t> all;
        for (int n = 0; n < 8; ++n) {
            const int volume = n % 2, k = n / 2;
            std::string position = "10\\20\\" + std::to_string(2 * k);
            if (position.size() % 2 != 0) position += ' ';
            const std::vector<std::uint32_t> indices = {static_cast<std::uint32_t>(k + 1),
                                                        static_cast<std::uint32_t>(volume + 1)};
            const std::string content =
                dimension ? DicomWriter::element(0x00209157, "UL", bytes_of(indices), form)
                          : DicomWriter::element(0x00209128, "UL",
                                                 bytes_of(static_cast<std::uint32_t>(volume + 1)), form);
            items += DicomWriter::item(
                sequence(0x00209111, content) +
                sequence(0x00209113, DicomWriter::element(0x00200032, "DS", position, form)));
            const auto samples = slice_samples(10 * volume + k);
            all.insert(all.end(), samples.begin(), samples.end());
        }
        out.elements[0x52009230] = {"SQ", items};
        const auto pointer = [&](std::uint16_t group, std::uint16_t element) {
            return DicomWriter::item(
                DicomWriter::element(0x00209165, "AT", bytes_of(group) + bytes_of(element), form));
        };
        if (dimension) out.elements[0x00209222] = {"SQ", pointer(0x0020, 0x9057) + pointer(0x0099, 0x1001)};
        out.pixels(columns, rows, all);
        out.write(folder / "frames.dcm");
        if (dimension)
            expect_volumes(folder, {"dimension index 1", "dimension index 2"});
        else
            expect_volumes(folder, {"time point 1", "time point 2"});
    }
}

TEST(DicomVolumes, SiemensMosaicsAreVolumes) {
    TemporaryFolder folder;
    for (int volume = 0; volume < 2; ++volume) mosaic(volume).write(folder / std::to_string(volume));
    EXPECT_EQ(inspect_scan(folder.path()).series.at(0).volumes,
              (std::vector<std::string>{"acquisition 1", "acquisition 2"}));
    ScanOptions options;
    for (const int volume : {0, 1}) {
        options.volume = volume;
        const Volume v = read_scan(folder.path(), options);
        // The slices go down, and volumes are sorted upwards. Nine columns of 0.25 mm become three.
        std::vector<std::int16_t> expected;
        for (int k = 4; k >= 0; --k) {
            const auto samples = slice_samples(10 * volume + k);
            expected.insert(expected.end(), samples.begin(), samples.end());
        }
        EXPECT_EQ(samples_of<std::int16_t>(v), expected);
        expect_at(v.geometry(), {0, 0, 4}, {10 + 0.75, 20 + 1, 30});
        expect_at(v.geometry(), {1, 1, 0}, {10 + 1, 20 + 1.5, 20});
    }
}

TEST(DicomVolumes, MosaicsWithoutWhatPlacesTheirSlicesAreRefusedByName) {
    const std::vector<std::pair<const char*, std::function<void(DicomWriter&)>>> changes = {
        {"private CSA header", [](DicomWriter& s) { s.elements.erase(0x00291110); }},
        {"private CSA header",
         [](DicomWriter& s) {
             s.elements[0x00291110] = {"OB", "SV10"};
         }},
        {"private CSA header",
         [](DicomWriter& s) {
             s.elements[0x00291110].second = csa_header({"5"}, {"0", "1"});
         }},
        {"normal of length 1",
         [](DicomWriter& s) {
             s.elements[0x00291110].second = csa_header({"5"}, {"0", "1", "1"});
         }},
        {"private CSA header",
         [](DicomWriter& s) {
             s.elements[0x00291110].second = csa_header({"1e9"}, {"0", "0", "1"});
         }},
        {"do not fit",
         [](DicomWriter& s) {
             s.elements[0x00291110].second = csa_header({"17"}, {"0", "0", "1"});
         }},
        {"SpacingBetweenSlices", [](DicomWriter& s) { s.elements.erase(0x00180088); }}};
    for (const auto& [part, change] : changes) {
        TemporaryFolder folder;
        DicomWriter s = mosaic(0);
        change(s);
        s.write(folder / "a");
        const std::string what = refusal<InputError>(folder.path());
        contains(what, "is a Siemens mosaic");
        contains(what, part);
    }
}

TEST(DicomVolumes, RtDoseIsAVolumeInItsUnits) {
    for (const bool absolute : {false, true}) {
        TemporaryFolder folder;
        DicomWriter s;
        s.text(0x00080016, "UI", "1.2.840.10008.5.1.4.1.1.481.2");
        s.text(0x00080060, "CS", "RTDOSE");
        s.text(0x00280008, "IS", "3");
        s.text(0x3004000c, "DS", absolute ? "7\\4\\1" : "0\\-3\\-6");
        s.text(0x3004000e, "DS", "0.5");
        s.elements.erase(0x00281052);
        s.elements.erase(0x00281053);
        s.position("10\\20\\7");
        s.pixel_format(32, 32, false);
        std::vector<std::uint32_t> samples;
        for (std::uint32_t i = 0; i < 18; ++i) samples.push_back(100001 * i);
        s.pixels(columns, rows, samples);
        for (const Form form : {Form::explicit_little, Form::explicit_big}) {
            s.form = form;
            if (form == Form::explicit_big) {  // the writer swaps words of two bytes; these have four
                std::string& bytes = s.elements[0x7fe00010].second;
                for (std::size_t i = 0; i < bytes.size(); i += 4) {
                    std::swap(bytes[i], bytes[i + 2]);
                    std::swap(bytes[i + 1], bytes[i + 3]);
                }
            }
            s.write(folder / "dose");
            const Volume v = read_scan(folder / "dose");
            expect_at(v.geometry(), {0, 0, 0}, {10, 20, 1});
            expect_at(v.geometry(), {1, 1, 2}, {11, 21, 7});
            const auto read = samples_of<float>(v);
            ASSERT_EQ(read.size(), 18u);
            EXPECT_FLOAT_EQ(read[12 + 5], 0.5f * 100001 * 5);  // the first frame is the highest
            EXPECT_FLOAT_EQ(read[1], 0.5f * 100001 * 13);
        }
        s.form = Form::explicit_little;
        s.text(0x3004000c, "DS", "1\\4\\7");
        s.write(folder / "dose");
        contains(refusal<InputError>(folder.path()), "GridFrameOffsetVector");
    }
}

}  // namespace
}  // namespace marrow::test
