// Surfaces are written away from the window's thread.
#pragma once

#include <atomic>
#include <filesystem>
#include <memory>
#include <vector>

#include <QObject>
#include <QString>

#include <marrow/mesh_io.h>

#include "surfaces.h"
#include "worker.h"

namespace marrow::viewer {

class Writer : public QObject {
    Q_OBJECT
  public:
    struct File {
        std::shared_ptr<const Shape> shape;  ///< whose mesh the object borrows
        MeshObject object;
        std::filesystem::path path;
    };

    explicit Writer(QObject* parent = nullptr) : QObject(parent) {}

    /// Writes them; none appears before all are complete. \pre not busy; at least one file
    void write(std::vector<File> files, Space space);
    /// Stops, which `finished` tells; files that were there before stay as they were.
    void cancel() { cancelled_ = true; }
    bool busy() const { return busy_; }

  signals:
    void started();
    void progressed(double fraction);
    void finished(const QString& sentence, bool error);

  private:
    bool busy_ = false;
    std::atomic<bool> cancelled_{false};
    Worker worker_;
};

}  // namespace marrow::viewer
