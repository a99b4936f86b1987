// Volumes made of images: TIFF files with several pages, and folders of slices.
#include <gtest/gtest.h>

#include <tiffio.h>

#include <marrow/error.h>

#include "support/reading_checks.h"
#include "support/small_scans.h"

namespace marrow::test {
namespace {

using namespace std::string_literals;

TEST(ImageStack, FolderOfSlicesInNaturalOrder) {
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
    contains(refusal<GeometryError>(folder.path()), "options.spacing");
    ScanInfo info;
    const Volume v = read_scan(folder.path(), options, &info);
    EXPECT_EQ(samples_of<std::uint16_t>(v), expected);
    expect_at(v.geometry(), {2, 1, 11}, {1, 0.5, 22});
    EXPECT_EQ(info.format, ScanFormat::slices);
    EXPECT_EQ(info.series.files, 12u);

    write_file(folder / "slice 5.png", png(2, 2, std::vector<std::uint16_t>{1, 2, 3, 4}));
    contains(refusal<InputError>(folder.path(), options), "slice 5.png");
}

TEST(ImageStack, WarnsWhereTheNumbersOfSlicesSkip) {
    const auto warnings_for = [](const std::vector<std::string>& names) {
        TemporaryFolder folder;
        for (const std::string& name : names)
            write_file(folder / name, png(2, 1, std::vector<std::uint16_t>{1, 2}));
        ScanOptions options;
        options.spacing = Vec3d{1, 1, 1};
        ScanInfo info;
        read_scan(folder.path(), options, &info);
        EXPECT_EQ(inspect_scan(folder.path(), options).series[0].warnings, info.warnings);
        return info.warnings;
    };
    const auto gap = warnings_for({"s8.png", "s9.png", "s10.png", "s12.png", "s13.png"});
    ASSERT_EQ(gap.size(), 1u);
    contains(gap[0], "grow by 2 from 's10.png' to 's12.png' and by 1 elsewhere");
    EXPECT_TRUE(warnings_for({"ct3_008.png", "ct3_009.png", "ct3_010.png"}).empty());
    EXPECT_TRUE(warnings_for({"2.png", "4.png", "6.png"}).empty()) << "evenly";
    EXPECT_TRUE(warnings_for({"a.png", "b.png", "d.png", "d2.png"}).empty()) << "without numbers";
    EXPECT_TRUE(warnings_for({"1.png"}).empty());
    // One name that does not fit hides no gap.
    const auto other = warnings_for({"average.png", "s1.png", "s2.png", "s5.png", "s6.png"});
    ASSERT_EQ(other.size(), 2u);
    contains(other[0], "'average.png' and 's1.png' are named differently");
    contains(other[1], "grow by 3 from 's2.png' to 's5.png' and by 1 elsewhere");
}

// As git-annex leaves what it has not fetched.
TEST(ImageStack, LinksThatLeadNowhereAreWarnedOf) {
    const TemporaryFolder folder;
    for (const char* name : {"s1.png", "s2.png"})
        write_file(folder / name, png(2, 1, std::vector<std::uint16_t>{1, 2}));
    fs::create_symlink("nowhere", folder / "s3.png");
    ScanOptions options;
    options.spacing = Vec3d{1, 1, 1};
    ScanInfo info;
    EXPECT_EQ(read_scan(folder.path(), options, &info).geometry().dims[2], 2);
    ASSERT_EQ(info.warnings.size(), 1u);
    contains(info.warnings[0], "1 link to files that are missing, for example");
    EXPECT_EQ(inspect_scan(folder.path(), options).warnings, info.warnings);
}

TEST(ImageStack, EightBitsAndColour) {
    TemporaryFolder folder;
    ScanOptions options;
    options.spacing = Vec3d{1, 1, 1};
    const std::vector<std::uint8_t> grey = {0, 1, 2, 253, 254, 255};
    EXPECT_EQ(samples_of<std::uint8_t>(read_scan(write_file(folder / "a.png", png(3, 2, grey)), options)),
              grey);
    contains(refusal<InputError>(write_file(folder / "b.png", png(2, 1, grey, 3)), options), "colour");
}

// Files with several channels, which hold the same grey image if the channels are equal.
class ImageChannels : public testing::Test {
  protected:
    static constexpr int columns = 16, rows = 8;

