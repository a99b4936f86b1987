// Configures the VTK actor of a surface.
#include "surface_actor.h"

#include <vtkProperty.h>
#include <vtkShaderProperty.h>
#include <vtkUniforms.h>

namespace marrow::viewer {

SurfaceActor::SurfaceActor() {
    for (vtkPolyDataMapper* mapper : {full_mapper_.Get(), preview_mapper_.Get()})
        mapper->ScalarVisibilityOff();
}

void SurfaceActor::set_shapes(std::shared_ptr<const Shape> newest, std::shared_ptr<const Shape> preview) {
    full_ = newest->level == 0 ? std::move(newest) : nullptr;
    preview_ = std::move(preview);
    full_mapper_->SetInputData(full_ ? full_->polydata.Get() : nullptr);
    preview_mapper_->SetInputData(preview_ ? preview_->polydata.Get() : nullptr);
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
    look->SetPointSize(2);
    look->SetSpecular(0.15);
    look->SetSpecularPower(25);
    look->SetOpacity(surface.opacity);
    // As in glass, parts that face the camera are more transparent than the outline.
    const bool glass = surface.opacity < 1 && solid;
    look->SetBackfaceCulling(glass);
    actor_->SetForceTranslucent(surface.opacity < 1);
    vtkShaderProperty* shader = actor_->GetShaderProperty();
    if (glass) {
        shader->GetFragmentCustomUniforms()->SetUniformf("facing_opacity",
                                                         static_cast<float>(surface.opacity));
        if (!glass_)
            shader->AddFragmentShaderReplacement(
                "//VTK::Light::Impl", true,
                "//VTK::Light::Impl\n"
                "  float facing = pow(abs(normalVCVSOutput.z), 0.8);\n"
                "  gl_FragData[0].a = mix(min(1.0, 3.0 * facing_opacity), facing_opacity, facing);\n",
                false);
    } else if (glass_) {
        shader->ClearAllFragmentShaderReplacements();
    }
    glass_ = glass;
    actor_->SetVisibility(surface.visible && surface.opacity > 0);
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
