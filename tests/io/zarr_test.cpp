// Zarr arrays that are damaged, incomplete or hostile. Their samples are compared with zarr's in
// bindings/python/tests/test_zarr.py.
#include <gtest/gtest.h>

#include <marrow/error.h>

#include "support/reading_checks.h"
#include "support/scan_files.h"

namespace marrow::test {
namespace {

constexpr const char* kTwoChunks =
    R"({"zarr_format":2,"shape":[2,1,2],"chunks":[1,1,2],"dtype":"|u1","compressor":null,"fill_value":7,
        "order":"C","filters":null})";
// The same samples in one shard, of which the chunks are the halves.
constexpr const char* kShard =
    R"({"zarr_format":3,"node_type":"array","shape":[2,1,2],"data_type":"uint8","fill_value":7,
        "chunk_grid":{"name":"regular","configuration":{"chunk_shape":[2,1,2]}},
        "chunk_key_encoding":{"name":"default"},"attributes":{},
        "codecs":[{"name":"sharding_indexed","configuration":{"chunk_shape":[1,1,2],
          "codecs":[{"name":"bytes"}],"index_codecs":[{"name":"bytes"}]}}]})";

ScanOptions with_spacing() {
    ScanOptions options;
    options.spacing = Vec3d{1, 1, 1};
    return options;
}

TEST(ReadZarr, ChunksThatAreMissingHaveTheFillValue) {
    const TemporaryFolder folder;
    write_file(folder / "z/.zarray", kTwoChunks);
    write_file(folder / "z/1.0.0", "\1\2");
    write_file(folder / "s/zarr.json", kShard);
    EXPECT_EQ(samples_of<std::uint8_t>(read_scan(folder / "z", with_spacing())),
              (std::vector<std::uint8_t>{7, 7, 1, 2}));
    EXPECT_EQ(samples_of<std::uint8_t>(read_scan(folder / "s", with_spacing())),
              std::vector<std::uint8_t>(4, 7));
}

// git-annex and DataLad leave such links for files that are not on this machine.
TEST(ReadZarr, ChunksWhoseLinkLeadsNowhereAreRefused) {
    const TemporaryFolder folder;
    write_file(folder / "z/.zarray", kTwoChunks);
    write_file(folder / "z/0.0.0", "\1\2");
    write_file(folder / "s/zarr.json", kShard);
    fs::create_directories(folder / "s/c/0/0");
    fs::create_symlink(folder / "annex", folder / "z/1.0.0");
    fs::create_symlink(folder / "annex", folder / "s/c/0/0/0");
    for (const char* array : {"z", "s"})
        contains(refusal<IoError>(folder / array, with_spacing()),
                 "is a link to a file that is missing; fetch it first");
    write_file(folder / "annex", "\3\4");
    EXPECT_EQ(samples_of<std::uint8_t>(read_scan(folder / "z", with_spacing())),
              (std::vector<std::uint8_t>{1, 2, 3, 4}));
}

// A name alone stands for an extension without a configuration.
TEST(ReadZarr, ExtensionsMayBeNamesAlone) {
    const TemporaryFolder folder;
    std::string text = kShard;
    for (const std::string name : {"bytes", "default"}) {
        const std::string whole = R"({"name":")" + name + R"("})";
        ASSERT_NE(text.find(whole), text.npos);
        for (std::size_t at; (at = text.find(whole)) != text.npos;)
            text.replace(at, whole.size(), "\"" + name + "\"");
    }
    write_file(folder / "s/zarr.json", text);
    EXPECT_EQ(samples_of<std::uint8_t>(read_scan(folder / "s", with_spacing())),
              std::vector<std::uint8_t>(4, 7));
    text.replace(text.find("\"bytes\""), 7, "\"vlen\"");
    write_file(folder / "s/zarr.json", text);
    contains(refusal<InputError>(folder / "s", with_spacing()), "the codec 'vlen' is not supported");
}

TEST(ReadZarr, UnitsAreThoseOfTheSpecification) {
    const TemporaryFolder folder;
    write_file(folder / "i/.zgroup", R"({"zarr_format":2})");
    write_file(folder / "i/0/.zarray", kTwoChunks);
    const auto with_unit = [&](const std::string& unit) {
        std::string axes;
        for (const char* name : {"z", "y", "x"})
            axes += std::string(axes.empty() ? "" : ",") + R"({"type":"space","name":")" + name +
                    R"(","unit":")" + unit + "\"}";
        write_file(folder / "i/.zattrs", R"({"multiscales":[{"version":"0.4","axes":[)" + axes +
                                             R"(],"datasets":[{"path":"0","coordinateTransformations":[)"
                                             R"({"type":"scale","scale":[1,1,1]}]}]}]})");
        return folder / "i";
    };
    for (const auto& [unit, mm] : {std::pair{"femtometer", 1e-12},
                                   {"picometer", 1e-9},
                                   {"angstrom", 1e-7},
                                   {"nanometer", 1e-6},
                                   {"micrometer", 1e-3},
                                   {"millimeter", 1.0},
                                   {"centimetre", 10.0},
                                   {"decimeter", 100.0},
                                   {"inch", 25.4},
                                   {"foot", 304.8},
                                   {"yard", 914.4},
                                   {"meter", 1e3},
                                   {"hectometer", 1e5},
                                   {"kilometer", 1e6},
                                   {"mile", 1609344.0},
                                   {"megameter", 1e9}}) {
        SCOPED_TRACE(unit);
        EXPECT_EQ(read_scan(with_unit(unit)).geometry().spacing, (Vec3d{mm, mm, mm}));
    }
    // The message names the file that states the unit.
    for (const char* unit : {"furlong", "odometer", "pixel"}) {
        const std::string why = refusal<InputError>(with_unit(unit));
        contains(why, "i/.zattrs': Zarr metadata: the unit '" + std::string(unit) + "' is unknown");
    }
}

TEST(ReadZarr, DeepMetadataAreRefused) {
    const TemporaryFolder folder;
    const std::string deep = std::string(3'000'000, '[') + std::string(3'000'000, ']');
    for (const std::string where : {R"("fill_value":7)", R"("compressor":null)"}) {
        std::string text = kTwoChunks;
        text.replace(text.find(where), where.size(), where.substr(0, where.find(':') + 1) + deep);
        write_file(folder / "z/.zarray", text);
        contains(refusal<InputError>(folder / "z", with_spacing()), "nested too deeply");
    }
    std::string text = kShard;
    text.replace(text.find("{}"), 2, "{\"a\":" + deep + "}");
    write_file(folder / "s/zarr.json", text);
    contains(refusal<InputError>(folder / "s", with_spacing()), "nested too deeply");
}

TEST(InspectZarr, ImpossibleSizesAreRefused) {
    const TemporaryFolder folder;
    std::string text = kTwoChunks;
    text.replace(text.find("[2,1,2]"), 7, "[9007199254740992,9007199254740992,3]");
    write_file(folder / "z/.zarray", text);
    const ScanReport report = inspect_scan(folder / "z", with_spacing());
    ASSERT_EQ(report.series.size(), 1u);
    ASSERT_TRUE(report.series[0].refusal);
    contains(*report.series[0].refusal, (folder / "z").string());
    contains(*report.series[0].refusal, "is out of range");
    EXPECT_EQ(report.series[0].memory, 0u);
    contains(refusal<GeometryError>(folder / "z", with_spacing()), (folder / "z").string());
}

}  // namespace
}  // namespace marrow::test
