// Opens scans on a worker thread and reports to the thread of the window.
#include "loader.h"

#include <algorithm>
#include <chrono>
#include <new>

#include <marrow/error.h>

#include "shared/library_options.h"

namespace marrow::viewer {
namespace fs = std::filesystem;

namespace {

constexpr Worker::Key kLoading{0, 0};

QString text_of(const std::exception& error) {
    return QString::fromStdString(apps::name_flags(error.what()));
}

// What the user could decide so that an input can be read, which it cannot be with these options.
std::optional<OpenQuestion> question_about(const fs::path& input, const ScanOptions& options) {
    using About = OpenQuestion::About;
    const auto inspect = [&](const ScanOptions& tried) -> std::optional<ScanReport> {
        try {
            return inspect_scan(input, tried);
        } catch (const Cancelled&) {
            throw;
        } catch (const Error&) {
            return {};
        }
    };
    const auto opens = [](const std::optional<ScanReport>& report, const ScanOptions& tried) {
        return report &&
               std::any_of(report->series.begin(), report->series.end(),
                           [&](const SeriesReport& series) { return can_be_opened(series, tried); });
    };
    const std::optional<ScanReport> report = inspect(options);
    if (!report) return {};
    const auto about = [&](About subject) { return OpenQuestion{subject, input, options, *report}; };
    if (opens(report, options)) return about(About::series);
    ScanOptions tried = options;
    tried.spacing = Vec3d{1, 1, 1};
    if (!options.spacing && opens(inspect(tried), tried)) return about(About::spacing);
    tried = options;
    tried.resample = true;
    if (!options.resample && opens(inspect(tried), tried)) return about(About::uneven_slices);
    return {};
}

}  // namespace

bool can_be_opened(const SeriesReport& series, const ScanOptions& options) {
    // The headers give a geometry if nothing but a choice is missing.
    return !series.refusal || (series.volume_count > 1 && series.geometry && !options.volume);
}

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
    failure_ = {};
    emit started(
        QString::fromStdString(input.filename().empty() ? input.string() : input.filename().string()));
    const auto end = [this, request](auto action, const std::exception_ptr& failure = {}) {
        on_own_thread(request, [this, action, failure] {
            busy_ = false;
            failure_ = failure;
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
                return end([=, this] { emit opened(input, scan, session); });
            }
            try {
                const std::shared_ptr<const Scan> scan = open_scan(input, watched);
                end([=, this] { emit opened(input, scan, nullptr); });
            } catch (const GeometryError&) {
                auto question = question_about(input, watched);
                if (!question) throw;
                question->options.progress = {};
                end([=, this] { emit undecided(*question); }, std::current_exception());
            }
        } catch (const Cancelled&) {
            throw;
        } catch (const std::bad_alloc&) {
            end([this] { emit failed(tr("Not enough memory for this scan.")); }, std::current_exception());
        } catch (const std::exception& error) {
            end([this, text = text_of(error)] { emit failed(text); }, std::current_exception());
        }
    });
}

void Loader::cancel() {
    if (!busy_) return;
    worker_.forget(kLoading);
    busy_ = false;
    failure_ = std::make_exception_ptr(Cancelled());
    emit finished();
}

}  // namespace marrow::viewer
