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
        const double drawing = view_.drawing_milliseconds() - drawn_;
        drawn_ = view_.drawing_milliseconds();
        longest_ = std::max(longest_, late - drawing);
        longest_with_drawing_ = std::max(longest_with_drawing_, late);
    });
    since_.start();
    timer_.start(kTick);
}

double Watchdog::longest() {
    return std::exchange(longest_, 0.0);
}

double Watchdog::longest_with_drawing() {
    return std::exchange(longest_with_drawing_, 0.0);
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
    const double stall_loading = watchdog.longest();
    run_until([&] { return surfaces.settled() && !view.stale(); });

    const Geometry& g = session.scan()->volume.geometry();
    const int id = session.parameters().current;
    std::printf("scan        %lld x %lld x %lld %s, previews from every %d. sample\n",
                static_cast<long long>(g.dims[0]), static_cast<long long>(g.dims[1]),
                static_cast<long long>(g.dims[2]), sample_type_name(session.scan()->volume.type()),
                1 << surfaces.preview_level());
    std::printf("loading     %.0f ms, longest stall %.0f ms\n", loading, stall_loading);

    // The hand: moves of a few values each, 16 ms apart, with a rest after every twenty.
    std::vector<double> previews, previews_drawn, rests, rests_drawn, full_frames, preview_frames;
    watchdog.longest();
    watchdog.longest_with_drawing();
    const double start = session.current()->isovalue;
    const double range = (session.scan()->histogram.upper - session.scan()->histogram.lower) / 20;
    for (int rest = 0; rest < 6; ++rest) {
        double drawn_before = 0;
        for (int move = 0; move < 20; ++move) {
            bool arrived = false;
            double elapsed = 0;
            const auto connection =
                QObject::connect(&surfaces, &Surfaces::shape_changed, &window, [&](int changed) {
                    if (changed != id || arrived) return;
                    arrived = true;
                    elapsed = static_cast<double>(clock.nsecsElapsed()) / 1e6;
                });
            drawn_before = view.drawing_milliseconds();
            clock.restart();
            session.set_isovalue(start + range * ((rest * 20 + move) % 40 + 1) / 40);
            run_until([&] { return arrived; });
            QObject::disconnect(connection);
            previews_drawn.push_back(elapsed);
            previews.push_back(elapsed - (view.drawing_milliseconds() - drawn_before));
            if (move < 19) {
                pause(16);
                preview_frames.push_back(view.frame_milliseconds());
            }
        }
        // The clock still runs from the last move.
        run_until([&] { return surfaces.exact(id) != nullptr; });
        const double elapsed = static_cast<double>(clock.nsecsElapsed()) / 1e6;
        rests_drawn.push_back(elapsed);
        rests.push_back(elapsed - (view.drawing_milliseconds() - drawn_before));
        run_until([&] { return surfaces.settled() && !view.stale(); });
        full_frames.push_back(view.frame_milliseconds());
    }
    const double stall_extracting = watchdog.longest(), with_drawing = watchdog.longest_with_drawing();
    const auto shape = surfaces.exact(id);
    std::printf("surface     %zu triangles\n", shape->mesh->triangles.size());
    std::printf("preview     with the renderer %.0f ms after a move (median; 95 %%: %.0f ms)\n",
                part(previews, 0.5), part(previews, 0.95));
    std::printf("full        with the renderer %.0f ms after the last move (median; longest %.0f ms)\n",
                part(rests, 0.5), part(rests, 1));
    std::printf("extracting  longest stall %.0f ms\n", stall_extracting);

    QTemporaryDir folder;
    bool written = false;
    QObject::connect(&window, &MainWindow::written, &window, [&] { written = true; });
    watchdog.longest();
    clock.restart();
    window.write({{id, std::filesystem::path(folder.path().toStdString()) / "surface.stl"}}, Space::LPS);
    run_until([&] { return written; });
    std::printf("exporting   %.0f ms, longest stall %.0f ms\n", static_cast<double>(clock.elapsed()),
                watchdog.longest());
    std::printf("drawing     %s: previews %.0f ms, full %.0f ms a frame (medians)\n",
                view.software() ? "OpenGL runs on the processor" : "OpenGL runs on a graphics card",
                part(preview_frames, 0.5), part(full_frames, 0.5));
    std::printf(
        "            with it, previews come after %.0f ms, full after %.0f ms; longest stall %.0f ms\n",
        part(previews_drawn, 0.5), part(rests_drawn, 0.5), with_drawing);
    return 0;
}

}  // namespace marrow::viewer
