/// Extracts and measures the surfaces in the background, previews first.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <vtkPolyData.h>
#include <vtkSmartPointer.h>
#include <QObject>
#include <QTimer>

#include <marrow/measure.h>
#include <marrow/mesh.h>
#include <marrow/trust.h>

#include "session.h"
#include "worker.h"

namespace marrow::viewer {

/// The result of one extraction.
struct Shape {
    double isovalue = 0;
    int level = 0;                          ///< 0: full resolution
    std::shared_ptr<const Mesh> mesh;       ///< this is exported
    vtkSmartPointer<vtkPolyData> polydata;  ///< shares the mesh's memory
    std::vector<std::string> warnings;      ///< of the steps after extraction, as on the command line
    double milliseconds = 0;                ///< duration of the extraction alone
    std::optional<TrustReport> trust;       ///< if colours show it; `polydata` shares its memory
    std::optional<MeshMeasures> measures;   ///< set later
    /// Set later, in full resolution, if the mesh was smoothed or reduced. Isosurfaces have none.
    std::optional<std::int64_t> self_intersections;
};

/// Keeps the shapes up to date with the session. While parameters change, each surface gets previews; after a
/// short pause, it is extracted in full resolution. A device extracts in full resolution all the
/// time, unless surfaces are smoothed or reduced.
class Surfaces : public QObject {
    Q_OBJECT
  public:
    /// Extracts on the device of this number in gpu::devices(), or without one on the CPU.
    explicit Surfaces(Session& session, std::optional<std::size_t> device = {}, QObject* parent = nullptr);
    ~Surfaces() override;

    /// The newest shape of a surface; null before the first.
    std::shared_ptr<const Shape> shape(int id) const;
    /// The last preview; null if the scan is small enough to need none.
    std::shared_ptr<const Shape> preview(int id) const;
    /// The shape in full resolution; null while it does not match the parameters.
    std::shared_ptr<const Shape> exact(int id) const;
    /// The visible surfaces that are not in full resolution yet. Pictures wait for them.
    std::vector<int> unfinished() const;
    /// Why the requested surface could not be extracted, measured or checked; empty while nothing has failed.
    QString failure(int id) const;
    /// Whether all surfaces are extracted in full resolution and measured.
    bool settled() const;
    /// Requests full resolution now, without waiting for the pause.
    void settle();
    /// Previews take every 2^level-th sample.
    int preview_level() const { return preview_level_; }
    /// What extracts: the name of the device, or "CPU".
    QString device_name() const;

  signals:
    void shape_changed(int id);
    void measured(int id);
    void removed(int id);
    void failed(const QString& message);
    /// What extracts has changed. `reason`, if it is not empty, is why the device failed; the CPU
    /// takes over until the next scan.
    void device_changed(const QString& reason);

  private:
    struct Source;
    /// What is done to an extracted surface.
    struct Refinement {
        bool largest = false;
        int components = 0, smooth = 0, keep = 100;
        bool operator==(const Refinement&) const = default;
    };
    static Mesh refine(const Mesh& extracted, const Refinement& refinement, bool preview,
                       const Progress& progress, std::vector<std::string>& warnings);
    struct State {
        std::shared_ptr<Shape> newest, preview;
        double isovalue = 0;  // requested
        int request = 0;      // number of the newest request
        QString failure;      // of this request; empty: none
        bool exact = false;   // `newest` matches the request in full resolution
        bool waits = false;   // full resolution will be requested after the pause
    };

    void follow();
    bool uses_device() const;
    void give_up_device(const std::shared_ptr<const Scan>& scan, const QString& reason);
    int needed_preview_level() const;
    void request(int id, double isovalue);
    Worker::Job guarded(int id, Worker::Job job);
    void post(int id, int level);
    void accept(int id, int request, const std::shared_ptr<const Scan>& scan, std::shared_ptr<Shape> shape);
    void post_measure(int id, std::shared_ptr<Shape> shape);
    void post_check(int id, const std::shared_ptr<Shape>& shape);

    Session& session_;
    const std::optional<std::size_t> device_;
    bool device_failed_ = false;  // with this scan
    Refinement refinement_;
    bool with_trust_ = false;
    std::shared_ptr<Source> source_;
    std::map<int, State> states_;
    int preview_level_ = 0;
    int requests_ = 0;
    QTimer pause_;
    Worker measuring_, extracting_;  // last, so that they end first
};

/// The names of the point arrays of `Shape::polydata` that have trust.
inline constexpr const char *kShiftArray = "shift_mm", *kNoiseArray = "noise_mm";

/// The mesh as VTK data that borrows its memory. The mesh must outlive the result.
vtkSmartPointer<vtkPolyData> to_polydata(const Mesh& mesh);

}  // namespace marrow::viewer
