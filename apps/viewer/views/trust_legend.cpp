// Makes the colour table and its legend.
#include "trust_legend.h"

#include <algorithm>

#include <vtkTextProperty.h>

namespace marrow::viewer {

double largest_shown(Colouring colouring, const TrustReport& report) {
    constexpr double kFiner = 5;
    return colouring == Colouring::noise ? report.cap / kFiner : report.cap;
}

QString legend_title(Colouring colouring, const TrustReport& report, bool hounsfield) {
    const QString unit = hounsfield ? " HU" : "";
    if (colouring == Colouring::shift)
        return QString("mm per %1%2 of isovalue").arg(report.step, 0, 'g', 3).arg(unit);
    if (report.noise.windows == 0) return "mm by noise, which is unknown";
    return QString("mm by noise of %1%2").arg(report.noise.sigma, 0, 'g', 3).arg(unit);
}

TrustLegend::TrustLegend() {
    constexpr int kColours = 256;
    colours_->SetNumberOfTableValues(kColours);
    for (int i = 0; i < kColours; ++i) {
        const auto [red, green, blue] = trust_colour(i / (kColours - 1.0));
        colours_->SetTableValue(i, red / 255.0, green / 255.0, blue / 255.0);
    }
    bar_->SetLookupTable(colours_);
    bar_->SetMaximumNumberOfColors(kColours);
    bar_->SetOrientationToHorizontal();
    bar_->SetTextPositionToPrecedeScalarBar();
    bar_->SetUnconstrainedFontSize(true);
    bar_->SetLabelFormat("%.2g");
    bar_->SetNumberOfLabels(5);
    bar_->VisibilityOff();
    for (vtkTextProperty* text : {bar_->GetTitleTextProperty(), bar_->GetLabelTextProperty()}) {
        text->ItalicOff();
        text->BoldOff();
        text->ShadowOff();
        text->SetFontSize(13);
    }
}

void TrustLegend::show(Colouring colouring, const TrustReport& report, bool hounsfield) {
    colours_->SetTableRange(0, largest_shown(colouring, report));
    bar_->SetTitle(legend_title(colouring, report, hounsfield).toUtf8().constData());
    bar_->VisibilityOn();
}

void TrustLegend::set_light(bool light) {
    for (vtkTextProperty* text : {bar_->GetTitleTextProperty(), bar_->GetLabelTextProperty()})
        light ? text->SetColor(0.05, 0.10, 0.15) : text->SetColor(1, 1, 1);
}

void TrustLegend::follow(int width, int height, double pixel_ratio) {
    constexpr double kMargin = 12, kWidth = 240, kHeight = 56;
    if (width < 1 || height < 1) return;
    bar_->SetPosition(kMargin * pixel_ratio / width, kMargin * pixel_ratio / height);
    bar_->SetWidth(std::min(kWidth * pixel_ratio / width, 0.6));
    bar_->SetHeight(std::min(kHeight * pixel_ratio / height, 0.4));
}

}  // namespace marrow::viewer
