/// The state of the viewer: the scan, all parameters, and undo. Independent of widgets.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include <QColor>
#include <QObject>
#include <QString>
#include <QUndoStack>

#include "scan.h"

namespace marrow::viewer {

enum class DrawMode { surface, edges, wireframe, points };
/// What colours show: which surface it is, how far it moves with the isovalue, or how far noise moves it.
enum class Colouring { own, shift, noise };
enum class Plane { axial, coronal, sagittal };
enum class Tool { navigate, distance, angle, crop };

struct SurfaceParameters {
    int id = 0;
    QString name;  ///< given by the user; empty: surface_name() decides
    double isovalue = 0;
    QColor colour;
    double opacity = 1;
    bool visible = true;
    bool operator==(const SurfaceParameters&) const = default;
};

/// The name that the user gave the surface; without one, that of the preset or method with its isovalue.
QString surface_name(const Scan& scan, const SurfaceParameters& surface);

/// Two positions make a distance, three an angle at the second. LPS mm.
struct Measurement {
    std::vector<Vec3d> points;
    bool operator==(const Measurement&) const = default;

    double value() const;  ///< mm or degrees
    QString text() const;
};

/// Surfaces are drawn only on one side of the plane through the crosshair.
struct Cut {
    std::optional<Plane> plane;
    bool flipped = false;
    bool operator==(const Cut&) const = default;
};

/// The samples from `first` to `last`, both inclusive, along i, j and k.
struct SampleBox {
    std::array<std::int64_t, 3> first{0, 0, 0}, last{0, 0, 0};
    bool operator==(const SampleBox&) const = default;
};

/// One of the six sides of a box of samples.
struct CropSide {
    std::size_t axis = 0;  ///< index axis
    bool upper = false;    ///< the side with the highest index
};

/// The position of a side on its index axis: half a sample beyond the outer samples, where closed surfaces
/// end.
inline double border_of(const SampleBox& box, const CropSide& side) {
    return side.upper ? static_cast<double>(box.last[side.axis]) + 0.5
                      : static_cast<double>(box.first[side.axis]) - 0.5;
}

/// The values that slices show between black and white.
struct Window {
    double centre = 0;
    double width = 1;
    bool operator==(const Window&) const = default;

    /// How many of the 255 steps from black to white a difference of 1 takes; finite even without a width.
    double greys_per_value() const { return 255 / std::max(width, 1e-300); }
};

/// The window of all values; its width is 1 if they are equal.
Window window_of_all_values(const Histogram& histogram);

/// Everything that undo covers.
struct Parameters {
    static constexpr int kMostComponents = 1000, kMostSmoothing = 200;
    static constexpr std::size_t kMostSurfaces = 100;

    std::vector<SurfaceParameters> surfaces;
    int current = 0;                ///< id of the surface whose isovalue the histogram moves
    bool largest = false;           ///< keep only the largest component
    int components = 0;             ///< keep this many components, if not `largest`; 0: all
    int smooth = 0;                 ///< iterations of smoothing; 0: none
    int keep = 100;                 ///< reduce surfaces to this part of their triangles, %
    bool open = false;              ///< leave surfaces open at the border of the scan
    bool topology = false;          ///< as IsosurfaceOptions::topology
    std::optional<SampleBox> crop;  ///< surfaces use only these samples; none: the entire scan
    Cut cut;
    DrawMode mode = DrawMode::surface;
    Colouring colouring = Colouring::own;
    Window window;
    std::vector<Measurement> measurements;
    bool operator==(const Parameters&) const = default;

    /// Whether surfaces are more than the isosurface of the samples.
    bool refined() const { return largest || components > 0 || smooth > 0 || keep < 100; }
    const SurfaceParameters* find(int id) const;
    SurfaceParameters* find(int id);
};

class Session : public QObject {
    Q_OBJECT
  public:
    explicit Session(QObject* parent = nullptr);

    const Scan* scan() const { return scan_.get(); }
    std::shared_ptr<const Scan> shared_scan() const { return scan_; }
    /// Starts over with this scan and one surface: bone, or at the isovalue of Otsu's method.
    void set_scan(std::shared_ptr<const Scan> scan);
    /// Replaces all parameters, for instance by those of a session file, and forgets undo. The ids of the
    /// surfaces may be any distinct ones. \pre there is a scan, and at least one surface
    void resume(Parameters parameters, const Vec3d& crosshair);
    /// Whether there is work that takes long to do again: further surfaces, a crop box or measurements, since
    /// the last set_saved().
    bool has_unsaved_work() const;
    void set_saved() { undo_.setClean(); }

    const Parameters& parameters() const { return parameters_; }
    /// The surface whose isovalue the histogram moves; null without a scan.
    const SurfaceParameters* current() const { return parameters_.find(parameters_.current); }
    /// Changes parameters as one step of undo. Successive changes with the same nonempty `merge_key` form one
    /// step, until end_step(): one undo reverts an entire drag.
    void change(const QString& text, const QString& merge_key, const std::function<void(Parameters&)>& edit);
    void end_step() { ++step_; }
    QUndoStack& undo_stack() { return undo_; }

    void set_isovalue(double isovalue);
    /// Selects the new surface. Does nothing if there are as many as a session may have.
    void add_surface(const QString& name, double isovalue, const QColor& colour, double opacity);
    /// Applies a tissue preset to the current surface.
    void apply_preset(const QString& name);
    void remove_surface(int id);
    void select_surface(int id);

    /// The crop box, or the entire scan without one.
    SampleBox crop() const;
    SampleBox whole_scan() const;
    /// Moves a side of the crop box so that `sample` is its outer sample. It stays inside the scan and at
    /// least one sample from the opposite side. Successive moves form one step of undo, until end_step().
    void move_crop_side(const CropSide& side, double sample);

    /// The index of the crosshair, which may be fractional; always inside the scan.
    const Vec3d& crosshair() const { return crosshair_; }
    Vec3d crosshair_position() const;  ///< LPS mm
    void set_crosshair(const Vec3d& index);

    Tool tool() const { return tool_; }
    void set_tool(Tool tool);
    /// The positions picked so far for an incomplete measurement.
    const std::vector<Vec3d>& picked() const { return picked_; }
    /// Moves the crosshair or adds a position to the measurement, depending on the tool. LPS mm.
    void click(const Vec3d& position);
    void clear_picked();

  signals:
    void scan_changed();
    void parameters_changed();
    void crosshair_changed();
    void picking_changed();  ///< the tool or the picked positions

  private:
    friend class Change;
    void restore(const Parameters& parameters);

    std::shared_ptr<const Scan> scan_;
    Parameters parameters_;
    QUndoStack undo_;
    int step_ = 0;  // counts the ends of steps
    int next_id_ = 1;
    Vec3d crosshair_{0, 0, 0};
    Tool tool_ = Tool::navigate;
    std::vector<Vec3d> picked_;
};

}  // namespace marrow::viewer
