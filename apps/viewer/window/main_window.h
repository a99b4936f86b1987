/// The main window: lays out the views and connects them with loading, exporting and the actions.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

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
#include "field_keys.h"
#include "model/loader.h"
#include "model/mesh_writer.h"
#include "model/session.h"
#include "model/surfaces.h"
#include "side_panel.h"
#include "views/screenshots.h"
#include "views/view_layout.h"
#include "welcome.h"

namespace marrow::viewer {

class MainWindow : public QMainWindow {
    Q_OBJECT
  public:
    /// Remembers its settings under the name of the application. Surfaces are extracted on the device of this
    /// number in gpu::devices(), or without one on the CPU.
    explicit MainWindow(std::optional<std::size_t> device = {}, QWidget* parent = nullptr);
    ~MainWindow() override;

    /// Replaces the scan as soon as the input is loaded. Asks first if that may discard work since this call.
    void open(const std::filesystem::path& input, const ScanOptions& options = {});
    /// Writes files in the background. \pre each surface is extracted in full resolution
    void write(const std::vector<ExportFile>& files, Space space);
    /// Saves what a session file holds, or shows why that fails. Returns whether it is saved.
    bool save_session(const std::filesystem::path& file);
    bool busy() const { return loader_.busy() || writer_.busy() || pictures_; }

    Session& session() { return session_; }
    const Loader& loader() const { return loader_; }
    Surfaces& surfaces() { return surfaces_; }
    ViewLayout* views() { return views_; }
    SurfaceView* surface_view() { return view_; }
    SliceView* slice_view(Plane plane) { return views_->slice_view(plane); }
    HistogramBar* histogram_bar() { return controls_->histogram(); }
    /// The message of the banner; empty without one.
    QString banner() const { return banner_->message(); }
    QString command() const { return controls_->command(); }

  signals:
    void written();  ///< emitted after failures too; then the banner shows the reason

  protected:
    void dragEnterEvent(QDragEnterEvent* event) override;
    void dropEvent(QDropEvent* event) override;
    void closeEvent(QCloseEvent* event) override;
    void resizeEvent(QResizeEvent* event) override;
    void changeEvent(QEvent* event) override;

  private:
    void make_views();
    void make_status_bar();
    void connect_actions();
    void connect_views();
    void connect_loader();
    void connect_writer();
    void restore_settings();

    void follow_scan();
    void cancel_or_dismiss();
    void show_opened(const std::filesystem::path& input, const std::shared_ptr<const Scan>& scan,
                     const std::shared_ptr<const SavedSession>& session);
    /// Calls `proceed`, but asks first if that would discard work.
    void discard_work(const std::function<void()>& proceed);
    /// Opens it, but asks first if that would discard work. The `remark` is shown with those about the scan.
    void open_instead(const std::filesystem::path& input, const QString& remark = {});
    bool choose_session_file();
    SavedSession session_to_save() const;
    bool save_session(const SavedSession& saved, const std::shared_ptr<const Scan>& scan,
                      const std::filesystem::path& file);
    void save_measurements();
    void inform(const QString& message);
    void show_device(const QString& failure);
    void show_progress(const QString& message);
    void hide_progress();
    void choose_scan(bool folder);
    void ask(const OpenQuestion& question);
    void remember(const std::filesystem::path& input);
    void fill_recent();
    void export_surface();
    void remember_export_folder(const std::filesystem::path& file);
    void save_screenshot();
    void save_turntable();
    void start_turntable(int frames, const QSize& size, const QString& folder);
    void take_pictures(int frames, const QSize& size, const Pictures::Use& use, const QString& done);

    Session session_;
    Surfaces surfaces_;
    Loader loader_;
    MeshWriter writer_;
    Pictures* pictures_ = nullptr;  // being taken
    QString export_folder_;
    QTimer turning_;

    FieldKeys* fields_;
    Actions* actions_;
    QStackedWidget* stack_;
    Welcome* welcome_;
    QSplitter *columns_, *rows_;
    SidePanel* panel_;
    ViewLayout* views_;
    SurfaceView* view_;
    ControlBar* controls_;
    Banner* banner_;
    QLabel *facts_, *device_;
    QProgressBar* progress_;
    QToolButton *cancel_, *remarks_;
    QString remarks_text_, next_remark_;  // what the button shows; what to show with the next scan
    std::filesystem::path session_file_;  // of the session that is shown; empty: none
    bool changed_since_open_ = false;     // so there may be work that the user did not agree to lose
    bool discards_ = false;               // the user agreed to lose the work
    bool close_when_written_ = false;     // the user closed the window during an export
};

}  // namespace marrow::viewer
