// Scans are opened away from the window's thread.
#pragma once

#include <filesystem>
#include <memory>

#include <QObject>
#include <QString>

#include "scan.h"
#include "worker.h"

namespace marrow::viewer {

class Loader : public QObject {
    Q_OBJECT
  public:
    explicit Loader(QObject* parent = nullptr) : QObject(parent) {}

    /// Opens a scan; what was being opened before is given up.
    void open(const std::filesystem::path& input, const ScanOptions& options);
    void cancel();
    bool busy() const { return busy_; }

  signals:
    void started(const QString& name);
    void progressed(double fraction);
    void finished();  ///< in whatever way; comes before the others below
    void opened(const std::shared_ptr<const Scan>& scan);
    /// There are several series and none was asked for.
    void undecided(const std::filesystem::path& input, const ScanOptions& options, const ScanReport& report);
    void failed(const QString& sentence);

  private:
    template <class Tell>
    void tell(int request, Tell what);

    int request_ = 0;
    bool busy_ = false;
    Worker worker_;
};

}  // namespace marrow::viewer