    ImageChannels() {
        options.spacing = Vec3d{1, 1, 1};
        for (int i = 0; i < columns * rows; ++i) grey.push_back(static_cast<std::uint8_t>(i));
    }

    // A TIFF of grey and opacity, RGB, or RGB and opacity; `odd` changes a sample.
    fs::path tiff_of(std::uint16_t channels, bool tiled, std::uint8_t odd) const {
        std::vector<std::uint8_t> samples = in_channels(grey, channels);
        samples[5] ^= odd;
        const fs::path path = folder / "t.tif";
        TIFF* out = TIFFOpen(path.c_str(), "w");
        TIFFSetField(out, TIFFTAG_IMAGEWIDTH, columns);
        TIFFSetField(out, TIFFTAG_IMAGELENGTH, rows);
        TIFFSetField(out, TIFFTAG_BITSPERSAMPLE, 8);
        TIFFSetField(out, TIFFTAG_SAMPLESPERPIXEL, channels);
        TIFFSetField(out, TIFFTAG_PHOTOMETRIC, channels == 2 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB);
        TIFFSetField(out, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
        if (tiled) {
            TIFFSetField(out, TIFFTAG_TILEWIDTH, 16);
            TIFFSetField(out, TIFFTAG_TILELENGTH, 16);
            samples.resize(16u * 16u * channels);
            TIFFWriteTile(out, samples.data(), 0, 0, 0, 0);
        } else {
            for (int row = 0; row < rows; ++row)
                TIFFWriteScanline(out, samples.data() + row * columns * channels,
                                  static_cast<std::uint32_t>(row), 0);
        }
        TIFFClose(out);
        return path;
    }

    Volume read(const fs::path& path) const { return read_scan(path, options); }
    void expect_grey(const fs::path& path) const { EXPECT_EQ(samples_of<std::uint8_t>(read(path)), grey); }
    void expect_colour(const fs::path& path) const { contains(refusal<InputError>(path, options), "colour"); }

    const TemporaryFolder folder;
    ScanOptions options;
    std::vector<std::uint8_t> grey;
};

TEST_F(ImageChannels, EqualChannelsAreGrey) {
    expect_grey(write_file(folder / "a.bmp", bmp(columns, rows, grey, false, 24)));
    expect_grey(write_file(folder / "a.bmp", bmp(columns, rows, grey, false, 32)));
    expect_grey(tiff_of(2, false, 0));
    expect_grey(tiff_of(3, false, 0));
    expect_grey(tiff_of(4, true, 0));
    // JPEG is lossy, but equal channels stay equal: the result is that of one channel.
    EXPECT_EQ(samples_of<std::uint8_t>(
                  read(write_file(folder / "a.jpg", jpeg_8(columns, rows, in_channels(grey, 3), 3)))),
              samples_of<std::uint8_t>(read(write_file(folder / "b.jpg", jpeg_8(columns, rows, grey)))));
}

TEST_F(ImageChannels, OtherChannelsAreColour) {
    expect_colour(tiff_of(3, false, 1));
    expect_colour(tiff_of(4, true, 1));
    expect_colour(write_file(folder / "a.bmp", bmp(columns, rows, grey, true, 24)));
    std::vector<std::uint8_t> red = in_channels(grey, 3);
    for (std::size_t i = 0; i < red.size(); i += 3) red[i] = 255;
    expect_colour(write_file(folder / "a.jpg", jpeg_8(columns, rows, red, 3)));
}

TEST_F(ImageChannels, PngMayHaveOpaqueChannels) {
    std::vector<std::uint16_t> grey16;
    for (int i = 0; i < columns * rows; ++i) grey16.push_back(static_cast<std::uint16_t>(500 * i));
    for (const int channels : {2, 3, 4}) {
        SCOPED_TRACE(channels);
        auto samples = in_channels(grey16, channels);
        if (channels == 2) {  // grey and opacity
            samples.clear();
            for (const std::uint16_t sample : grey16) samples.insert(samples.end(), {sample, 65535});
        }
        EXPECT_EQ(samples_of<std::uint16_t>(
                      read(write_file(folder / "a.png", png(columns, rows, samples, channels)))),
                  grey16);
        samples.back() ^= 1;
        const std::string why =
            refusal<InputError>(write_file(folder / "a.png", png(columns, rows, samples, channels)), options);
        contains(why, channels == 3 ? "colour" : "transparent");
    }
}

TEST(ImageStack, ADifferentSliceIsNamedBeforeSamplesAreRead) {
    TemporaryFolder folder;
    ScanOptions options;
    options.spacing = Vec3d{1, 1, 1};
    for (int k = 0; k < 4; ++k)
        write_file(folder / (std::to_string(k) + ".png"),
                   png(2, k == 2 ? 3 : 2, std::vector<std::uint8_t>(6)));
    contains(refusal<InputError>(folder.path(), options), "2.png");
    try {
        inspect_scan(folder.path(), options);
        ADD_FAILURE();
    } catch (const InputError& error) {
        contains(error.what(), "2.png");
    }
}

TEST(ImageStack, ProgressGrowsAndStops) {
    TemporaryFolder folder;
    for (int k = 0; k < 8; ++k)
        write_file(folder / (std::to_string(k) + ".png"), png(2, 2, std::vector<std::uint8_t>(4)));
    ScanOptions options;
    options.spacing = Vec3d{1, 1, 1};
    double last = 0;
    options.progress = [&](double fraction) {
        EXPECT_GE(fraction, last);
        last = fraction;
        return true;
    };
    read_scan(folder.path(), options);
    EXPECT_EQ(last, 1);
    for (int calls = 1; calls <= 18; ++calls) {  // the start and 8 files, twice
        int left = calls;
        options.progress = [&](double) { return --left > 0; };
        options.threads = calls % 2 + 1;
        EXPECT_THROW(read_scan(folder.path(), options), Cancelled) << calls;
    }
}

TEST(ImageStack, TiffOfSeveralPages) {
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
    EXPECT_EQ(info.format, ScanFormat::tiff);
    contains(refusal<GeometryError>(path), "options.spacing");
}

// A TIFF of pages of 2 x 2 samples, each page with its number, and with `more` bytes at the end.
fs::path described_tiff(const fs::path& path, int pages, const std::string& description,
                        const std::string& more = "") {
    TIFF* out = TIFFOpen(path.c_str(), "w");
    for (int page = 0; page < pages; ++page) {
        TIFFSetField(out, TIFFTAG_IMAGEWIDTH, 2);
        TIFFSetField(out, TIFFTAG_IMAGELENGTH, 2);
        TIFFSetField(out, TIFFTAG_BITSPERSAMPLE, 8);
        TIFFSetField(out, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
        if (page == 0) TIFFSetField(out, TIFFTAG_IMAGEDESCRIPTION, description.c_str());
        std::array<std::uint8_t, 4> samples;
        samples.fill(static_cast<std::uint8_t>(page));
        TIFFWriteScanline(out, samples.data(), 0, 0);
        TIFFWriteScanline(out, samples.data() + 2, 1, 0);
        TIFFWriteDirectory(out);
    }
    TIFFClose(out);
    return write_file(path, read_file(path) + more);
}

// ImageJ and OME put the slices of several channels or times into the pages of one file, one after the other.
TEST(ImageStack, TiffPagesOfSeveralChannelsOrTimesAreRefused) {
    const TemporaryFolder folder;
    ScanOptions options;
    options.spacing = Vec3d{1, 1, 1};
    const auto ome = [](int z, int c, int t) {
        return "<?xml version=\"1.0\"?><OME><Image><Pixels SizeZ=\"" + std::to_string(z) + "\" SizeC=\"" +
               std::to_string(c) + "\" SizeT=\"" + std::to_string(t) + "\"/></Image></OME>";
    };
    for (const std::string& description :
         {"ImageJ=1.53t\nimages=8\nchannels=2\nslices=4\nhyperstack=true\n"s,
          "ImageJ=1.53t\nimages=8\nslices=2\nframes=4\n"s, ome(4, 2, 1), ome(2, 1, 4)}) {
        SCOPED_TRACE(description);
        contains(refusal<InputError>(described_tiff(folder / "t.tif", 8, description), options),
                 "several channels or times");
    }
    for (const std::string& description :
         {"ImageJ=1.53t\nimages=8\nslices=8\n"s, "ImageJ=1.53t\nimages=8\nframes=8\n"s,
          "ImageJ=1.11a\nimages=8\nchannels=8\n"s, ome(8, 1, 1), ome(8, 2, 1), "channels=2"s}) {
        SCOPED_TRACE(description);
        EXPECT_EQ(read_scan(described_tiff(folder / "t.tif", 8, description), options).geometry().dims[2], 8);
    }
}

// ImageJ has no signed samples: it states what is to be added.
TEST(ImageStack, TiffOfCalibratedValuesIsRefused) {
    const TemporaryFolder folder;
    ScanOptions options;
    options.spacing = Vec3d{1, 1, 1};
    const auto calibrated = [&](const std::string& by) {
        return described_tiff(folder / "t.tif", 2, "ImageJ=1.53t\nimages=2\nslices=2\n" + by);
    };
    contains(refusal<InputError>(calibrated("cf=0\nc0=-32768.0\nc1=1.0\nvunit=gray\n"), options),
             "ImageJ's calibration");
    refusal<InputError>(calibrated("c1=0.5\n"), options);
    EXPECT_EQ(read_scan(calibrated("cf=0\nc0=0.0\nc1=1.0\n"), options).geometry().dims[2], 2);
    EXPECT_EQ(read_scan(calibrated("min=0.0\nmax=255.0\n"), options).geometry().dims[2], 2);
}

// Beyond 4 GiB, ImageJ describes the first image alone. A page that another program took out of a stack still
// has the stack's description.
TEST(ImageStack, ATiffOfImageJWhosePagesAreNotDescribedIsRefused) {
    const TemporaryFolder folder;
    ScanOptions options;
    options.spacing = Vec3d{1, 1, 1};
    const std::string description = "ImageJ=1.53t\nimages=200\nslices=200\n";
    contains(refusal<InputError>(
                 described_tiff(folder / "t.tif", 1, description, std::string(std::size_t{4} * 199, '\1')),
                 options),
             "200 images");
    EXPECT_EQ(read_scan(described_tiff(folder / "t.tif", 1, description), options).geometry().dims[2], 1);
    // So does tifffile on request.
    const auto truncated = [&](const std::string& sizes, std::size_t others) {
        return described_tiff(folder / "t.tif", 1, "{\"shape\": [" + sizes + "], \"truncated\": true}",
                              std::string(4 * others, '\1'));
    };
    contains(refusal<InputError>(truncated("20, 10, 2, 2", 199), options),
             "one of its 200 images, as tifffile");
    EXPECT_EQ(read_scan(truncated("200, 2, 2", 0), options).geometry().dims[2], 1);
    EXPECT_EQ(read_scan(truncated("2, 2", 199), options).geometry().dims[2], 1);
}

// tifffile writes a volume as one page if it is told so.
TEST(ImageStack, ATiffWhosePageIsAVolumeIsRefused) {
    const TemporaryFolder folder;
    ScanOptions options;
    options.spacing = Vec3d{1, 1, 1};
    std::string bytes = tiff(3, 2, {{1, 2, 3, 4, 5, 6}});
    bytes.replace(bytes.find(bytes_of(std::uint16_t{60000})), 2,
                  bytes_of(std::uint16_t{TIFFTAG_IMAGEDEPTH}));  // the private tag has the value 7
    contains(refusal<InputError>(write_file(folder / "t.tif", bytes), options), "holds 7 slices in one page");
}

// A TIFF of two columns, in one strip or tile.
template <class T>
fs::path tiff_of_type(const fs::path& path, int format, const std::vector<T>& samples, bool tiled) {
    constexpr std::uint32_t columns = 2, side = 16;
    const auto rows = static_cast<std::uint32_t>(samples.size()) / columns;
    TIFF* out = TIFFOpen(path.c_str(), "w");
    TIFFSetField(out, TIFFTAG_IMAGEWIDTH, columns);
    TIFFSetField(out, TIFFTAG_IMAGELENGTH, rows);
    TIFFSetField(out, TIFFTAG_BITSPERSAMPLE, static_cast<int>(8 * sizeof(T)));
    TIFFSetField(out, TIFFTAG_SAMPLEFORMAT, format);
    TIFFSetField(out, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    std::vector<T> padded(side * side);
    for (std::size_t i = 0; i < samples.size(); ++i)
        padded[(tiled ? side : columns) * (i / columns) + i % columns] = samples[i];
    if (tiled) {
        TIFFSetField(out, TIFFTAG_TILEWIDTH, side);
        TIFFSetField(out, TIFFTAG_TILELENGTH, side);
        TIFFWriteTile(out, padded.data(), 0, 0, 0, 0);
    } else {
        for (std::uint32_t row = 0; row < rows; ++row)
            TIFFWriteScanline(out, padded.data() + columns * row, row, 0);
    }
    TIFFClose(out);
    return path;
}

TEST(ImageStack, TiffOfTypesThatAVolumeLacksBecomesFloat64) {
    const TemporaryFolder folder;
    ScanOptions options;
    options.spacing = Vec3d{1, 1, 1};
    const auto expect_values = [&]<class T>(int format, const std::vector<T>& samples) {
        const std::vector<double> values(samples.begin(), samples.end());
        for (const bool tiled : {false, true})
            EXPECT_EQ(samples_of<double>(
                          read_scan(tiff_of_type(folder / "t.tif", format, samples, tiled), options)),
                      values);
    };
    constexpr std::int64_t exact = (std::int64_t{1} << 53) - 1;
    expect_values(SAMPLEFORMAT_UINT, std::vector<std::uint32_t>{0, 1, 70000, 0xffffffff});
    expect_values(SAMPLEFORMAT_INT, std::vector<std::int64_t>{-exact, -1, 0, 5, 70000, exact});
    expect_values(SAMPLEFORMAT_UINT, std::vector<std::uint64_t>{0, 1, 0xffffffff, std::uint64_t{exact}});
    const std::vector<std::uint64_t> beyond{0, 1, 2, std::uint64_t{exact} + 1};
    contains(refusal<InputError>(tiff_of_type(folder / "t.tif", SAMPLEFORMAT_UINT, beyond, false), options),
             "t.tif': a 64-bit sample is beyond 2^53");
    contains(refusal<InputError>(
                 tiff_of_type(folder / "t.tif", SAMPLEFORMAT_IEEEFP, std::vector<std::uint16_t>(4), false),
                 options),
             "integers of 8 to 64 bits, float32 or float64");
}

TEST(ImageStack, BmpRunsFromTheBottom) {
    TemporaryFolder folder;
    ScanOptions options;
    options.spacing = Vec3d{1, 1, 1};
    const std::vector<std::uint8_t> grey = {0, 1, 2, 253, 254, 255};
    const std::string whole = bmp(3, 2, grey, false);
    EXPECT_EQ(samples_of<std::uint8_t>(read_scan(write_file(folder / "a.bmp", whole), options)), grey);
    refusal<InputError>(write_file(folder / "a.bmp", whole.substr(0, whole.size() - 1)), options);
    contains(refusal<InputError>(write_file(folder / "a.bmp", bmp(3, 2, grey, true)), options), "colour");
}

TEST(ImageStack, JpegWholeOrNotAtAll) {
    TemporaryFolder folder;
    ScanOptions options;
    options.spacing = Vec3d{1, 1, 1};
    const std::string whole = jpeg_8(16, 24, std::vector<std::uint8_t>(16 * 24, 99));
    EXPECT_EQ(samples_of<std::uint8_t>(read_scan(write_file(folder / "a.jpg", whole), options)),
              std::vector<std::uint8_t>(16 * 24, 99));
    for (std::size_t size = 0; size < whole.size(); ++size) {
        write_file(folder / "a.jpg", whole.substr(0, size));
        EXPECT_THROW(read_scan(folder / "a.jpg", options), InputError) << size;
    }
}

TEST(ImageStack, JpegOfManyScansIsRefused) {
    TemporaryFolder folder;
    ScanOptions options;
    options.spacing = Vec3d{1, 1, 1};
    write_file(folder / "a.jpg", jpeg_of_many_scans(100));
    EXPECT_NO_THROW(read_scan(folder / "a.jpg", options));
    write_file(folder / "a.jpg", jpeg_of_many_scans(800));
    refusal<InputError>(folder / "a.jpg", options);
}

TEST(ImageStack, TiledTiff) {
    TemporaryFolder folder;
    constexpr std::uint32_t width = 37, height = 21, side = 16;  // tiles extend beyond two edges
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
