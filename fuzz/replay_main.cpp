// Runs a fuzz target on stored inputs and on damaged copies of them, for tests and for compilers without
// libFuzzer. Its arguments are files, or folders of files.
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
    std::fprintf(stderr, "%s\n", path.c_str());  // the last name printed is the input that crashed
    run(whole);
    if (whole.empty()) return;
    constexpr int kCopies = 200;
    std::minstd_rand random;  // the same damage in each run
    const auto below = [&](std::size_t limit) { return random() % limit; };
    for (int n = 0; n < kCopies; ++n) {
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
