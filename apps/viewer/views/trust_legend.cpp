// Makes the colour table and draws its legend.
#include "trust_legend.h"

#include <vtkCellArray.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyDataMapper2D.h>
#include <vtkProperty2D.h>
#include <vtkTextProperty.h>
#include <vtkUnsignedCharArray.h>

namespace marrow::viewer {
namespace {

// In pixels.
struct Rectangle {
    double left, bottom, right, top;
};
constexpr Rectangle kBox{12, 12, 252, 76}, kBar{24, 36, 240, 48};
constexpr double kTitleTop = 70, kNumbersTop = 32;

constexpr int kColumns = 48;  // of the bar

// A row of quads.
void make_columns(vtkPolyData* data, int columns) {
    vtkNew<vtkPoints> points;
    points->SetNumberOfPoints(2 * (columns + 1));
    vtkNew<vtkCellArray> quads;
    for (vtkIdType i = 0; i < columns; ++i) {
        const vtkIdType corners[4]{2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1};
        quads->InsertNextCell(4, corners);
    }
    data->SetPoints(points);
    data->SetPolys(quads);
}

void place_columns(vtkPolyData* data, const Rectangle& place, double pixel_ratio) {
    vtkPoints* points = data->GetPoints();
    const vtkIdType columns = points->GetNumberOfPoints() / 2 - 1;
    for (vtkIdType i = 0; i <= columns; ++i) {
        const double x =
            place.left + (place.right - place.left) * static_cast<double>(i) / static_cast<double>(columns);
        points->SetPoint(2 * i, pixel_ratio * x, pixel_ratio * place.bottom, 0);
        points->SetPoint(2 * i + 1, pixel_ratio * x, pixel_ratio * place.top, 0);
    }
    points->Modified();
    data->Modified();
}

QString number_text(double value) {
    return QString::number(value, 'g', 2);
}

}  // namespace

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
    make_columns(box_, 1);
    make_columns(bar_, kColumns);
    vtkNew<vtkUnsignedCharArray> colours;
    colours->SetNumberOfComponents(3);
    for (int i = 0; i < 2 * (kColumns + 1); ++i)
        colours->InsertNextTypedTuple(trust_colour(i / 2 / static_cast<double>(kColumns)).data());
    bar_->GetPointData()->SetScalars(colours);
    for (const auto& [data, actor] :
         {std::pair{box_.Get(), box_actor_.Get()}, {bar_.Get(), bar_actor_.Get()}}) {
        vtkNew<vtkPolyDataMapper2D> mapper;
        mapper->SetInputData(data);
        actor->SetMapper(mapper);
    }
    box_actor_->GetProperty()->SetOpacity(0.75);
    title_->GetTextProperty()->SetFontSize(14);
    for (const auto& number : numbers_) number->GetTextProperty()->SetFontSize(13);
    numbers_[1]->GetTextProperty()->SetJustificationToCentered();
    numbers_[2]->GetTextProperty()->SetJustificationToRight();
    for (vtkTextActor* text : texts()) text->GetTextProperty()->SetVerticalJustificationToTop();
    hide();
}

std::array<vtkActor2D*, 6> TrustLegend::parts() {
    return {box_actor_, bar_actor_, title_, numbers_[0], numbers_[1], numbers_[2]};
}

std::array<vtkTextActor*, 4> TrustLegend::texts() {
    return {title_, numbers_[0], numbers_[1], numbers_[2]};
}

void TrustLegend::add_to(vtkRenderer* renderer) {
    for (vtkActor2D* part : parts()) renderer->AddActor2D(part);
}

void TrustLegend::show(Colouring colouring, const TrustReport& report, bool hounsfield) {
    const double largest = largest_shown(colouring, report);
    colours_->SetTableRange(0, largest);
    title_->SetInput(legend_title(colouring, report, hounsfield).toUtf8().constData());
    numbers_[0]->SetInput("0");
    numbers_[1]->SetInput(number_text(largest / 2).toUtf8().constData());
    numbers_[2]->SetInput(("≥ " + number_text(largest)).toUtf8().constData());
    set_visible(true);
}

void TrustLegend::hide() {
    set_visible(false);
}

void TrustLegend::set_visible(bool visible) {
    for (vtkActor2D* part : parts()) part->SetVisibility(visible);
}

void TrustLegend::set_light(bool light) {
    // As the labels of measurements.
    light ? box_actor_->GetProperty()->SetColor(1, 1, 1)
          : box_actor_->GetProperty()->SetColor(0.06, 0.07, 0.09);
    for (vtkTextActor* text : texts())
        light ? text->GetTextProperty()->SetColor(0.05, 0.10, 0.15)
              : text->GetTextProperty()->SetColor(1, 1, 1);
}

void TrustLegend::set_pixel_ratio(double ratio) {
    place_columns(box_, kBox, ratio);
    place_columns(bar_, kBar, ratio);
    title_->SetPosition(ratio * kBar.left, ratio * kTitleTop);
    const std::array<double, 3> x{kBar.left, (kBar.left + kBar.right) / 2, kBar.right};
    for (std::size_t i = 0; i < 3; ++i) numbers_[i]->SetPosition(ratio * x[i], ratio * kNumbersTop);
}

}  // namespace marrow::viewer
