// Configures the VTK actor of a surface.
#include "surface_actor.h"

#include <vtkProperty.h>
#include <vtkShaderProperty.h>
#include <vtkUniforms.h>

namespace marrow::viewer {
namespace {

// As in glass, parts that face the camera are more transparent than the outline.
constexpr char kGlass[] =
    "//VTK::Light::Impl\n"
    "  float facing = pow(abs(normalVCVSOutput.z), 0.8);\n"
    "  gl_FragData[0].a = mix(min(1.0, 3.0 * facing_opacity), facing_opacity, facing);\n";

// Edges fade where triangles are small on the screen, because they would cover the surface there. VTK gives
// the distances edist from the three edges. Weighted by the lengths of the edges, their sum is twice the
// area; so their weighted mean is the radius of the inscribed circle, in pixels. The lengths are proportional
// to the sines of the angles.
constexpr char kFadingEdges[] =
    "  vec3 diffuse_beside_edges = diffuseColor, ambient_beside_edges = ambientColor;\n"
    "//VTK::Edges::Impl\n"
    "  vec3 sines = abs(vec3(\n"
    "      edgeEqn[1].x * edgeEqn[2].y - edgeEqn[1].y * edgeEqn[2].x,\n"
    "      edgeEqn[2].x * edgeEqn[0].y - edgeEqn[2].y * edgeEqn[0].x,\n"
    "      edgeEqn[0].x * edgeEqn[1].y - edgeEqn[0].y * edgeEqn[1].x));\n"
    "  float radius = dot(sines, vec3(edist[0], edist[1], edist[2])) / dot(sines, vec3(1.0));\n"
    "  float fade = smoothstep(0.5, 4.0, radius);\n"
    "  diffuseColor = mix(diffuse_beside_edges, diffuseColor, fade);\n"
    "  ambientColor = mix(ambient_beside_edges, ambientColor, fade);\n";

}  // namespace

SurfaceActor::SurfaceActor() {
    for (vtkPolyDataMapper* mapper : {full_mapper_.Get(), preview_mapper_.Get()}) {
        mapper->ScalarVisibilityOff();
        mapper->SetScalarModeToUsePointFieldData();
        mapper->UseLookupTableScalarRangeOn();
    }
}

void SurfaceActor::set_shapes(std::shared_ptr<const Shape> newest, std::shared_ptr<const Shape> preview) {
    full_ = newest->level == 0 ? std::move(newest) : nullptr;
    preview_ = std::move(preview);
    full_mapper_->SetInputData(full_ ? full_->polydata.Get() : nullptr);
    preview_mapper_->SetInputData(preview_ ? preview_->polydata.Get() : nullptr);
    follow_colouring();
}

void SurfaceActor::set_colouring(Colouring colouring, vtkScalarsToColors* colours) {
    colouring_ = colouring;
    colours_ = colours;
    follow_colouring();
}

void SurfaceActor::follow_colouring() {
    for (const auto& [mapper, shape] :
         {std::pair{full_mapper_.Get(), full_.get()}, {preview_mapper_.Get(), preview_.get()}}) {
        const bool coloured = colouring_ != Colouring::own && shape && shape->trust;
        mapper->SetScalarVisibility(coloured);
        if (!coloured) continue;
        mapper->SetLookupTable(colours_);
        mapper->SelectColorArray(colouring_ == Colouring::shift ? kShiftArray : kNoiseArray);
    }
}

void SurfaceActor::set_look(const SurfaceParameters& surface, DrawMode mode) {
    vtkProperty* look = actor_->GetProperty();
    const bool solid = mode == DrawMode::surface || mode == DrawMode::edges;
    look->SetColor(surface.colour.redF(), surface.colour.greenF(), surface.colour.blueF());
    look->SetRepresentation(mode == DrawMode::wireframe ? VTK_WIREFRAME
                            : mode == DrawMode::points  ? VTK_POINTS
                                                        : VTK_SURFACE);
    look->SetEdgeVisibility(mode == DrawMode::edges);
    look->SetEdgeColor(0.10, 0.12, 0.15);
    look->SetSpecular(0.15);
    look->SetSpecularPower(25);
    look->SetOpacity(surface.opacity);
    const bool glass = surface.opacity < 1 && solid;
    look->SetBackfaceCulling(glass);
    actor_->SetForceTranslucent(surface.opacity < 1);
    vtkShaderProperty* shader = actor_->GetShaderProperty();
    if (glass)
        shader->GetFragmentCustomUniforms()->SetUniformf("facing_opacity",
                                                         static_cast<float>(surface.opacity));
    const bool edges = mode == DrawMode::edges;
    if (glass != glass_ || edges != edges_) {
        shader->ClearAllFragmentShaderReplacements();
        if (glass) shader->AddFragmentShaderReplacement("//VTK::Light::Impl", true, kGlass, false);
        if (edges) shader->AddFragmentShaderReplacement("//VTK::Edges::Impl", true, kFadingEdges, false);
    }
    glass_ = glass;
    edges_ = edges;
    actor_->SetVisibility(surface.visible && surface.opacity > 0);
}

void SurfaceActor::set_pixel_ratio(double ratio) {
    actor_->GetProperty()->SetLineWidth(static_cast<float>(ratio));
    actor_->GetProperty()->SetPointSize(static_cast<float>(2 * ratio));
}

void SurfaceActor::set_cut(vtkPlane* plane) {
    for (vtkPolyDataMapper* mapper : {full_mapper_.Get(), preview_mapper_.Get()}) {
        mapper->RemoveAllClippingPlanes();
        if (plane) mapper->AddClippingPlane(plane);
    }
}

void SurfaceActor::choose(bool coarse) {
    actor_->SetMapper(preview_ && (!full_ || coarse) ? preview_mapper_ : full_mapper_);
}

}  // namespace marrow::viewer
