/// Writes mesh files in the background.
#pragma once

#include <atomic>
#include <filesystem>
#include <memory>
#include <optional>
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
    /// What the surfaces were extracted from.
    struct Source {
        std::shared_ptr<const Scan> scan;
        std::optional<SampleBox> crop;
        bool open = false, topology = false;
        bool refined = false;  ///< the meshes were changed after their extraction
        bool trust = false;    ///< how far they can be trusted is written too: all shapes have it
    };

    explicit MeshWriter(QObject* parent = nullptr) : QObject(parent) {}

    /// Writes all files; none appears before all are complete. \pre not busy, and at least one file
    void write(std::vector<File> files, Space space, Source source);
    /// Stops writing and then emits `finished`. Existing files stay as they were.
    void cancel() { cancelled_ = true; }
    bool busy() const { return busy_; }

  signals:
    void started();
    void progressed(double fraction);
    /// `warnings` are those of the command line, one per line.
    void finished(const QString& message, bool error, const QString& warnings);

  private:
    bool busy_ = false;
    std::atomic<bool> cancelled_{false};
    Worker worker_;
};

}  // namespace marrow::viewer
