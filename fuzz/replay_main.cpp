// Runs a target over stored inputs, and over copies of them with damage: files, and the files of folders. For compilers
// without libFuzzer, and for tests.
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

void run(const std::vector<char>& bytes) {
    LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
}

void replay(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    const std::vector<char> whole{std::istreambuf_iterator<char>(in), {}};
    std::fprintf(stderr, "%s\n", path.c_str());  // the last one named is the one that crashed
    run(whole);
    if (whole.empty()) return;
    constexpr int copies = 200;
    std::minstd_rand random;  // the same damage each time
    const auto below = [&](std::size_t limit) { return random() % limit; };
    for (int n = 0; n < copies; ++n) {
        std::vector<char> damaged = whole;
        for (auto flips = below(4); flips > 0; --flips)
            damaged[below(damaged.size())] = static_cast<char>(below(256));
        if (n % 2) damaged.resize(below(damaged.size()));
        run(damaged);
    }
}

}  // namespace

int main(int argc, char** argv) {
    int count = 0;
    for (int i = 1; i < argc; ++i) {
        if (!std::filesystem::is_directory(argv[i])) {
            if (std::filesystem::exists(argv[i])) replay(argv[i]), ++count;
            continue;
        }
        for (const auto& entry : std::filesystem::directory_iterator(argv[i])) replay(entry.path()), ++count;
    }
    std::fprintf(stderr, "%d inputs\n", count);
    return count == 0;
}
