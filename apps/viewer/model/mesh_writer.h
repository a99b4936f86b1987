/// Writes mesh files in the background.
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

class MeshWriter : public QObject {
    Q_OBJECT
  public:
    struct File {
        std::shared_ptr<const Shape> shape;  ///< owns the mesh that `object` refers to
        MeshObject object;
        std::filesystem::path path;
    };

    explicit MeshWriter(QObject* parent = nullptr) : QObject(parent) {}

    /// Writes all files; none appears before all are complete. \pre not busy, and at least one file
    void write(std::vector<File> files, Space space);
    /// Stops writing and then emits `finished`. Existing files stay as they were.
    void cancel() { cancelled_ = true; }
    bool busy() const { return busy_; }

  signals:
    void started();
    void progressed(double fraction);
    void finished(const QString& message, bool error);

  private:
    bool busy_ = false;
    std::atomic<bool> cancelled_{false};
    Worker worker_;
};

}  // namespace marrow::viewer
