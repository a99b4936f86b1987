// Opens scans on a worker thread and reports to the thread of the window.
#include "loader.h"
#include "shared/library_options.h"

#include <chrono>
#include <new>

namespace marrow::viewer {
namespace fs = std::filesystem;

namespace {

constexpr Worker::Key kLoading{0, 0};

// Whether the user must choose: the input has several readable series.
bool must_choose(const ScanReport& report) {
    if (report.chosen) return false;
    std::size_t readable = 0;
    for (const SeriesReport& series : report.series) readable += !series.refusal;
    return readable > 1;
}

}  // namespace

// Does nothing if the request was cancelled or replaced in the meantime.
template <class Action>
void Loader::on_own_thread(int request, Action action) {
    QMetaObject::invokeMethod(
        this,
        [this, request, action] {
            if (request == request_ && busy_) action();
        },
        Qt::QueuedConnection);
}

void Loader::open(const fs::path& input, const ScanOptions& options) {
    const int request = ++request_;
    busy_ = true;
    emit started(
        QString::fromStdString(input.filename().empty() ? input.string() : input.filename().string()));
    const auto end = [this, request](auto action) {
        on_own_thread(request, [this, action] {
            busy_ = false;
            emit finished();
            action();
        });
    };
    worker_.forget(kLoading);
    worker_.post(kLoading, [=, this](const Progress& job_progress) {
        auto last_report = std::chrono::steady_clock::now();
        ScanOptions watched = options;
        watched.progress = [&](double fraction) {
            const auto now = std::chrono::steady_clock::now();
            if (now - last_report > std::chrono::milliseconds(30)) {
                last_report = now;
                on_own_thread(request, [this, fraction] { emit progressed(fraction); });
            }
            return job_progress(fraction);
        };
        try {
            if (is_session_file(input)) {
                const auto session = std::make_shared<SavedSession>(read_session(input));
                session->options.progress = watched.progress;
                const std::shared_ptr<const Scan> scan = open_scan(session->scan, session->options);
                check_session(*session, *scan);
                return end([=, this] { emit opened(scan, session); });
            }
            if (fs::is_directory(input) && !options.series) {
                const ScanReport report = inspect_scan(input, watched);
                if (must_choose(report)) return end([=, this] { emit undecided(input, options, report); });
            }
            const std::shared_ptr<const Scan> scan = open_scan(input, watched);
            end([=, this] { emit opened(scan, nullptr); });
        } catch (const Cancelled&) {
            throw;
        } catch (const std::bad_alloc&) {
            end([this] { emit failed(tr("Not enough memory for this scan.")); });
        } catch (const std::exception& error) {
            end([this, text = QString::fromStdString(apps::name_flags(error.what()))] { emit failed(text); });
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
