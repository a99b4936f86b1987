// marrow-bench-reading: times reading a folder of DICOM slices with Marrow and, if installed, with ITK, and
// reading only their headers with Marrow and DCMTK, interleaved.
// usage: marrow-bench-reading FOLDER [ROUNDS]
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#define HAVE_CONFIG_H  // required by DCMTK's headers
#include <dcmtk/config/osconfig.h>

#include <dcmtk/dcmdata/dcdeftag.h>
#include <dcmtk/dcmdata/dcfilefo.h>
#include <dcmtk/oflog/oflog.h>

#include <marrow/scan_io.h>

#ifdef MARROW_BENCH_ITK
#include <itkGDCMImageIO.h>
#include <itkGDCMSeriesFileNames.h>
#include <itkImage.h>
#include <itkImageSeriesReader.h>
#endif

namespace {

struct Contender {
    std::string name;
    std::function<std::size_t()> read;  // returns the number of samples, or of files
    std::vector<double> seconds = {};
};

// Marrow also groups the files into series, and describes them.
std::size_t headers_with_marrow(const std::string& folder) {
    marrow::ScanOptions options;
    options.threads = 1;
    return marrow::inspect_scan(folder, options).files;
}

std::size_t headers_with_dcmtk(const std::string& folder) {
    std::size_t files = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
        DcmFileFormat file;
        if (entry.is_regular_file())
            files += file.loadFileUntilTag(entry.path().c_str(), EXS_Unknown, EGL_noChange, DCM_MaxReadLength,
                                           ERM_autoDetect, DCM_PixelData)
                         .good();
    }
    return files;
}

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
    if (argc < 2) return std::fputs("usage: marrow-bench-reading FOLDER [ROUNDS]\n", stderr), 2;
    const std::string folder = argv[1];
    const int rounds = argc > 2 ? std::atoi(argv[2]) : 9;
    const auto marrow_with = [&](int threads) {
        return [=] {
            marrow::ScanOptions options;
            options.threads = threads;
            return static_cast<std::size_t>(marrow::read_scan(folder, options).geometry().sample_count());
        };
    };
    const int all = static_cast<int>(std::thread::hardware_concurrency());
    OFLog::configure(OFLogger::OFF_LOG_LEVEL);
    std::vector<Contender> contenders = {{"Marrow, 1 thread", marrow_with(1)},
                                         {"Marrow, " + std::to_string(all) + " threads", marrow_with(all)},
                                         {"headers, Marrow", [&] { return headers_with_marrow(folder); }},
                                         {"headers, DCMTK", [&] { return headers_with_dcmtk(folder); }}};
#ifdef MARROW_BENCH_ITK
    contenders.push_back({"ITK series reader", [&] { return read_with_itk(folder); }});
#endif
    try {
        for (Contender& contender : contenders) contender.read();  // afterwards the files are in the cache
        for (int round = 0; round < rounds; ++round) {
            for (Contender& contender : contenders) {
                const auto start = std::chrono::steady_clock::now();
                contender.read();
                contender.seconds.push_back(
                    std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
            }
        }
    } catch (const std::exception& error) {
        return std::fprintf(stderr, "%s\n", error.what()), 3;
    }
    std::printf("%-20s %10s %10s\n", folder.size() > 20 ? "seconds" : folder.c_str(), "median", "minimum");
    for (Contender& contender : contenders) {
        std::sort(contender.seconds.begin(), contender.seconds.end());
        std::printf("%-20s %10.3f %10.3f\n", contender.name.c_str(),
                    contender.seconds[contender.seconds.size() / 2], contender.seconds[0]);
    }
}
