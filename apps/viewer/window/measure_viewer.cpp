// Drives the window like a user and times its answers.
#include "measure_viewer.h"

#include <algorithm>
#include <cstdio>
#include <exception>
#include <iostream>
#include <optional>
#include <utility>

#include <QElapsedTimer>
#include <QEventLoop>
#include <QTemporaryDir>
#include <QTimer>

#include <marrow/scan_io.h>

#include "shared/console.h"

namespace marrow::viewer {
namespace {

constexpr int kTick = 4;  // ms

void run_until(const std::function<bool()>& done) {
    QEventLoop loop;
    QTimer timer;
    QObject::connect(&timer, &QTimer::timeout, &loop, [&] {
        if (done()) loop.quit();
    });
    timer.start(kTick);
    loop.exec();
}

void pause(int ms) {
    QElapsedTimer timer;
    timer.start();
    run_until([&] { return timer.elapsed() >= ms; });
}

double quantile(std::vector<double> values, double fraction) {
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    return values[static_cast<std::size_t>(fraction * static_cast<double>(values.size() - 1))];
}

struct Stall {
    double milliseconds = 0;  // without drawing
    double processor = 0;     // the part in which the thread of the window worked itself
    double with_drawing = 0;
};

// Measures how long the window does not respond: how late a timer fires. Frames of the 3D view are counted
// separately, because without a graphics card they are slow.
class Watchdog : public QObject {
  public:
    explicit Watchdog(const SurfaceView& view) : view_(view) {
        timer_.setTimerType(Qt::PreciseTimer);
        connect(&timer_, &QTimer::timeout, this, &Watchdog::tick);
        worked_ = thread_milliseconds();
        drawn_ = view_.drawing_milliseconds();
        drawn_processor_ = view_.drawing_processor_milliseconds();
        since_.start();
        timer_.start(kTick);
    }

    /// The longest stall since the last call.
    Stall longest() { return std::exchange(longest_, {}); }

  private:
    void tick() {
        const double late = static_cast<double>(since_.nsecsElapsed()) / 1e6 - kTick;
        since_.restart();
        const auto passed = [](double& last, double now) { return now - std::exchange(last, now); };
        const double drawing = passed(drawn_, view_.drawing_milliseconds());
        const double drawing_processor = passed(drawn_processor_, view_.drawing_processor_milliseconds());
        const double worked = passed(worked_, thread_milliseconds());
        longest_.milliseconds = std::max(longest_.milliseconds, late - drawing);
        longest_.processor = std::max(longest_.processor, worked - drawing_processor);
        longest_.with_drawing = std::max(longest_.with_drawing, late);
    }

    const SurfaceView& view_;
    QTimer timer_;
    QElapsedTimer since_;
    double drawn_ = 0, drawn_processor_ = 0, worked_ = 0;
    Stall longest_;
};

// How long after a move of the isovalue a surface reaches the renderer, ms.
struct Times {
    std::vector<double> previews, full;
};

class Measurer {
  public:
    explicit Measurer(MainWindow& window)
        : window_(window),
          session_(window.session()),
          surfaces_(window.surfaces()),
          view_(*window.surface_view()) {}

    /// Returns whether the scan could be opened.
    bool load(const std::filesystem::path& input, const ScanOptions& options);
    /// Whether the samples differ, so that surfaces follow the isovalue.
    bool can_move_isovalue() const {
        return session_.scan()->histogram.lower < session_.scan()->histogram.upper;
    }
    /// Moves by a few values at a time, 16 ms apart, with a pause after every twelve moves.
    Times move_isovalue(double start);
    void move_undrawn_and_drawn();
    void export_mesh();
    void print_drawing() const;

  private:
    void wait_for_surfaces() {
        run_until([&] { return surfaces_.settled() && !view_.stale(); });
    }
    void move_to(double isovalue);
    void note_shape();

