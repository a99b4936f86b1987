// How fast a folder of DICOM slices is read: Marrow with one thread and with all, and ITK's series reader where it is
// installed, in turns in one process.
// usage: marrow-bench-reading FOLDER [TURNS]
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include <marrow/scan_io.h>

#ifdef MARROW_BENCH_ITK
#include <itkGDCMImageIO.h>
#include <itkGDCMSeriesFileNames.h>
#include <itkImage.h>
#include <itkImageSeriesReader.h>
#endif

namespace {

struct Arm {
    std::string name;
    std::function<std::size_t()> read;  // returns how many samples it read
    std::vector<double> seconds = {};
};

#ifdef MARROW_BENCH_ITK
std::size_t read_with_itk(const std::string& folder) {
    using Image = itk::Image<short, 3>;
    const auto names = itk::GDCMSeriesFileNames::New();
    names->SetRecursive(true);
    names->SetDirectory(folder);
    const auto reader = itk::ImageSeriesReader<Image>::New();
    reader->SetImageIO(itk::GDCMImageIO::New());
    reader->SetFileNames(names->GetInputFileNames());
    reader->Update();
    return reader->GetOutput()->GetPixelContainer()->Size();
}
#endif

}  // namespace

int main(int argc, char** argv) {
    if (argc < 2) return std::fputs("usage: marrow-bench-reading FOLDER [TURNS]\n", stderr), 2;
    const std::string folder = argv[1];
    const int turns = argc > 2 ? std::atoi(argv[2]) : 9;
    const auto marrow_with = [&](int threads) {
        return [=] {
            marrow::ScanOptions options;
            options.threads = threads;
            return static_cast<std::size_t>(marrow::read_scan(folder, options).geometry().sample_count());
        };
    };
    const int all = static_cast<int>(std::thread::hardware_concurrency());
    std::vector<Arm> arms = {{"Marrow, 1 thread", marrow_with(1)},
                             {"Marrow, " + std::to_string(all) + " threads", marrow_with(all)}};
#ifdef MARROW_BENCH_ITK
    arms.push_back({"ITK series reader", [&] { return read_with_itk(folder); }});
#endif
    try {
        for (Arm& arm : arms) arm.read();  // the files are in memory from here on
        for (int turn = 0; turn < turns; ++turn) {
            for (Arm& arm : arms) {
                const auto start = std::chrono::steady_clock::now();
                arm.read();
                arm.seconds.push_back(
                    std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
            }
        }
    } catch (const std::exception& error) {
        return std::fprintf(stderr, "%s\n", error.what()), 3;
    }
    std::printf("%-20s %10s %10s\n", folder.size() > 20 ? "seconds" : folder.c_str(), "median", "least");
    for (Arm& arm : arms) {
        std::sort(arm.seconds.begin(), arm.seconds.end());
        std::printf("%-20s %10.3f %10.3f\n", arm.name.c_str(), arm.seconds[arm.seconds.size() / 2],
                    arm.seconds[0]);
    }
}
