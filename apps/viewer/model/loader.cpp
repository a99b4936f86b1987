#include "loader.h"

#include <chrono>
#include <new>

namespace marrow::viewer {
namespace fs = std::filesystem;

namespace {

constexpr Worker::Key kLoading{0, 0};

// A folder whose series the reader would not choose between, although it can read some of them.
bool must_choose(const ScanReport& report) {
    if (report.chosen) return false;
    std::size_t readable = 0;
    for (const SeriesReport& series : report.series) readable += !series.refusal;
    return readable > 1;
}

}  // namespace

// Back on the window's thread, unless another request has come meanwhile.
template <class Tell>
void Loader::tell(int request, Tell what) {
    QMetaObject::invokeMethod(
        this,
        [this, request, what] {
            if (request == request_ && busy_) what();
        },
        Qt::QueuedConnection);
}

void Loader::open(const fs::path& input, const ScanOptions& options) {
    const int request = ++request_;
    busy_ = true;
    emit started(
        QString::fromStdString(input.filename().empty() ? input.string() : input.filename().string()));
    const auto end = [this, request](auto what) {
        tell(request, [this, what] {
            busy_ = false;
            emit finished();
            what();
        });
    };
    worker_.forget(kLoading);
    worker_.post(kLoading, [=, this](const Progress& unless_interrupted) {
        auto told = std::chrono::steady_clock::now();
        ScanOptions watched = options;
        watched.progress = [&](double fraction) {
            const auto now = std::chrono::steady_clock::now();
            if (now - told > std::chrono::milliseconds(30)) {
                told = now;
                tell(request, [this, fraction] { emit progressed(fraction); });
            }
            return unless_interrupted(fraction);
        };
        try {
            if (fs::is_directory(input) && !options.series) {
                const ScanReport report = inspect_scan(input, watched);
                if (must_choose(report)) return end([=, this] { emit undecided(input, options, report); });
            }
            const std::shared_ptr<const Scan> scan = open_scan(input, watched);
            end([=, this] { emit opened(scan); });
        } catch (const Cancelled&) {
            throw;
        } catch (const std::bad_alloc&) {
            end([this] { emit failed(tr("There is not enough memory for this scan.")); });
        } catch (const std::exception& error) {
            end([this, text = QString::fromUtf8(error.what())] { emit failed(text); });
        }
    });
}

void Loader::cancel() {
    if (!busy_) return;
    worker_.forget(kLoading);
    busy_ = false;
    emit finished();
}

}  // namespace marrow::viewer
