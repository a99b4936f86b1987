// The window: what stands where, and what happens when.
#pragma once

#include <QLabel>
#include <QMainWindow>
#include <QProgressBar>
#include <QSplitter>
#include <QStackedWidget>
#include <QTimer>
#include <QToolButton>

#include "actions.h"
#include "banner.h"
#include "control_bar.h"
#include "dialogs.h"
#include "model/loader.h"
#include "side_panel.h"
#include "model/session.h"
#include "views/slice_view.h"
#include "views/surface_view.h"
#include "model/surfaces.h"
#include "welcome.h"
#include "model/mesh_writer.h"

namespace marrow::viewer {

class MainWindow : public QMainWindow {
    Q_OBJECT
  public:
    /// Settings are remembered under the application's name, unless it has none.
    explicit MainWindow(QWidget* parent = nullptr);
    ~MainWindow() override;

    void open(const std::filesystem::path& input, const ScanOptions& options = {});
    /// Writes files away from the window's thread. \pre each surface is there in full resolution
    void write(const std::vector<ExportFile>& files, Space space);
    bool busy() const { return loader_.busy() || writer_.busy(); }

    Session& session() { return session_; }
    Surfaces& surfaces() { return surfaces_; }
    SurfaceView* surface_view() { return view_; }
    SliceView* slice_view(Plane plane) { return slices_[static_cast<std::size_t>(plane)]; }
    HistogramBar* histogram_bar() { return controls_->histogram(); }
    /// The sentence in the banner; empty where there is none.
    QString banner() const { return banner_->sentence(); }
    QString command() const { return controls_->command(); }

  signals:
    void written();  ///< or not: then the banner says why

  protected:
    void dragEnterEvent(QDragEnterEvent* event) override;
    void dropEvent(QDropEvent* event) override;
    void closeEvent(QCloseEvent* event) override;
    void resizeEvent(QResizeEvent* event) override;

  private:
    void make_views();
    void make_status_bar();
    void connect_actions();
    void connect_rest();
    void restore();

    void follow_scan();
    void show_progress(const QString& what);
    void hide_progress();
    void choose_scan(bool folder);
    void choose_series(const std::filesystem::path& input, const ScanOptions& options,
                       const ScanReport& report);
    void remember(const Scan& scan);
    void fill_recent();
    void export_surface();
    void save_picture();
    void save_turntable();

    Session session_;
    Surfaces surfaces_{session_};
    Loader loader_;
    Writer writer_;
    QString export_folder_;
    QTimer turning_;

    Actions* actions_;
    QStackedWidget* stack_;
    Welcome* welcome_;
    QSplitter *columns_, *slice_column_, *rows_;
    Panel* panel_;
    SurfaceView* view_;
    std::array<SliceView*, 3> slices_;
    ControlBar* controls_;
    Banner* banner_;
    QLabel* facts_;
    QProgressBar* progress_;
    QToolButton* cancel_;
};

}  // namespace marrow::viewer
