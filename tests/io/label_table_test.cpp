// read_label_table and default_label_colour.
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include <marrow/error.h>
#include <marrow/label_table.h>

#include "support/temporary_folder.h"

namespace marrow::test {
namespace {

LabelTable table_of(const std::string& text) {
    const TemporaryFolder folder;
    write_file(folder / "table", text);
    return read_label_table(folder / "table");
}

using Colour = std::array<double, 3>;

TEST(LabelTable, ReadsTablesOf3DSlicer) {
    const LabelTable table = table_of(
        "# Color table file GenericAnatomyColors\n# 3 values\n0 background 0 0 0 0\n"
        "1 tissue 128 174 128 255\n2 left_lung 255 0 51 255\n");
    ASSERT_EQ(table.size(), 3u);
    EXPECT_EQ(table.at(1).name, "tissue");
    EXPECT_EQ(table.at(2).colour, (Colour{1, 0, 0.2}));
}

TEST(LabelTable, ReadsTablesOfItkSnap) {
    const LabelTable table = table_of(
        "################\n# ITK-SnAP Label Description File\n################\n"
        "    0     0    0    0        0  0  0    \"Clear Label\"\n"
        "    4   255    0  102        1  1  1    \"Caudate nucleus\"\n");
    EXPECT_EQ(table.at(4).name, "Caudate nucleus");
    EXPECT_EQ(table.at(4).colour, (Colour{1, 0, 0.4}));
    EXPECT_EQ(table.at(0).name, "Clear Label");
}

TEST(LabelTable, ReadsPlainTables) {
    const LabelTable table = table_of(
        "1 Precentral_L 2001\r\n2\tPrecentral R\n3, liver\n-4;\"the \xc3\xbc one\"\n7 vessel 2 "
        "9\n8,hot,255,0,0");
    EXPECT_EQ(table.at(1).name, "Precentral_L");
    EXPECT_FALSE(table.at(1).colour);
    EXPECT_EQ(table.at(2).name, "Precentral R");
    EXPECT_EQ(table.at(3).name, "liver");
    EXPECT_EQ(table.at(-4).name, "the \xc3\xbc one");
    EXPECT_EQ(table.at(7).name, "vessel");
    EXPECT_EQ(table.at(8).colour, (Colour{1, 0, 0}));
}

TEST(LabelTable, AcceptsQuotesWithinQuotesAndAByteOrderMark) {
    const LabelTable table = table_of(
        "\xEF\xBB\xBF"
        "1 0 255 0  0.5 1 1  \"La \"\"grande\"\"\"\n2,\"a, b\",0,0,255\n");
    EXPECT_EQ(table.at(1).name, "La \"grande\"");
    EXPECT_EQ(table.at(1).colour, (Colour{0, 1, 0}));
    EXPECT_EQ(table.at(2).name, "a, b");
    EXPECT_EQ(table.at(2).colour, (Colour{0, 0, 1}));
}

TEST(LabelTable, NamesCanEndInNumbers) {
    const LabelTable table = table_of(
        "1,vertebra 1,255,0,0\n2\tvertebra 2\t255\t0\t0\t255\n3 vertebra 3 255 0 0 255\n"
        "4 \"vertebra 4\" 255 0 0\n5;\"vertebra 5\";255;0;0\n6, vertebra 6, 255, 0, 0\n");
    ASSERT_EQ(table.size(), 6u);
    for (const auto& [label, entry] : table) {
        EXPECT_EQ(entry.name, "vertebra " + std::to_string(label));
        EXPECT_EQ(entry.colour, (Colour{1, 0, 0})) << label;
    }
    // FreeSurfer's colours have an alpha of 0, and a type of tissue can follow.
    const LabelTable free_surfer = table_of("4 Left-Ventricle 120 18 134 0\n5 Left-Thalamus 0 118 14 0 2\n");
    EXPECT_EQ(free_surfer.at(4).name, "Left-Ventricle");
    EXPECT_EQ(free_surfer.at(4).colour, (Colour{120 / 255.0, 18 / 255.0, 134 / 255.0}));
    EXPECT_EQ(free_surfer.at(5).name, "Left-Thalamus");
}

TEST(LabelTable, RefusesNumbersThatMayBelongToTheNameOrTheColour) {
    try {
        table_of("1 liver 255 0 0\n2 vertebra 1 255 0 0\n");
        ADD_FAILURE() << "accepted";
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("line 2: the first of four numbers may belong to the name"),
                  std::string::npos)
            << error.what();
    }
    const LabelTable quoted = table_of("1 liver 255 0 0\n2 \"vertebra 1\" 255 0 0\n");
    EXPECT_EQ(quoted.at(2).name, "vertebra 1");
    EXPECT_EQ(quoted.at(2).colour, (Colour{1, 0, 0}));
}

TEST(LabelTable, NamesCanContainTheSignOfComments) {
    const LabelTable table = table_of("  # comment\n1,Lesion #1,255,0,0 # 3 4\n#2 none\n2 #2\n");
    ASSERT_EQ(table.size(), 2u);
    EXPECT_EQ(table.at(1).name, "Lesion #1");
    EXPECT_EQ(table.at(1).colour, (Colour{1, 0, 0}));
    EXPECT_EQ(table.at(2).name, "#2");
}

TEST(LabelTable, KeepsEmptyNames) {
    const LabelTable table = table_of("1,,255,0,0\n2,liver,,\n");
    EXPECT_EQ(table.at(1).name, "");
    EXPECT_EQ(table.at(1).colour, (Colour{1, 0, 0}));
    EXPECT_EQ(table.at(2).name, "liver");
}

TEST(LabelTable, NamesAnyLabel) {
    const LabelTable table =
        table_of("9007199254740993 a\n864691135000000001 b\n-9223372036854775808 c\n4.0 d\n1e3 e\n");
    EXPECT_EQ(table.at(9007199254740993).name, "a");
    EXPECT_EQ(table.at(864691135000000001).name, "b");
    EXPECT_EQ(table.at(std::numeric_limits<std::int64_t>::min()).name, "c");
    EXPECT_EQ(table.at(4).name, "d");
    EXPECT_EQ(table.at(1000).name, "e");
    EXPECT_THROW(table_of("9223372036854775808 a\n"), InputError);
}

TEST(LabelTable, NamesTheLineOfAnError) {
    for (const char* text : {"1 a\nliver\n", "1 a\n2\n", "1 a\n1 b\n", "1 a\n1.5 b\n", "1 a\nnan b\n"}) {
        SCOPED_TRACE(text);
        try {
            table_of(text);
            ADD_FAILURE() << "accepted";
        } catch (const InputError& error) {
            EXPECT_NE(std::string(error.what()).find("line 2"), std::string::npos) << error.what();
        }
    }
    EXPECT_THROW(read_label_table("/missing/table"), IoError);
}

TEST(LabelTable, NeighbouringLabelsDifferInColour) {
    std::vector<std::int64_t> labels;
    for (std::int64_t label = -3; label < 300; ++label) labels.push_back(label);
    for (const std::int64_t base : {std::int64_t{1} << 31, std::int64_t{1} << 53, std::int64_t{1} << 62})
        for (std::int64_t label = base - 5; label < base + 5; ++label) labels.push_back(label);
    for (const std::int64_t label : labels) {
        const Colour a = default_label_colour(label), b = default_label_colour(label + 1);
        double difference = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            EXPECT_GE(a[i], 0);
            EXPECT_LE(a[i], 1);
            difference += std::abs(a[i] - b[i]);
        }
        EXPECT_GT(difference, 0.3) << label;
    }
}

// Files have the colours that labels always had.
TEST(LabelTable, ColoursOfSmallLabelsArePreserved) {
    for (std::int64_t label = 0; label <= 100000; ++label) {
        const double turns = static_cast<double>(label) * 0.61803398874989485,
                     hue = 6 * (turns - std::floor(turns));
        const Colour colour = default_label_colour(label);
        for (std::size_t i = 0; i < 3; ++i) {
            const double k = std::fmod(5 - 2 * static_cast<double>(i) + hue, 6);
            ASSERT_EQ(colour[i], 0.92 * (1 - 0.55 * std::max(0.0, std::min({k, 4 - k, 1.0})))) << label;
        }
    }
}

}  // namespace
}  // namespace marrow::test
