/// Opens scans in the background.
#pragma once

#include <exception>
#include <filesystem>
#include <memory>
#include <vector>

#include <QObject>
#include <QString>

#include "scan.h"
#include "session_file.h"
#include "worker.h"

namespace marrow::viewer {

/// What the user has to decide before an input can be opened.
struct OpenQuestion {
    enum class About { series, spacing, uneven_slices };

    About about;
    std::filesystem::path input;
    ScanOptions options;
    /// With these options; of a series with several volumes, about the one that they name, or the first. If
    /// only one series is meant, the report has no others.
    ScanReport report;
    std::vector<bool> readable;  ///< which of its series can perhaps be read, after further questions
};

class Loader : public QObject {
    Q_OBJECT
  public:
    explicit Loader(QObject* parent = nullptr) : QObject(parent) {}

    /// Starts to open a scan, or a session file with its scan. Cancels one that is still being opened.
    void open(const std::filesystem::path& input, const ScanOptions& options);
    void cancel();
    bool busy() const { return busy_; }
    /// Why the last input could not be opened as it was given; null if it is open, or still being opened.
    std::exception_ptr failure() const { return failure_; }

  signals:
    void started(const QString& name);
    void progressed(double fraction);
    void finished();  ///< always emitted, before one of the signals below
    /// `session` is null unless the input is a session file.
    void opened(const std::filesystem::path& input, const std::shared_ptr<const Scan>& scan,
                const std::shared_ptr<const SavedSession>& session);
    void undecided(const OpenQuestion& question);
    void failed(const QString& message);

  private:
    template <class Action>
    void on_own_thread(int request, Action action);

    int request_ = 0;
    bool busy_ = false;
    std::exception_ptr failure_;
    Worker worker_;
};

}  // namespace marrow::viewer
