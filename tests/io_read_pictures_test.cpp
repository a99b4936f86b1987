// Slices as pictures.
#include <gtest/gtest.h>

#include <tiffio.h>

#include <marrow/error.h>

#include "reading_checks.h"
#include "small_scans.h"

namespace marrow::test {
namespace {

TEST(ReadPictures, FolderOfSlicesInNaturalOrder) {
    TemporaryFolder folder;
    ScanOptions options;
    options.spacing = Vec3d{0.5, 0.5, 2};
    std::vector<std::uint16_t> expected;
    for (int k = 1; k <= 12; ++k) {  // "slice 2" comes before "slice 10"
        const std::vector<std::uint16_t> slice = {1, 2, static_cast<std::uint16_t>(1000 * k), 4, 5, 65535};
        write_file(folder / ("slice " + std::to_string(k) + ".png"), png(3, 2, slice));
        expected.insert(expected.end(), slice.begin(), slice.end());
    }
    write_file(folder / "notes.txt", "not a slice");
    contains(refusal<GeometryError>(folder.path()), "--spacing");
    ScanInfo info;
    const Volume v = read_scan(folder.path(), options, &info);
    EXPECT_EQ(samples_of<std::uint16_t>(v), expected);
    expect_at(v.geometry(), {2, 1, 11}, {1, 0.5, 22});
    EXPECT_EQ(info.format, "slices");
    EXPECT_EQ(info.series.files, 12u);

    write_file(folder / "slice 5.png", png(2, 2, std::vector<std::uint16_t>{1, 2, 3, 4}));
    contains(refusal<InputError>(folder.path(), options), "slice 5.png");
}

TEST(ReadPictures, EightBitsAndColour) {
    TemporaryFolder folder;
    ScanOptions options;
    options.spacing = Vec3d{1, 1, 1};
    const std::vector<std::uint8_t> grey = {0, 1, 2, 253, 254, 255};
    EXPECT_EQ(samples_of<std::uint8_t>(read_scan(write_file(folder / "a.png", png(3, 2, grey)), options)),
              grey);
    contains(refusal<InputError>(write_file(folder / "b.png", png(2, 1, grey, 3)), options), "colour");
}

TEST(ReadPictures, TiffOfSeveralPages) {
    TemporaryFolder folder;
    ScanOptions options;
    options.spacing = Vec3d{1, 1, 3};
    const fs::path path =
        write_file(folder / "t.tif", tiff(3, 2, {{1, 2, 3, 4, 5, 6}, {7, 8, 9, 10, 11, 65535}}));
    testing::internal::CaptureStderr();
    ScanInfo info;
    const Volume v = read_scan(path, options, &info);
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    EXPECT_EQ(samples_of<std::uint16_t>(v),
              (std::vector<std::uint16_t>{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 65535}));
    EXPECT_EQ(v.geometry().dims[2], 2);
    EXPECT_EQ(info.format, "TIFF");
    contains(refusal<GeometryError>(path), "--spacing");
}

TEST(ReadPictures, BmpRunsFromTheBottom) {
    TemporaryFolder folder;
    ScanOptions options;
    options.spacing = Vec3d{1, 1, 1};
    const std::vector<std::uint8_t> grey = {0, 1, 2, 253, 254, 255};
    const std::string whole = bmp(3, 2, grey, false);
    EXPECT_EQ(samples_of<std::uint8_t>(read_scan(write_file(folder / "a.bmp", whole), options)), grey);
    refusal<InputError>(write_file(folder / "a.bmp", whole.substr(0, whole.size() - 1)), options);
    contains(refusal<InputError>(write_file(folder / "a.bmp", bmp(3, 2, grey, true)), options), "colour");
}

TEST(ReadPictures, JpegWholeOrNotAtAll) {
    TemporaryFolder folder;
    ScanOptions options;
    options.spacing = Vec3d{1, 1, 1};
    const std::string whole = grey_jpeg_8(16, 24, std::vector<std::uint8_t>(16 * 24, 99));
    EXPECT_EQ(samples_of<std::uint8_t>(read_scan(write_file(folder / "a.jpg", whole), options)),
              std::vector<std::uint8_t>(16 * 24, 99));
    for (std::size_t size = 0; size < whole.size(); ++size) {
        write_file(folder / "a.jpg", whole.substr(0, size));
        EXPECT_THROW(read_scan(folder / "a.jpg", options), InputError) << size;
    }
}

TEST(ReadPictures, TiledTiff) {
    TemporaryFolder folder;
    constexpr std::uint32_t width = 37, height = 21, side = 16;  // tiles reach beyond two edges
    TIFF* out = TIFFOpen((folder / "t.tif").c_str(), "w");
    for (std::uint32_t page = 0; page < 2; ++page) {
        TIFFSetField(out, TIFFTAG_IMAGEWIDTH, width);
        TIFFSetField(out, TIFFTAG_IMAGELENGTH, height);
        TIFFSetField(out, TIFFTAG_BITSPERSAMPLE, 16);
        TIFFSetField(out, TIFFTAG_SAMPLESPERPIXEL, 1);
        TIFFSetField(out, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
        TIFFSetField(out, TIFFTAG_TILEWIDTH, side);
        TIFFSetField(out, TIFFTAG_TILELENGTH, side);
        TIFFSetField(out, TIFFTAG_COMPRESSION, page ? COMPRESSION_LZW : COMPRESSION_NONE);
        for (std::uint32_t y = 0; y < height; y += side) {
            for (std::uint32_t x = 0; x < width; x += side) {
                std::vector<std::uint16_t> tile;
                for (std::uint32_t i = 0; i < side * side; ++i)
                    tile.push_back(
                        static_cast<std::uint16_t>(10000 * page + 100 * (y + i / side) + x + i % side));
                TIFFWriteTile(out, tile.data(), x, y, 0, 0);
            }
        }
        TIFFWriteDirectory(out);
    }
    TIFFClose(out);
    ScanOptions options;
    options.spacing = Vec3d{1, 1, 1};
    const auto read = samples_of<std::uint16_t>(read_scan(folder / "t.tif", options));
    ASSERT_EQ(read.size(), 2 * width * height);
    for (std::uint32_t i = 0; i < read.size(); ++i) {
        const std::uint32_t page = i / (width * height), y = i / width % height, x = i % width;
        ASSERT_EQ(read[i], 10000 * page + 100 * y + x) << i;
    }
}

}  // namespace
}  // namespace marrow::test