    MainWindow& window_;
    Session& session_;
    Surfaces& surfaces_;
    SurfaceView& view_;
    Watchdog watchdog_{view_};
    QElapsedTimer clock_;
    std::optional<double> arrived_, settled_;  // the first shape and full resolution, ms after the move
    Times drawn_;
    std::vector<double> preview_frames_, full_frames_;
    Stall extracting_;
};

bool Measurer::load(const std::filesystem::path& input, const ScanOptions& options) {
    clock_.start();
    window_.open(input, options);
    run_until([&] { return !window_.busy(); });
    if (!session_.scan()) return false;
    const double loading = static_cast<double>(clock_.elapsed());
    wait_for_surfaces();
    const Stall stall = watchdog_.longest();  // until the first surface is on the screen

    const Geometry& g = session_.scan()->volume.geometry();
    std::printf("scan        %lld x %lld x %lld %s; previews use one sample in %d per axis\n",
                static_cast<long long>(g.dims[0]), static_cast<long long>(g.dims[1]),
                static_cast<long long>(g.dims[2]), sample_type_name(session_.scan()->volume.type()),
                1 << surfaces_.preview_level());
    std::printf("device      %s extracts\n", surfaces_.device_name().toUtf8().constData());
    std::printf("loading     %.0f ms; longest stall %.0f ms, %.0f ms of it in the window\n", loading,
                stall.milliseconds, stall.processor);
    return true;
}

void Measurer::note_shape() {
    const double now = static_cast<double>(clock_.nsecsElapsed()) / 1e6;
    if (!arrived_) arrived_ = now;
    if (surfaces_.exact(session_.parameters().current)) settled_ = now;
}

void Measurer::move_to(double isovalue) {
    arrived_.reset();
    settled_.reset();
    clock_.restart();
    session_.set_isovalue(isovalue);
    run_until([&] { return arrived_.has_value(); });
}

Times Measurer::move_isovalue(double start) {
    Times times;
    constexpr int kPauses = 5, kMoves = 12;
    const int id = session_.parameters().current;
    const auto connection =
        QObject::connect(&surfaces_, &Surfaces::shape_changed, &window_, [&](int changed) {
            if (changed == id) note_shape();
        });
    const double range = (session_.scan()->histogram.upper - session_.scan()->histogram.lower) / 20;
    for (int round = 0; round < kPauses; ++round) {
        for (int move = 0; move < kMoves; ++move) {
            move_to(start + range * ((round * kMoves + move) % 40 + 1) / 40);
            times.previews.push_back(*arrived_);
            if (move == kMoves - 1) break;
            pause(16);
            preview_frames_.push_back(view_.frame_milliseconds());
        }
        run_until([&] { return settled_.has_value(); });  // the clock still runs from the last move
        times.full.push_back(*settled_);
        wait_for_surfaces();
        full_frames_.push_back(view_.frame_milliseconds());
    }
    QObject::disconnect(connection);
    return times;
}

// Without a graphics card, drawing takes most of the time. What remains is
// measured while the 3D view is hidden.
void Measurer::move_undrawn_and_drawn() {
    const double start = session_.current()->isovalue;
    window_.views()->show_alone(window_.slice_view(Plane::axial));
    const Times undrawn = move_isovalue(start);
    window_.views()->show_alone(nullptr);
    wait_for_surfaces();
    preview_frames_.clear();
    full_frames_.clear();
    watchdog_.longest();
    drawn_ = move_isovalue(start);
    extracting_ = watchdog_.longest();
    std::printf("surface     %zu triangles\n",
                surfaces_.exact(session_.parameters().current)->mesh->triangles.size());
    std::printf("preview     reaches the renderer %.0f ms after a move (median; 95 %%: %.0f ms)\n",
                quantile(undrawn.previews, 0.5), quantile(undrawn.previews, 0.95));
    std::printf("full        reaches the renderer %.0f ms after the last move (median; longest %.0f ms)\n",
                quantile(undrawn.full, 0.5), quantile(undrawn.full, 1));
    std::printf("extracting  longest stall %.0f ms, %.0f ms of it in the window\n", extracting_.milliseconds,
                extracting_.processor);
}

void Measurer::export_mesh() {
    QTemporaryDir folder;
    const std::filesystem::path file = std::filesystem::path(folder.path().toStdString()) / "surface.stl";
    bool written = false;
    const auto connection =
        QObject::connect(&window_, &MainWindow::written, &window_, [&] { written = true; });
    watchdog_.longest();
    clock_.restart();
    window_.write({{session_.parameters().current, file}}, Space::LPS);
    run_until([&] { return written; });
    QObject::disconnect(connection);
    const double exporting = static_cast<double>(clock_.elapsed());
    const Stall stall = watchdog_.longest();
    std::printf("exporting   %.0f ms; longest stall %.0f ms, %.0f ms of it in the window\n", exporting,
                stall.milliseconds, stall.processor);
}

void Measurer::print_drawing() const {
    std::printf("drawing     OpenGL runs on %s; a preview takes %.0f ms, a full frame %.0f ms (medians)\n",
                view_.software() ? "the processor" : "a graphics card", quantile(preview_frames_, 0.5),
                quantile(full_frames_, 0.5));
    std::printf(
        "            with drawing: preview after %.0f ms, full after %.0f ms; longest stall %.0f ms\n",
        quantile(drawn_.previews, 0.5), quantile(drawn_.full, 0.5), extracting_.with_drawing);
}

}  // namespace

int measure_viewer(MainWindow& window, const std::filesystem::path& input, const ScanOptions& options) {
    std::setvbuf(stdout, nullptr, _IOLBF, 0);
    pause(500);  // the first frame includes one-time work
    // Nobody answers questions.
    QObject::disconnect(&window.loader(), &Loader::undecided, &window, nullptr);
    Measurer measurer(window);
    if (!measurer.load(input, options)) {
        return apps::exit_code_of(apps::standard_console(), [&] {
            std::rethrow_exception(window.loader().failure());
            return apps::kOk;
        });
    }
    if (!measurer.can_move_isovalue()) {
        std::cerr << "marrow: all samples are equal, so the isovalue cannot move\n";
        return 2;
    }
    measurer.move_undrawn_and_drawn();
    measurer.export_mesh();
    measurer.print_drawing();
    return 0;
}

}  // namespace marrow::viewer
