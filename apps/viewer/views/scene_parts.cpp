// Builds and updates the VTK actors of the scene.
#include "scene_parts.h"

#include <algorithm>
#include <cmath>

#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkShaderProperty.h>
#include <vtkTextProperty.h>

#include "slice_geometry.h"

namespace marrow::viewer {

namespace {

constexpr double kThinLine = 1.5, kMarkLine = 2.5, kMarkDot = 8, kHandle = 11;

void set_widths(vtkActor* actor, double line, double dot) {
    actor->GetProperty()->SetLineWidth(static_cast<float>(line));
    actor->GetProperty()->SetPointSize(static_cast<float>(dot));
}

}  // namespace

QColor plane_colour(Plane plane) {
    switch (plane) {
        case Plane::axial:
            return {0xf3, 0x4a, 0x33};
        case Plane::coronal:
            return {0x6e, 0xb0, 0x4b};
        case Plane::sagittal:
            break;
    }
    return {0xed, 0xd5, 0x4c};
}

CutFace::CutFace() {
    vtkNew<vtkPoints> points;
    points->SetNumberOfPoints(4);
    vtkNew<vtkFloatArray> corners;
    corners->SetNumberOfComponents(2);
    for (const auto& [u, v] : {std::pair{0.F, 0.F}, {1.F, 0.F}, {1.F, 1.F}, {0.F, 1.F}}) {
        const float uv[2]{u, v};
        corners->InsertNextTuple(uv);
    }
    vtkNew<vtkCellArray> cells;
    const vtkIdType ids[4]{0, 1, 2, 3};
    cells->InsertNextCell(4, ids);
    quad_->SetPoints(points);
    quad_->SetPolys(cells);
    quad_->GetPointData()->SetTCoords(corners);

    texture_->SetInputData(pixels_);
    texture_->InterpolateOn();
    texture_->SetWrap(vtkTexture::ClampToEdge);
    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputData(quad_);
    actor_->SetMapper(mapper);
    actor_->SetTexture(texture_);
    actor_->GetProperty()->LightingOff();
    actor_->ForceOpaqueOn();
    actor_->GetShaderProperty()->AddFragmentShaderReplacement("//VTK::TCoord::Impl", false,
                                                              "//VTK::TCoord::Impl\n"
                                                              "  if (gl_FragData[0].a < 0.5) discard;\n"
                                                              "  gl_FragData[0].a = 1.0;\n",
                                                              false);
    actor_->VisibilityOff();
}

void CutFace::show(const Scan& scan, const SampleBox& box, Plane plane, const Vec3d& crosshair,
                   const Window& window, double lowest_isovalue) {
    const Geometry& geometry = scan.volume.geometry();
    const SliceGeometry slice = slice_geometry(geometry, plane);
    const std::int64_t through = std::llround(crosshair[static_cast<std::size_t>(slice.through)]);
    const std::vector<float> samples = slice_samples(scan.volume, slice, through);
    const double lowest = slice_isovalue(scan.volume, lowest_isovalue);
    const auto [width, height] = slice.size;

    pixels_->SetDimensions(static_cast<int>(width), static_cast<int>(height), 1);
    pixels_->AllocateScalars(VTK_UNSIGNED_CHAR, 4);
    auto* to = static_cast<unsigned char*>(pixels_->GetScalarPointer());
    const double black = window.centre - window.width / 2;
    const double scale = window.greys_per_value();
    const SliceRange range = slice_range(slice, box, through);
    const float* from = samples.data();
    for (std::int64_t v = 0; v < height; ++v) {
        for (std::int64_t u = 0; u < width; ++u) {
            const float sample = *from++;
            const double grey = std::clamp((sample - black) * scale, 0.0, 255.0);
            const auto g = static_cast<unsigned char>(std::isfinite(sample) ? grey : 0);
            *to++ = g;
            *to++ = g;
            *to++ = g;
            *to++ = sample >= lowest && range.contains(u, v) ? 255 : 0;
        }
    }
    pixels_->Modified();

    // Samples are points, but pixels have an area: the image extends half a sample beyond the outer samples.
    const double right = static_cast<double>(width) - 0.5, bottom = static_cast<double>(height) - 0.5;
    Vec3d index = crosshair;
    index[static_cast<std::size_t>(slice.through)] = static_cast<double>(through);
    const QPointF corners[4]{{-0.5, -0.5}, {right, -0.5}, {right, bottom}, {-0.5, bottom}};
    for (int i = 0; i < 4; ++i)
        quad_->GetPoints()->SetPoint(i, geometry.physical(slice.to_index(corners[i], index)).data());
    quad_->GetPoints()->Modified();
    quad_->Modified();
    actor_->VisibilityOn();
}

Crosshair::Crosshair() {
    constexpr std::array<Plane, 3> kNormalTo{Plane::sagittal, Plane::coronal, Plane::axial};
    for (std::size_t i = 0; i < 3; ++i) {
        vtkNew<vtkPoints> points;
        points->SetDataTypeToDouble();
        points->SetNumberOfPoints(2);
        vtkNew<vtkCellArray> cells;
        const vtkIdType ids[2]{0, 1};
        cells->InsertNextCell(2, ids);
        lines_[i].data->SetPoints(points);
        lines_[i].data->SetLines(cells);
        vtkNew<vtkPolyDataMapper> mapper;
        mapper->SetInputData(lines_[i].data);
        lines_[i].actor->SetMapper(mapper);
        const QColor colour = plane_colour(kNormalTo[i]);
        lines_[i].actor->GetProperty()->SetColor(colour.redF(), colour.greenF(), colour.blueF());
        lines_[i].actor->GetProperty()->LightingOff();
        lines_[i].actor->VisibilityOff();
    }
}

void Crosshair::add_to(vtkRenderer* renderer) {
    for (Line& line : lines_) renderer->AddActor(line.actor);
}

void Crosshair::set_position(const Geometry& geometry, const Vec3d& index) {
    for (const Plane plane : {Plane::sagittal, Plane::coronal, Plane::axial}) {
        const std::size_t i = 2 - static_cast<std::size_t>(plane);  // the order of kNormalTo
        const auto along = static_cast<std::size_t>(slice_geometry(geometry, plane).through);
        Vec3d from = index, to = index;
        from[along] = 0;
        to[along] = static_cast<double>(geometry.dims[along] - 1);
        lines_[i].data->GetPoints()->SetPoint(0, geometry.physical(from).data());
        lines_[i].data->GetPoints()->SetPoint(1, geometry.physical(to).data());
        lines_[i].data->GetPoints()->Modified();
        lines_[i].data->Modified();
    }
    has_position_ = true;
    set_visible(visible_);
}

void Crosshair::set_visible(bool visible) {
    visible_ = visible;
    for (Line& line : lines_) line.actor->SetVisibility(visible_ && has_position_);
}

void Crosshair::set_pixel_ratio(double ratio) {
    for (Line& line : lines_) set_widths(line.actor, kThinLine * ratio, 1);
}

CropBox::CropBox() {
    vtkNew<vtkPoints> corners, middles;
    for (vtkPoints* points : {corners.Get(), middles.Get()}) points->SetDataTypeToDouble();
    corners->SetNumberOfPoints(8);
    middles->SetNumberOfPoints(6);
    vtkNew<vtkCellArray> lines, dots;
    for (vtkIdType corner = 0; corner < 8; ++corner) {
        for (const vtkIdType bit : {1, 2, 4}) {
            const vtkIdType ends[2]{corner, corner | bit};
            if ((corner & bit) == 0) lines->InsertNextCell(2, ends);
        }
    }
    for (vtkIdType i = 0; i < 6; ++i) dots->InsertNextCell(1, &i);
    edges_->SetPoints(corners);
    edges_->SetLines(lines);
    handles_->SetPoints(middles);
    handles_->SetVerts(dots);
    for (const auto& [data, actor] :
         {std::pair{edges_.Get(), edges_actor_.Get()}, {handles_.Get(), handles_actor_.Get()}}) {
        vtkNew<vtkPolyDataMapper> mapper;
        mapper->SetInputData(data);
        actor->SetMapper(mapper);
        vtkProperty* look = actor->GetProperty();
        look->SetColor(kCropColour.redF(), kCropColour.greenF(), kCropColour.blueF());
        look->LightingOff();
        look->RenderPointsAsSpheresOn();
        actor->VisibilityOff();
    }
}

void CropBox::add_to(vtkRenderer* renderer) {
    renderer->AddActor(edges_actor_);
    renderer->AddActor(handles_actor_);
}

void CropBox::set_box(const Geometry& geometry, const SampleBox& box) {
    for (vtkIdType corner = 0; corner < 8; ++corner) {
        Vec3d index;
        for (std::size_t a = 0; a < 3; ++a) index[a] = border_of(box, {a, (corner >> a & 1) != 0});
        edges_->GetPoints()->SetPoint(corner, geometry.physical(index).data());
    }
    for (std::size_t i = 0; i < kCropSides.size(); ++i)
        handles_->GetPoints()->SetPoint(static_cast<vtkIdType>(i),
                                        geometry.physical(handle(box, kCropSides[i])).data());
    for (vtkPolyData* data : {edges_.Get(), handles_.Get()}) {
        data->GetPoints()->Modified();
        data->Modified();
    }
}

void CropBox::set_visible(bool visible) {
    edges_actor_->SetVisibility(visible);
    handles_actor_->SetVisibility(visible);
}

void CropBox::set_pixel_ratio(double ratio) {
    for (vtkActor* actor : {edges_actor_.Get(), handles_actor_.Get()})
        set_widths(actor, kThinLine * ratio, kHandle * ratio);
}

Vec3d CropBox::handle(const SampleBox& box, const CropSide& side) {
    Vec3d index;
    for (std::size_t a = 0; a < 3; ++a) index[a] = static_cast<double>(box.first[a] + box.last[a]) / 2;
    index[side.axis] = border_of(box, side);
    return index;
}

void Marks::set_light(bool light) {
    light_ = light;
    const auto measurements = std::move(measurements_);
    measurements_.clear();
    show(measurements, picked_);
}

void Marks::show(const std::vector<Measurement>& measurements, const std::vector<Vec3d>& picked) {
    if (measurements == measurements_ && picked == picked_) return;
    for (const auto& line : lines_) renderer_->RemoveActor(line);
    for (const auto& label : labels_) renderer_->RemoveActor(label);
    lines_.clear();
    labels_.clear();
    measurements_ = measurements;
    picked_ = picked;
    for (const Measurement& measurement : measurements_) add(measurement.points, measurement.text());
    if (!picked_.empty()) add(picked_, {});
}

void Marks::add(const std::vector<Vec3d>& points, const QString& text) {
    constexpr double kColour[3]{0.30, 0.78, 0.95};
    vtkNew<vtkPoints> positions;
    vtkNew<vtkCellArray> line, dots;
    line->InsertNextCell(static_cast<int>(points.size()));
    for (const Vec3d& p : points) {
        const vtkIdType id = positions->InsertNextPoint(p.data());
        line->InsertCellPoint(id);
        dots->InsertNextCell(1, &id);
    }
    vtkNew<vtkPolyData> data;
    data->SetPoints(positions);
    data->SetVerts(dots);
    if (points.size() > 1) data->SetLines(line);
    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputData(data);
    vtkNew<vtkActor> actor;
    actor->SetMapper(mapper);
    actor->GetProperty()->SetColor(kColour[0] * (light_ ? 0.4 : 1), kColour[1] * (light_ ? 0.5 : 1),
                                   kColour[2] * (light_ ? 0.8 : 1));
    actor->GetProperty()->LightingOff();
    actor->GetProperty()->RenderPointsAsSpheresOn();
    renderer_->AddActor(actor);
    lines_.emplace_back(actor);
    if (text.isEmpty()) return;

    vtkNew<vtkBillboardTextActor3D> label;
    label->SetInput(text.toUtf8().constData());
    const Vec3d& a = points[points.size() == 2 ? 0 : 1];
    const Vec3d& b = points[1];
    label->SetPosition((a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2);
    vtkTextProperty* style = label->GetTextProperty();
    style->SetFontSize(15);
    style->BoldOn();
    style->SetColor(light_ ? 0.05 : 1, light_ ? 0.10 : 1, light_ ? 0.15 : 1);
    style->SetBackgroundColor(light_ ? 1 : 0.06, light_ ? 1 : 0.07, light_ ? 1 : 0.09);
    style->SetBackgroundOpacity(0.75);
    renderer_->AddActor(label);
    labels_.emplace_back(label);
}

void Marks::set_pixel_ratio(double ratio) {
    for (const auto& line : lines_) set_widths(line, kMarkLine * ratio, kMarkDot * ratio);
    // Their font follows the resolution of the window.
    for (const auto& label : labels_)
        label->SetDisplayOffset(static_cast<int>(std::lround(10 * ratio)),
                                static_cast<int>(std::lround(8 * ratio)));
}

OrientationCube::OrientationCube() {
    // LPS: x grows to the left, y to posterior, z to superior.
    cube_->SetXPlusFaceText("L");
    cube_->SetXMinusFaceText("R");
    cube_->SetYPlusFaceText("P");
    cube_->SetYMinusFaceText("A");
    cube_->SetZPlusFaceText("S");
    cube_->SetZMinusFaceText("I");
    cube_->SetXFaceTextRotation(0);
    cube_->SetYFaceTextRotation(0);
    cube_->SetZFaceTextRotation(-90);
    cube_->SetFaceTextScale(0.62);
    cube_->GetCubeProperty()->SetColor(0.30, 0.34, 0.40);
    cube_->GetCubeProperty()->SetSpecular(0.1);
    cube_->GetTextEdgesProperty()->SetColor(0.12, 0.14, 0.17);
    for (vtkProperty* face :
         {cube_->GetXPlusFaceProperty(), cube_->GetXMinusFaceProperty(), cube_->GetYPlusFaceProperty(),
          cube_->GetYMinusFaceProperty(), cube_->GetZPlusFaceProperty(), cube_->GetZMinusFaceProperty()}) {
        face->SetColor(0.95, 0.96, 0.97);
        face->LightingOff();
    }
}

void OrientationCube::follow(vtkCamera* scene, vtkRenderer* corner, int width, int height,
                             double pixel_ratio) {
    const double side = std::min({96 * pixel_ratio, 0.3 * width, 0.3 * height});
    if (width < 1 || height < 1) return;
    corner->SetViewport(1 - side / width, 0, 1, side / height);
    double direction[3], up[3];
    scene->GetDirectionOfProjection(direction);
    scene->GetViewUp(up);
    vtkCamera* camera = corner->GetActiveCamera();
    constexpr double kDistance = 4.6;
    camera->SetFocalPoint(0, 0, 0);
    camera->SetPosition(-kDistance * direction[0], -kDistance * direction[1], -kDistance * direction[2]);
    camera->SetViewUp(up);
    camera->SetViewAngle(26);
    corner->ResetCameraClippingRange();
}

}  // namespace marrow::viewer
