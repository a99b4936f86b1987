#include "measure_run.h"

#include <algorithm>
#include <cstdio>
#include <iostream>

#include <QEventLoop>
#include <QTemporaryDir>

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

double part(std::vector<double> values, double fraction) {
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    return values[static_cast<std::size_t>(fraction * static_cast<double>(values.size() - 1))];
}

}  // namespace

Watchdog::Watchdog(const SurfaceView& view, QObject* parent) : QObject(parent), view_(view) {
    timer_.setTimerType(Qt::PreciseTimer);
    connect(&timer_, &QTimer::timeout, this, [this] {
        const double late = static_cast<double>(since_.nsecsElapsed()) / 1e6 - kTick;
        since_.restart();
        const auto passed = [](double& last, double now) { return now - std::exchange(last, now); };
        const double drawing = passed(drawn_, view_.drawing_milliseconds());
        const double drawing_processor = passed(drawn_processor_, view_.drawing_processor_milliseconds());
        const double worked = passed(worked_, thread_milliseconds());
        longest_.milliseconds = std::max(longest_.milliseconds, late - drawing);
        longest_.processor = std::max(longest_.processor, worked - drawing_processor);
        longest_.with_drawing = std::max(longest_.with_drawing, late);
    });
    worked_ = thread_milliseconds();
    drawn_ = view_.drawing_milliseconds();
    drawn_processor_ = view_.drawing_processor_milliseconds();
    since_.start();
    timer_.start(kTick);
}

Watchdog::Stall Watchdog::longest() {
    return std::exchange(longest_, {});
}

int measure_viewer(MainWindow& window, const std::filesystem::path& input, const ScanOptions& options) {
    Session& session = window.session();
    Surfaces& surfaces = window.surfaces();
    SurfaceView& view = *window.surface_view();
    std::setvbuf(stdout, nullptr, _IOLBF, 0);
    pause(500);  // the first frame, with all that a program does once
    Watchdog watchdog(view);

    QElapsedTimer clock;
    clock.start();
    window.open(input, options);
    run_until([&] { return !window.busy(); });
    if (!session.scan()) {
        std::cerr << "marrow-viewer: " << window.banner().toStdString() << '\n';
        return 3;
    }
    const double loading = static_cast<double>(clock.elapsed());
    run_until([&] { return surfaces.settled() && !view.stale(); });
    const Watchdog::Stall stall_loading = watchdog.longest();  // to the first surface on the screen

    const Geometry& g = session.scan()->volume.geometry();
    const int id = session.parameters().current;
    std::printf("scan        %lld x %lld x %lld %s, previews from every %d. sample\n",
                static_cast<long long>(g.dims[0]), static_cast<long long>(g.dims[1]),
                static_cast<long long>(g.dims[2]), sample_type_name(session.scan()->volume.type()),
                1 << surfaces.preview_level());
    std::printf("loading     %.0f ms, longest stall %.0f ms, %.0f ms of it the window's work\n", loading,
                stall_loading.milliseconds, stall_loading.processor);

    // The hand: moves of a few values each, 16 ms apart, with a rest after every twelve.
    std::vector<double> previews, previews_drawn, rests, rests_drawn, full_frames, preview_frames;
    watchdog.longest();
    const double start = session.current()->isovalue;
    const double range = (session.scan()->histogram.upper - session.scan()->histogram.lower) / 20;
    struct Arrival {
        double all = 0, without_drawing = 0;
    };
    std::optional<Arrival> arrived, settled;
    double drawn_before = 0;
    QObject::connect(&surfaces, &Surfaces::shape_changed, &window, [&](int changed) {
        if (changed != id) return;
        const double elapsed = static_cast<double>(clock.nsecsElapsed()) / 1e6;
        const Arrival now{elapsed, elapsed - (view.drawing_milliseconds() - drawn_before)};
        if (!arrived) arrived = now;
        if (surfaces.exact(id)) settled = now;
    });
    for (int rest = 0; rest < 5; ++rest) {
        for (int move = 0; move < 12; ++move) {
            arrived.reset();
            settled.reset();
            drawn_before = view.drawing_milliseconds();
            clock.restart();
            session.set_isovalue(start + range * ((rest * 12 + move) % 40 + 1) / 40);
            run_until([&] { return arrived.has_value(); });
            previews.push_back(arrived->without_drawing);
            previews_drawn.push_back(arrived->all);
            if (move == 11) break;
            pause(16);
            preview_frames.push_back(view.frame_milliseconds());
        }
        run_until([&] { return settled.has_value(); });  // the clock still runs from the last move
        rests.push_back(settled->without_drawing);
        rests_drawn.push_back(settled->all);
        run_until([&] { return surfaces.settled() && !view.stale(); });
        full_frames.push_back(view.frame_milliseconds());
    }
    const Watchdog::Stall stall_extracting = watchdog.longest();
    const auto shape = surfaces.exact(id);
    std::printf("surface     %zu triangles\n", shape->mesh->triangles.size());
    std::printf("preview     with the renderer %.0f ms after a move (median; 95 %%: %.0f ms)\n",
                part(previews, 0.5), part(previews, 0.95));
    std::printf("full        with the renderer %.0f ms after the last move (median; longest %.0f ms)\n",
                part(rests, 0.5), part(rests, 1));
    std::printf("extracting  longest stall %.0f ms, %.0f ms of it the window's work\n",
                stall_extracting.milliseconds, stall_extracting.processor);

    QTemporaryDir folder;
    bool written = false;
    QObject::connect(&window, &MainWindow::written, &window, [&] { written = true; });
    watchdog.longest();
    clock.restart();
    window.write({{id, std::filesystem::path(folder.path().toStdString()) / "surface.stl"}}, Space::LPS);
    run_until([&] { return written; });
    const double exporting = static_cast<double>(clock.elapsed());
    const Watchdog::Stall stall_exporting = watchdog.longest();
    std::printf("exporting   %.0f ms, longest stall %.0f ms, %.0f ms of it the window's work\n", exporting,
                stall_exporting.milliseconds, stall_exporting.processor);
    std::printf("drawing     %s: previews %.0f ms, full %.0f ms a frame (medians)\n",
                view.software() ? "OpenGL runs on the processor" : "OpenGL runs on a graphics card",
                part(preview_frames, 0.5), part(full_frames, 0.5));
    std::printf(
        "            with it, previews come after %.0f ms, full after %.0f ms; longest stall %.0f ms\n",
        part(previews_drawn, 0.5), part(rests_drawn, 0.5), stall_extracting.with_drawing);
    return 0;
}

}  // namespace marrow::viewer
