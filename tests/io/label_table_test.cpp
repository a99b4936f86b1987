// read_label_table and default_label_colour.
#include <cmath>

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
    for (std::int64_t label = -3; label < 300; ++label) {
        const Colour a = default_label_colour(label), b = default_label_colour(label + 1);
        double difference = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            EXPECT_GE(a[i], 0);
            EXPECT_LE(a[i], 1);
            difference += std::abs(a[i] - b[i]);
        }
        EXPECT_GT(difference, 0.3);
    }
}

}  // namespace
}  // namespace marrow::test
