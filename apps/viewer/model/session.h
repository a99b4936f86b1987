// What the person has opened and asked for. Knows no widget.
#pragma once

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
enum class Plane { axial, coronal, sagittal };
enum class Tool { navigate, distance, angle, crop };

struct SurfaceParameters {
    int id = 0;
    QString name;
    double isovalue = 0;
    QColor colour;
    double opacity = 1;
    bool visible = true;
    bool operator==(const SurfaceParameters&) const = default;
};

/// Two positions make a distance, three an angle at the second. LPS mm.
struct Measurement {
    std::vector<Vec3d> points;
    bool operator==(const Measurement&) const = default;

    double value() const;  ///< mm or degrees
    QString text() const;
};

/// The surfaces are drawn on one side only of the plane through the crosshair.
struct Cut {
    std::optional<Plane> plane;
    bool flipped = false;
    bool operator==(const Cut&) const = default;
};

/// The samples from `first` to `last`, both included, along i, j, k.
struct SampleBox {
    std::array<std::int64_t, 3> first{0, 0, 0}, last{0, 0, 0};
    bool operator==(const SampleBox&) const = default;
};

/// One of the six sides of a box of samples.
struct CropSide {
    std::size_t axis = 0;  ///< of the index
    bool upper = false;    ///< where the index is highest
};

/// Where a side is, as an index: half a sample beyond the outer samples, where closed surfaces end.
inline double border_of(const SampleBox& box, const CropSide& side) {
    return side.upper ? static_cast<double>(box.last[side.axis]) + 0.5
                      : static_cast<double>(box.first[side.axis]) - 0.5;
}

/// Which samples are black and white on the slices.
struct Window {
    double centre = 0;
    double width = 1;
    bool operator==(const Window&) const = default;
};

/// All that undo covers.
struct Parameters {
    std::vector<SurfaceParameters> surfaces;
    int current = 0;  ///< id of the one that the histogram moves
    bool largest = false;
    bool open = false;              ///< where the scan ends
    std::optional<SampleBox> crop;  ///< what surfaces are made of; none: the whole scan
    Cut cut;
    DrawMode mode = DrawMode::surface;
    Window window;
    std::vector<Measurement> measurements;
    bool operator==(const Parameters&) const = default;

    const SurfaceParameters* find(int id) const;
    SurfaceParameters* find(int id);
};

class Session : public QObject {
    Q_OBJECT
  public:
    explicit Session(QObject* parent = nullptr);

    const Scan* scan() const { return scan_.get(); }
    std::shared_ptr<const Scan> shared_scan() const { return scan_; }
    /// Starts anew with this scan: one surface, at bone or where Otsu parts the samples.
    void set_scan(std::shared_ptr<const Scan> scan);

    const Parameters& parameters() const { return parameters_; }
    /// The surface that the histogram moves; null without a scan.
    const SurfaceParameters* current() const { return parameters_.find(parameters_.current); }
    /// Changes parameters as one step of undo. Steps that follow each other with the same `run`, which is not empty, are
    /// one, until seal(): a drag is undone as a whole.
    void change(const QString& text, const QString& run, const std::function<void(Parameters&)>& edit);
    void seal() { ++run_; }
    QUndoStack& undo_stack() { return undo_; }

    void set_isovalue(double isovalue);
    void add_surface(const QString& name, double isovalue, const QColor& colour, double opacity);
    /// Sets the current surface to a preset of the command line.
    void apply_preset(const QString& name);
    void remove_surface(int id);
    void select_surface(int id);

    /// The samples that surfaces are made of.
    SampleBox crop() const;
    SampleBox whole_scan() const;
    /// Moves a side of the crop box so that this is its outer sample, as far as the scan reaches and its opposite side, which stays one
    /// sample away, lets it. Moves that follow each other are one step of undo, until seal().
    void move_crop_side(const CropSide& side, double sample);

    /// Where the crosshair is, as an index, which may be fractional; always inside the scan.
    const Vec3d& crosshair() const { return crosshair_; }
    Vec3d crosshair_position() const;  ///< LPS mm
    void set_crosshair(const Vec3d& index);

    Tool tool() const { return tool_; }
    void set_tool(Tool tool);
    /// Positions picked for a measurement that is not complete.
    const std::vector<Vec3d>& picked() const { return picked_; }
    /// Moves the crosshair or goes on measuring, as the tool says. LPS mm.
    void click(const Vec3d& position);
    void drop_picked();

  signals:
    void scan_changed();
    void parameters_changed();
    void crosshair_changed();
    void picking_changed();  ///< the tool, or the positions picked

  private:
    friend class Change;
    void restore(const Parameters& parameters);

    std::shared_ptr<const Scan> scan_;
    Parameters parameters_;
    QUndoStack undo_;
    int run_ = 0;
    int next_id_ = 1;
    Vec3d crosshair_{0, 0, 0};
    Tool tool_ = Tool::navigate;
    std::vector<Vec3d> picked_;
};

}  // namespace marrow::viewer
