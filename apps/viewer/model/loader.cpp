// Opens scans on a worker thread and reports to the thread of the window.
#include "loader.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <new>
#include <optional>
#include <set>

#include <marrow/error.h>

#include "shared/library_options.h"

namespace marrow::viewer {
namespace fs = std::filesystem;

namespace {

constexpr Worker::Key kLoading{0, 0};

QString text_of(const std::exception& error) {
    return QString::fromStdString(apps::name_flags(error.what()));
}

// What the headers say; nothing if the options do not fit.
std::optional<ScanReport> inspect(const fs::path& input, const ScanOptions& options) {
    try {
        return inspect_scan(input, options);
    } catch (const Cancelled&) {
        throw;
    } catch (const Error&) {
        return {};
    }
}

// A spacing with which a series may be read that does not state all of its own. It agrees with what is known.
std::optional<Vec3d> spacing_to_try(const SeriesReport& series) {
    Vec3d mm = series.series.spacing;
    std::replace(mm.begin(), mm.end(), 0.0, 1.0);
    return series.refusal && mm != series.series.spacing ? std::optional(mm) : std::nullopt;
}

// What the user could decide so that an input can be read, which it cannot be with these options. Progress
// goes on from the fraction `begin`.
std::optional<OpenQuestion> question_about(const fs::path& input, const ScanOptions& options, double begin) {
    using About = OpenQuestion::About;
    // Each look at the input may read the headers of thousands of files.
    constexpr std::size_t kMostSpacings = 3;
    constexpr double kMostLooks = kMostSpacings + 2;
    double looks = 0;
    const auto look = [&](ScanOptions tried) {
        tried.progress = [&, done = looks++](double fraction) {
            return options.progress(std::lerp(begin, 1, (done + fraction) / kMostLooks));
        };
        return inspect(input, tried);
    };
    ScanOptions first = options;
    if (!options.volume) first.volume = 0;
    const std::optional<ScanReport> report = look(first);
    if (!report) return {};
    OpenQuestion question{About::series, input, options, *report, std::vector<bool>(report->series.size())};
    // Whether a decision about this is the next one: only one series is meant, and it can be read then.
    const auto is_next = [&](About about, const std::optional<ScanReport>& tried) {
        if (!tried) return false;
        for (std::size_t i = 0; i < tried->series.size(); ++i) {
            if (!tried->series[i].refusal) question.readable[i] = true;
        }
        if (!tried->chosen) return false;
        question.about = about;
        question.report.series = {report->series[*tried->chosen]};
        question.readable = {true};
        return true;
    };
    if (is_next(About::series, report)) return question;  // for one of its volumes
    // The report gives the refusal of a series as its reason if no other series is meant.
    const auto is_meant = [&](const SeriesReport& series) { return series.refusal == report->reason; };
    const bool one_is_meant = std::any_of(report->series.begin(), report->series.end(), is_meant);
    std::vector<bool>& readable = question.readable;
    std::set<Vec3d> spacings;
    for (std::size_t i = 0; !options.spacing && i < report->series.size(); ++i) {
        const std::optional<Vec3d> mm = spacing_to_try(report->series[i]);
        if (!mm || spacings.contains(*mm) || (one_is_meant && !is_meant(report->series[i]))) continue;
        if (spacings.size() == kMostSpacings) {
            readable[i] = true;  // If it is not, the user sees why after choosing it.
            continue;
        }
        spacings.insert(*mm);
        ScanOptions spaced = first;
        spaced.spacing = *mm;
        if (is_next(About::spacing, look(spaced))) return question;
    }
    if (!options.resample && std::find(readable.begin(), readable.end(), false) != readable.end()) {
        ScanOptions even = first;
        even.resample = true;
        if (is_next(About::uneven_slices, look(even))) return question;
    }
    const bool any = std::find(readable.begin(), readable.end(), true) != readable.end();
    return any && !one_is_meant ? std::optional(question) : std::nullopt;
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
        double done = 0;
        ScanOptions watched = options;
        watched.progress = [&](double fraction) {
            done = fraction;
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
                auto question = question_about(input, watched, done);
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
