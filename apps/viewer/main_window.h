// The window: what stands where, and the actions.
#pragma once

#include <QActionGroup>
#include <QDoubleSpinBox>
#include <QLabel>
#include <QLineEdit>
#include <QMainWindow>
#include <QProgressBar>
#include <QPushButton>
#include <QSplitter>
#include <QStackedWidget>
#include <QTimer>
#include <QToolButton>

#include "dialogs.h"
#include "histogram_bar.h"
#include "loading.h"
#include "panel.h"
#include "session.h"
#include "slice_view.h"
#include "surface_view.h"
#include "surfaces.h"

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
    bool busy() const { return loader_.busy() || writing_; }

    Session& session() { return session_; }
    Surfaces& surfaces() { return surfaces_; }
    SurfaceView* surface_view() { return view_; }
    SliceView* slice_view(Plane plane) { return slices_[static_cast<std::size_t>(plane)]; }
    HistogramBar* histogram_bar() { return histogram_; }
    /// The sentence in the banner; empty where there is none.
    QString banner() const;
    QString command() const { return command_->text(); }

  signals:
    void written();  ///< or not: then the banner says why

  protected:
    void dragEnterEvent(QDragEnterEvent* event) override;
    void dropEvent(QDropEvent* event) override;
    void closeEvent(QCloseEvent* event) override;

  private:
    QAction* action(const QString& name, const QString& text, const QKeySequence& shortcut,
                    const QString& tip);
    void make_actions();
    void make_menus();
    void make_tool_bar();
    QWidget* make_welcome();
    QWidget* make_bottom();
    void make_banner();
    void connect_all();

    void follow_scan();
    void follow_parameters();
    void follow_command();
    void choose_scan(bool folder);
    void choose_series(const std::filesystem::path& input, const ScanOptions& options,
                       const ScanReport& report);
    void remember(const Scan& scan);
    void fill_recent();
    void say(const QString& sentence, bool error);
    void place_banner();
    void export_surface();
    void save_picture();
    void save_turntable();
    void show_about();
    void show_keys();
    void resizeEvent(QResizeEvent* event) override;

    Session session_;
    Surfaces surfaces_{session_};
    Loader loader_;
    Worker writer_;
    bool writing_ = false;
    QString export_folder_;

    QStackedWidget* stack_;
    QSplitter *columns_, *slice_column_, *rows_;
    Panel* panel_;
    SurfaceView* view_;
    std::array<SliceView*, 3> slices_;
    HistogramBar* histogram_;
    QDoubleSpinBox* isovalue_;
    std::vector<QPushButton*> chips_;
    QLineEdit* command_;
    QFrame* banner_;
    QLabel* banner_text_;
    QLabel* facts_;
    QProgressBar* progress_;
    QToolButton* cancel_;
    QTimer turning_, banner_timer_;
    QMenu* recent_;
    QWidget* welcome_recent_;
    QActionGroup *modes_, *tools_, *cuts_;
    std::map<QString, QAction*> actions_;
};

}  // namespace marrow::viewer
