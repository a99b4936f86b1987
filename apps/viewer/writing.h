// Surfaces are written away from the window's thread.
#pragma once

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

    /// Writes one after the other. \pre not busy; at least one file
    void write(std::vector<File> files, Space space);
    /// Stops; files that were there before stay as they were.
    void cancel() { worker_.forget_all(); }
    bool busy() const { return busy_; }

  signals:
    void started();
    void progressed(double fraction);
    void finished(const QString& sentence, bool error);

  private:
    bool busy_ = false;
    Worker worker_;
};

}  // namespace marrow::viewer
