// `marrow --picture`: what the picture shows.
#include <cstdlib>

#include <gtest/gtest.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGReader.h>

#include <marrow/isosurface.h>

#include "drawing.h"
#include "render.h"
#include "shared/display.h"
#include "support/command_line.h"
#include "support/fields.h"
#include "support/scan_files.h"

// OpenGL drivers keep memory until the process ends. AddressSanitizer must not report that as a leak.
extern "C" const char* __asan_default_options() {
    return "detect_leaks=0";
}

namespace marrow::test {
namespace {

using Names = std::set<std::string>;

bool has_display() {
    try {
        require_display("--picture");
        return true;
    } catch (const IoError&) {
        return false;
    }
}

TEST(Picture, NamesXvfbIfThereIsNoDisplay) {
    const TemporaryFolder folder;
    write_nrrd(folder / "ball.nrrd", 24, 25, 13, ball(12, 12, 6, 8));
    const char* set = std::getenv("DISPLAY");
    const std::string display = set ? set : "";
    unsetenv("DISPLAY");
    const Outcome outcome = marrow_with({folder / "ball.nrrd", "--isovalue", "0", "-o", folder / "ball.stl",
                                         "--picture", folder / "ball.png"});
    if (set) setenv("DISPLAY", display.c_str(), 1);
    EXPECT_EQ(outcome.code, 3);
    EXPECT_NE(outcome.err.find("xvfb-run -a marrow"), outcome.err.npos) << outcome.err;
    EXPECT_EQ(folder.files(), Names{"ball.nrrd"});
}

TEST(Picture, BecomesNoSliceOfTheScan) {
    if (!has_display()) GTEST_SKIP() << "no display";
    const TemporaryFolder folder;
    for (const char* slice : {"1.png", "2.png", "3.png"})
        write_file(folder / slice, png<std::uint8_t>(2, 2, {0, 0, 9, 99}));
    const Outcome outcome = marrow_with({folder.path(), "--spacing", "1,1,1", "--isovalue", "50", "-o",
                                         folder / "a.stl", "--picture", folder / "4.png"});
    EXPECT_EQ(outcome.code, kUsage);
    EXPECT_NE(outcome.err.find("would become a slice"), outcome.err.npos) << outcome.err;
    EXPECT_EQ(folder.files(), (Names{"1.png", "2.png", "3.png"}));
}

// Seen from the patient's front left, head up: a ball above appears above, one on the patient's left to the
// right, and one in front hides what is behind it.
TEST(Picture, ShowsThePatientUprightFromTheFront) {
    if (!has_display()) GTEST_SKIP() << "no display";
    const TemporaryFolder folder;
    const auto main = ball(20, 20, 10, 8), above = ball(20, 20, 20, 4), left = ball(36, 20, 10, 3);
    write_nrrd(folder / "balls.nrrd", 42, 42, 26, [&](int x, int y, int z) {
        return std::max({main(x, y, z), above(x, y, z), left(x, y, z)});
    });
    const Outcome outcome =
        marrow_with({folder / "balls.nrrd", "--isovalue", "0", "--picture", folder / "balls.png", "-q"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(folder.files(), (Names{"balls.nrrd", "balls.png"}));

    vtkNew<vtkPNGReader> reader;
    reader->SetFileName((folder / "balls.png").c_str());
    reader->Update();
    vtkImageData* image = reader->GetOutput();
    const int width = image->GetDimensions()[0], height = image->GetDimensions()[1];
    ASSERT_EQ(width, 1600);
    ASSERT_EQ(height, 1200);

    // The balls are grey and brighter than the bluish background. Count them in three parts of their box.
    const auto is_ball = [&](int x, int y) {
        const auto* rgb = static_cast<const unsigned char*>(image->GetScalarPointer(x, y, 0));
        return rgb[0] + 10 > rgb[2];
    };
    int lowest_x = width, highest_x = -1, lowest_y = height, highest_y = -1;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            if (!is_ball(x, y)) continue;
            lowest_x = std::min(lowest_x, x), highest_x = std::max(highest_x, x);
            lowest_y = std::min(lowest_y, y), highest_y = std::max(highest_y, y);
        }
    }
    // The balls are centred, almost fill the picture, and are not cut off.
    EXPECT_GT(std::min(lowest_x, lowest_y), 10);
    EXPECT_LT(std::max(highest_x - width, highest_y - height), -10);
    EXPECT_TRUE(highest_x - lowest_x > width / 2 || highest_y - lowest_y > height / 2);
    EXPECT_NEAR(lowest_x + highest_x, width, width / 8);
    EXPECT_NEAR(lowest_y + highest_y, height, height / 8);

    const auto balls_in_row = [&](int y) {
        int n = 0;
        for (int x = 0; x < width; ++x) n += is_ball(x, y);
        return n;
    };
    const auto balls_in_column = [&](int x) {
        int n = 0;
        for (int y = 0; y < height; ++y) n += is_ball(x, y);
        return n;
    };
    const int box_height = highest_y - lowest_y, box_width = highest_x - lowest_x;
    // VTK's first row is at the bottom.
    EXPECT_LT(2 * balls_in_row(highest_y - box_height / 8), balls_in_row(lowest_y + box_height / 4));
    EXPECT_LT(2 * balls_in_column(highest_x - box_width / 10), balls_in_column(lowest_x + box_width / 4));
}

TEST(Drawing, BecomesAPngWithoutADisplay) {
    using Anchor = Words::Anchor;
    const Drawing drawing{60,
                          40,
                          {Area{5, 5, 20, 10, 0xFF8000}, Line{{{5, 20}, {55, 20}, {55, 30}}, 2, 0x0000FF},
                           Words{55, 14, Anchor::end, 0x000000, "888"}}};
    const TemporaryFolder folder;
    write_file(folder / "drawing.png", png_of(drawing));
    vtkNew<vtkPNGReader> reader;
    reader->SetFileName((folder / "drawing.png").c_str());
    reader->Update();
    vtkImageData* image = reader->GetOutput();
    ASSERT_EQ(image->GetDimensions()[0], 120);
    ASSERT_EQ(image->GetDimensions()[1], 80);
    const auto colour_at = [&](double x, double y) {
        const auto* rgb = static_cast<const unsigned char*>(
            image->GetScalarPointer(static_cast<int>(2 * x), 79 - static_cast<int>(2 * y), 0));
        return Rgb{rgb[0]} << 16 | Rgb{rgb[1]} << 8 | Rgb{rgb[2]};
    };
    EXPECT_EQ(colour_at(5, 5), 0xFF8000u);
    EXPECT_EQ(colour_at(24.5, 14.5), 0xFF8000u);
    for (const auto& [x, y] : {std::array{4.5, 10.0}, {25.0, 10.0}, {15.0, 4.5}, {15.0, 15.0}})
        EXPECT_EQ(colour_at(x, y), 0xFFFFFFu) << x << ' ' << y;
    for (const auto& [x, y] : {std::array{30.0, 19.5}, {30.0, 20.0}, {54.5, 25.0}})
        EXPECT_EQ(colour_at(x, y), 0x0000FFu) << x << ' ' << y;
    for (const auto& [x, y] : {std::array{30.0, 18.0}, {30.0, 21.5}, {30.0, 25.0}})
        EXPECT_EQ(colour_at(x, y), 0xFFFFFFu) << x << ' ' << y;
    int dark_before = 0, dark_after = 0;  // of the words' anchor
    for (double y = 0; y < 18; y += 0.5) {
        for (double x = 26; x < 60; x += 0.5)
            (x < 55.5 ? dark_before : dark_after) += colour_at(x, y) < 0x808080;
    }
    EXPECT_GT(dark_before, 50);
    EXPECT_EQ(dark_after, 0);
}

// The colours of points take the place of the surface's.
TEST(Picture, ShowsTheColoursOfPoints) {
    if (!has_display()) GTEST_SKIP() << "no display";
    const TemporaryFolder folder;
    const Volume volume = sampled_in_space<float>(grid(24, 24, 24), sphere({11.5, 11.5, 11.5}, 8));
    const Mesh mesh = extract_isosurface(volume, 0);
    const std::vector<Rgb8> red(mesh.points.size(), Rgb8{200, 0, 0});
    const auto red_pixels = [&](std::span<const Rgb8> colours) {
        render({{&mesh, {0.8, 0.8, 0.8}, false, colours}}, folder / "ball.png", {});
        vtkNew<vtkPNGReader> reader;
        reader->SetFileName((folder / "ball.png").c_str());
        reader->Update();
        int count = 0;
        for (int y = 0; y < 1200; ++y) {
            for (int x = 0; x < 1600; ++x) {
                const auto* rgb =
                    static_cast<const unsigned char*>(reader->GetOutput()->GetScalarPointer(x, y, 0));
                count += rgb[0] > 2 * rgb[1] && rgb[0] > 2 * rgb[2];
            }
        }
        return count;
    };
    EXPECT_EQ(red_pixels({}), 0);
    EXPECT_GT(red_pixels(red), 200'000);
}

}  // namespace
}  // namespace marrow::test
