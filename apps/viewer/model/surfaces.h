// The surfaces' shapes: extracted away from the window's thread, a preview first.
#pragma once

#include <map>
#include <memory>
#include <optional>

#include <vtkPolyData.h>
#include <vtkSmartPointer.h>
#include <QObject>
#include <QTimer>

#include <marrow/measure.h>
#include <marrow/mesh.h>

#include "session.h"
#include "worker.h"

namespace marrow::viewer {

/// One extraction's result.
struct Shape {
    double isovalue = 0;
    int level = 0;                          ///< 0: full resolution
    std::shared_ptr<const Mesh> mesh;       ///< what is exported
    vtkSmartPointer<vtkPolyData> polydata;  ///< shares the mesh's memory
    double milliseconds = 0;                ///< extraction alone
    std::optional<MeshMeasures> measures;   ///< come later
};

/// Keeps the shapes in step with the session. While parameters change, each surface follows by previews; when they
/// rest, full resolution comes.
class Surfaces : public QObject {
    Q_OBJECT
  public:
    explicit Surfaces(Session& session, QObject* parent = nullptr);
    ~Surfaces() override;

    /// The newest shape of a surface; null before the first.
    std::shared_ptr<const Shape> shape(int id) const;
    /// The last preview; null where the scan is small enough to need none.
    std::shared_ptr<const Shape> preview(int id) const;
    /// The shape in full resolution, if it is what the parameters ask for.
    std::shared_ptr<const Shape> exact(int id) const;
    /// All surfaces are there in full resolution, and measured.
    bool settled() const;
    /// Full resolution now, without waiting for a rest.
    void settle();
    /// Previews take every 2^level-th sample.
    int preview_level() const { return preview_level_; }

  signals:
    void shape_changed(int id);
    void measured(int id);
    void removed(int id);
    void failed(const QString& message);

  private:
    struct Source;
    struct State {
        std::shared_ptr<Shape> newest, preview;
        double isovalue = 0;  // asked for
        int request = 0;      // number of the newest request
        bool exact = false;   // newest is what was asked for
        bool waits = false;   // for full resolution, until the hand rests
    };

    void follow();
    void request(int id, double isovalue);
    void post(int id, int level);
    void accept(int id, int request, const std::shared_ptr<Source>& source, std::shared_ptr<Shape> shape);
    void post_measure(int id, std::shared_ptr<Shape> shape);

    Session& session_;
    bool largest_ = false;
    std::shared_ptr<Source> source_;
    std::map<int, State> states_;
    int preview_level_ = 0;
    int requests_ = 0;
    QTimer rest_;
    Worker measuring_, extracting_;  // last: they end first
};

/// The mesh as VTK data that shares its memory. It must be kept as long as the result.
vtkSmartPointer<vtkPolyData> to_polydata(const Mesh& mesh);

}  // namespace marrow::viewer
