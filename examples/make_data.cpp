// Writes a small CT and a label map, to try the other examples without a scan of your own.
//
//     example_make_data FOLDER          writes FOLDER/ball.nrrd and FOLDER/labels.nrrd
#include <marrow/error.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

namespace {

// Writes 48 x 48 x 48 samples, 1 mm apart, of value(x, y, z).
template <class T, class Value>
void write_nrrd(const std::string& file, const char* type, const Value& value) {
    std::vector<T> samples;
    for (int z = 0; z < 48; ++z) {
        for (int y = 0; y < 48; ++y) {
            for (int x = 0; x < 48; ++x) samples.push_back(static_cast<T>(value(x, y, z)));
        }
    }
    std::ofstream out(file, std::ios::binary);
    out << "NRRD0005\ntype: " << type
        << "\ndimension: 3\nsizes: 48 48 48\nspace: left-posterior-superior\n"
           "space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\nendian: little\nencoding: "
           "raw\n\n";
    out.write(reinterpret_cast<const char*>(samples.data()),
              static_cast<std::streamsize>(samples.size() * sizeof(T)));
    if (!out.flush()) throw marrow::IoError("cannot write " + file);
}

double radius(int x, int y, int z) {
    return std::hypot(x - 23.5, y - 23.5, z - 23.5);
}

}  // namespace

int main(int argc, char** argv) try {
    if (argc != 2) throw marrow::InputError("usage: example_make_data FOLDER");
    const std::string folder = argv[1];
    // A ball of bone in air: its surface at 225.5 HU, the preset for bone, has a radius of 20 mm.
    write_nrrd<std::int16_t>(folder + "/ball.nrrd", "int16", [](int x, int y, int z) {
        return std::lround(std::clamp(225.5 + 500 * (20 - radius(x, y, z)), -1000.0, 1500.0));
    });
    // The ball's left half is label 1 and its right half is label 2.
    write_nrrd<std::uint8_t>(folder + "/labels.nrrd", "uint8", [](int x, int y, int z) {
        if (radius(x, y, z) > 20) return 0;
        return x < 24 ? 2 : 1;
    });
} catch (const marrow::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}
