// marrow-viewer --measure: what a person waits for.
#pragma once

#include <QElapsedTimer>
#include <QTimer>

#include "main_window.h"

namespace marrow::viewer {

/// Finds out how long the window does not answer: how late a timer is that should fire every few milliseconds. Frames
/// of the 3D view are told apart, because without a graphics card they take as long as they take.
class Watchdog : public QObject {
    Q_OBJECT
  public:
    explicit Watchdog(const SurfaceView& view, QObject* parent = nullptr);
    struct Stall {
        double milliseconds = 0;  ///< drawing not counted
        double processor = 0;     ///< of these, what the window's thread worked itself: the rest, others did
        double with_drawing = 0;
    };
    /// The longest ones since the last call.
    Stall longest();

  private:
    const SurfaceView& view_;
    QTimer timer_;
    QElapsedTimer since_;
    double drawn_ = 0, drawn_processor_ = 0, worked_ = 0;
    Stall longest_;
};

/// Opens the scan in the window, moves the isovalue as a hand would, exports to a temporary file, and prints the times to
/// stdout. Returns the process's exit code.
int measure_viewer(MainWindow& window, const std::filesystem::path& input, const ScanOptions& options);

}  // namespace marrow::viewer
