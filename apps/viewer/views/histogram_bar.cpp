// Paints the histogram and turns mouse and keys into isovalues.
#include "histogram_bar.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>

#include <QKeyEvent>
#include <QMouseEvent>
#include <QPainterPath>
#include <QWheelEvent>

namespace marrow::viewer {
namespace {

constexpr double kMargin = 12, kTop = 16, kAxis = 18;

}  // namespace

HistogramBar::HistogramBar(Session& session, QWidget* parent) : QWidget(parent), session_(session) {
    setFocusPolicy(Qt::StrongFocus);
    setMinimumHeight(56);
    setMouseTracking(true);
    setCursor(Qt::SizeHorCursor);
    setToolTip(
        tr("Frequency of the values, on a logarithmic scale.\n"
           "Drag the line or use the arrow and page keys to change the isovalue. Scroll to zoom."));
    connect(&session_, &Session::scan_changed, this, &HistogramBar::follow_scan);
    connect(&session_, &Session::parameters_changed, this, &HistogramBar::follow_isovalue);
}

// Shows the bins of the scan's histogram until finer ones are counted.
void HistogramBar::follow_scan() {
    const std::shared_ptr<const Scan> scan = session_.shared_scan();
    const ValueRange range = usual_range(scan->histogram);
    lower_ = range.lower;
    upper_ = range.upper;
    distribution_ = Distribution(scan->histogram);
    isovalue_.reset();
    follow_isovalue();
    update_bins();
    counting_.post({0, 0}, [this, scan](const Progress&) {
        try {
            const Distribution fine(scan->volume, scan->histogram, scan->info.padding);
            QMetaObject::invokeMethod(
                this,
                [this, scan, fine] {
                    if (session_.scan() != scan.get()) return;
                    distribution_ = fine;
                    update_bins();
                },
                Qt::QueuedConnection);
        } catch (const std::bad_alloc&) {
            // The bins of the scan's histogram stay.
        }
    });
}

// Shows the line of a new isovalue, which may be outside the range on display.
void HistogramBar::follow_isovalue() {
    const SurfaceParameters* current = session_.current();
    const bool is_new = current && isovalue_ != current->isovalue;
    if (is_new) isovalue_ = current->isovalue;
    if (is_new && !dragging_ && !(lower_ <= *isovalue_ && *isovalue_ <= upper_)) {
        lower_ = std::min(lower_, *isovalue_);
        upper_ = std::max(upper_, *isovalue_);
        update_bins();
    }
    update();
}

void HistogramBar::update_bins() {
    if (!session_.scan()) return;
    constexpr double kBinWidth = 3;  // pixels, at least
    bins_ = distribution_.bins(lower_, upper_, std::max(plot().width() / kBinWidth, 8.0));
    highest_ = std::log1p(std::max(1.0, *std::max_element(bins_.counts.begin(), bins_.counts.end())));
    update();
}

QRectF HistogramBar::plot() const {
    return QRectF(rect()).adjusted(kMargin, kTop, -kMargin, -kAxis);
}

double HistogramBar::x_of(double value) const {
    return plot().left() + (value - lower_) / (upper_ - lower_) * plot().width();
}

double HistogramBar::value_at(double x) const {
    return lower_ + (x - plot().left()) / plot().width() * (upper_ - lower_);
}

double HistogramBar::step() const {
    const Scan* scan = session_.scan();
    if (!scan) return 1;
    const double range = scan->histogram.upper - scan->histogram.lower;
    if (range <= 0) return 1;
    return has_integers(scan->volume) ? 1 : round_step(range / 2000);
}

// The colour of text, almost transparent.
QColor HistogramBar::faint(int alpha) const {
    QColor colour = palette().color(QPalette::Text);
    colour.setAlpha(alpha);
    return colour;
}

double HistogramBar::top_of(double count) const {
    return plot().bottom() - std::log1p(count) / highest_ * plot().height();
}

void HistogramBar::paintEvent(QPaintEvent*) {
    if (!session_.scan()) return;
    QPainter painter(this);
    painter.setRenderHint(QPainter::Antialiasing);
    paint_bins(painter);
    paint_axis(painter);
    paint_isovalues(painter);
}

// Draws the bins as steps. The values inside the current surface have its colour.
void HistogramBar::paint_bins(QPainter& painter) const {
    const QRectF area = plot();
    QPainterPath bins;
    double left = x_of(bins_.first);
    bins.moveTo(left, area.bottom());
    for (std::size_t i = 0; i < bins_.counts.size(); ++i) {
        const double right = x_of(bins_.first + bins_.width * static_cast<double>(i + 1));
        const double top = top_of(bins_.counts[i]);
        bins.lineTo(left, top);
        bins.lineTo(right, top);
        left = right;
    }
    bins.lineTo(left, area.bottom());
    bins.closeSubpath();

    painter.save();
    painter.setClipRect(area);
    painter.fillPath(bins, faint(46));
    if (const SurfaceParameters* current = session_.current()) {
        const QPointF top_left(x_of(current->isovalue), area.top());
        painter.setClipRect(area.intersected(QRectF(top_left, area.bottomRight())));
        QLinearGradient gradient(area.topLeft(), area.bottomLeft());
        const bool light = palette().color(QPalette::Window).lightness() > 128;
        QColor strong = light ? current->colour.darker(140) : current->colour, weak = strong;
        strong.setAlpha(215);
        weak.setAlpha(120);
        gradient.setColorAt(0, strong);
        gradient.setColorAt(1, weak);
        painter.fillPath(bins, gradient);
    }
    painter.restore();
}

void HistogramBar::paint_axis(QPainter& painter) const {
    const QRectF area = plot();
    QFont small = font();
    small.setPixelSize(10);
    painter.setFont(small);
    painter.setPen(faint(40));
    painter.drawLine(area.bottomLeft(), area.bottomRight());
    const double tick = round_step((upper_ - lower_) / std::max(2.0, area.width() / 90));
    const double first = std::ceil(lower_ / tick);
    // Counts them, because first + i may be rounded to first.
    for (int i = 0; i <= (upper_ - lower_) / tick; ++i) {
        const double value = (first + i) * tick;
        if (!(value <= upper_)) break;
        const double x = x_of(value);
        painter.setPen(faint(60));
        painter.drawLine(QPointF(x, area.bottom()), QPointF(x, area.bottom() + 3));
        painter.setPen(faint(180));
        painter.drawText(QRectF(x - 45, area.bottom() + 3, 90, 14), Qt::AlignCenter,
                         QString::number(std::abs(value) < tick / 2 ? 0 : value, 'g', 6));
    }
}

// Draws the current surface last, above the others.
void HistogramBar::paint_isovalues(QPainter& painter) const {
    const QRectF area = plot();
    const SurfaceParameters* current = session_.current();
    for (const SurfaceParameters& surface : session_.parameters().surfaces) {
        if (!surface.visible || (current && surface.id == current->id)) continue;
        const double x = x_of(surface.isovalue);
        if (x < area.left() || x > area.right()) continue;
        painter.setPen(QPen(surface.colour, 1, Qt::DashLine));
        painter.drawLine(QPointF(x, area.top()), QPointF(x, area.bottom()));
    }
    if (current) paint_flag(painter, *current);
}

void HistogramBar::paint_flag(QPainter& painter, const SurfaceParameters& current) const {
    const QRectF area = plot();
    const double x = x_of(current.isovalue);
    if (x < area.left() - 1 || x > area.right() + 1) return;
    const QColor accent = dragging_ || hasFocus() ? QColor(255, 196, 87) : QColor(240, 168, 48);
    painter.setPen(QPen(accent, 2));
    painter.drawLine(QPointF(x, kTop - 2), QPointF(x, area.bottom()));
    const QString text = QString::number(current.isovalue, 'g', 6);
    QFont bold = font();
    bold.setPixelSize(11);
    bold.setBold(true);
    painter.setFont(bold);
    const double flag_width = QFontMetricsF(bold).horizontalAdvance(text) + 12;
    QRectF flag(x - flag_width / 2, 1, flag_width, kTop);
    flag.moveLeft(std::clamp(flag.left(), 0.0, std::max(0.0, width() - flag_width)));
    painter.setPen(Qt::NoPen);
    painter.setBrush(accent);
    painter.drawRoundedRect(flag, 4, 4);
    painter.setPen(QColor(25, 20, 8));
    painter.drawText(flag, Qt::AlignCenter, text);
}

double HistogramBar::on_grid(double value, double steps) const {
    const Histogram& h = session_.scan()->histogram;
    const bool integers = has_integers(session_.scan()->volume);
    const double s = step(), offset = integers && h.upper > h.lower ? 0.5 : 0;
    return std::clamp((std::round(value / s - offset) + steps + offset) * s, h.lower + offset,
                      h.upper - offset);
}

void HistogramBar::mousePressEvent(QMouseEvent* event) {
    if (event->button() != Qt::LeftButton || !session_.scan()) return;
    dragging_ = true;
    session_.end_step();
    session_.set_isovalue(on_grid(value_at(event->localPos().x())));
}

void HistogramBar::mouseMoveEvent(QMouseEvent* event) {
    if (dragging_) session_.set_isovalue(on_grid(value_at(event->localPos().x())));
}

void HistogramBar::mouseReleaseEvent(QMouseEvent* event) {
    if (event->button() != Qt::LeftButton || !dragging_) return;
    dragging_ = false;
    session_.end_step();
    update();
    emit released();
}

void HistogramBar::wheelEvent(QWheelEvent* event) {
    const Scan* scan = session_.scan();
    if (!scan || scan->histogram.upper <= scan->histogram.lower) return;
    const double centre = value_at(event->position().x());
    const double factor = std::pow(0.85, event->angleDelta().y() / 120.0);
    const double all = scan->histogram.upper - scan->histogram.lower;
    // In a shorter range, there are fewer numbers than pixels.
    const double finest = 1e3 * std::numeric_limits<double>::epsilon() *
                          std::max(std::abs(scan->histogram.lower), std::abs(scan->histogram.upper));
    const double range =
        std::clamp((upper_ - lower_) * factor, std::min(std::max(all / 1000, finest), all), all);
    const double fraction = (centre - lower_) / (upper_ - lower_);
    lower_ = std::clamp(centre - fraction * range, scan->histogram.lower, scan->histogram.upper - range);
    upper_ = lower_ + range;
    update_bins();
    event->accept();
}

void HistogramBar::keyPressEvent(QKeyEvent* event) {
    const SurfaceParameters* current = session_.current();
    double steps = 0;
    switch (event->key()) {
        case Qt::Key_Left:
        case Qt::Key_Down:
            steps = -1;
            break;
        case Qt::Key_Right:
        case Qt::Key_Up:
            steps = 1;
            break;
        case Qt::Key_PageDown:
            steps = -10;
            break;
        case Qt::Key_PageUp:
            steps = 10;
            break;
        default:
            break;
    }
    if (steps == 0 || !current) return QWidget::keyPressEvent(event);
    if (!event->isAutoRepeat()) session_.end_step();
    session_.set_isovalue(on_grid(current->isovalue, steps));
}

}  // namespace marrow::viewer
