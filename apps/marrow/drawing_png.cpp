// Draws on an image of VTK and writes it as PNG. VTK renders text by FreeType, with fonts of its own.
#include <algorithm>
#include <cmath>

#include <vtkFreeTypeTools.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkStdString.h>
#include <vtkTextProperty.h>

#include <marrow/error.h>

#include "drawing.h"
#include "png.h"

namespace marrow::apps {
namespace {

constexpr int kScale = 2;  // pixels of the picture for one of the drawing

class Painter {
  public:
    explicit Painter(const Drawing& drawing)
        : width_(drawing.width * kScale), height_(drawing.height * kScale) {
        image_->SetDimensions(width_, height_, 1);
        image_->AllocateScalars(VTK_UNSIGNED_CHAR, 3);
        auto* const bytes = static_cast<unsigned char*>(image_->GetScalarPointer());
        std::fill_n(bytes, std::size_t{3} * static_cast<std::size_t>(width_ * height_), 255);
        for (const auto& shape : drawing.shapes) std::visit([&](const auto& s) { draw(s); }, shape);
    }

    vtkImageData* image() { return image_; }

  private:
    // Mixes a colour into the pixel in column x of row y, counted from the top as in the drawing.
    void blend(int x, int y, Rgb colour, double opacity) {
        if (x < 0 || x >= width_ || y < 0 || y >= height_ || opacity <= 0) return;
        auto* const pixel = static_cast<unsigned char*>(image_->GetScalarPointer(x, height_ - 1 - y, 0));
        for (int c = 0; c < 3; ++c) {
            const auto wanted = static_cast<double>(colour >> (16 - 8 * c) & 255);
            pixel[c] = static_cast<unsigned char>(std::lround(std::lerp(pixel[c], wanted, opacity)));
        }
    }

    // Calls opacity(x, y) at the centres of the pixels of a box, and mixes in the colour with the result.
    template <class Opacity>
    void fill(double left, double top, double right, double bottom, Rgb colour, const Opacity& opacity) {
        for (int y = static_cast<int>(std::floor(top)); y < bottom; ++y) {
            for (int x = static_cast<int>(std::floor(left)); x < right; ++x)
                blend(x, y, colour, std::clamp(opacity(x + 0.5, y + 0.5), 0.0, 1.0));
        }
    }

    void draw(const Area& area) {
        const double left = area.x * kScale, top = area.y * kScale, right = left + area.width * kScale,
                     bottom = top + area.height * kScale;
        // The part of a pixel that the area covers, along one axis.
        const auto covered = [](double at, double from, double to) {
            return std::clamp(std::min(at + 0.5, to) - std::max(at - 0.5, from), 0.0, 1.0);
        };
        fill(left, top, right, bottom, area.colour,
             [&](double x, double y) { return covered(x, left, right) * covered(y, top, bottom); });
    }

    void draw(const Line& line) {
        const double reach = line.width * kScale / 2 + 0.5;  // the pixels at the rim are partly covered
        for (std::size_t i = 1; i < line.points.size(); ++i) {
            const double x0 = line.points[i - 1][0] * kScale, y0 = line.points[i - 1][1] * kScale;
            const double dx = line.points[i][0] * kScale - x0, dy = line.points[i][1] * kScale - y0;
            const double square = dx * dx + dy * dy;
            fill(std::min(x0, x0 + dx) - reach, std::min(y0, y0 + dy) - reach, std::max(x0, x0 + dx) + reach,
                 std::max(y0, y0 + dy) + reach, line.colour, [&](double x, double y) {
                     const double along = square > 0 ? ((x - x0) * dx + (y - y0) * dy) / square : 0;
                     const double t = std::clamp(along, 0.0, 1.0);
                     return reach - std::hypot(x - x0 - t * dx, y - y0 - t * dy);
                 });
        }
    }

    void draw(const Words& words) {
        vtkNew<vtkTextProperty> look;
        look->SetFontFamilyToArial();
        look->SetFontSize(Drawing::kFontSize * kScale);
        look->SetVerticalJustificationToBottom();
        vtkFreeTypeTools* const tools = vtkFreeTypeTools::GetInstance();
        tools->ScaleToPowerTwoOff();
        constexpr int kPointsPerInch = 72;  // so that a point is a pixel
        vtkNew<vtkImageData> text;          // red, green, blue and opacity
        if (!tools->RenderString(look, words.text, kPointsPerInch, text))
            throw IoError("cannot draw text: FreeType does not render");
        int extent[6];
        text->GetExtent(extent);
        const int width = extent[1] - extent[0] + 1;
        const int left = static_cast<int>(std::lround(words.x * kScale)) -
                         (words.anchor == Words::Anchor::middle ? width / 2
                          : words.anchor == Words::Anchor::end  ? width
                                                                : 0);
        const int base = static_cast<int>(std::lround(words.y * kScale));
        for (int y = extent[2]; y <= extent[3]; ++y) {
            for (int x = extent[0]; x <= extent[1]; ++x) {
                const int opacity = static_cast<const unsigned char*>(text->GetScalarPointer(x, y, 0))[3];
                blend(left + x - extent[0], base - y, words.colour, opacity / 255.0);
            }
        }
    }

    const int width_, height_;
    vtkNew<vtkImageData> image_;
};

}  // namespace

std::string png_of(const Drawing& drawing) {
    Painter painter(drawing);
    return png_of(painter.image());
}

}  // namespace marrow::apps
