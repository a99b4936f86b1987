// Lays out the list of series and keeps the list of volumes up to date.
#include "series_dialog.h"

#include <algorithm>
#include <array>
#include <tuple>

#include <QHBoxLayout>
#include <QHeaderView>
#include <QSignalBlocker>
#include <QTextDocument>
#include <QVBoxLayout>

#include "dialogs.h"
#include "shared/library_options.h"

namespace marrow::viewer {
namespace {

constexpr int kPicture = 72, kRowHeight = kPicture + 6;  // pixels
enum Column {
    picture_column,
    number_column,
    description_column,
    date_column,
    modality_column,
    samples_column,
    files_column,
    remarks_column,
    column_count
};

QString from(const std::string& text) {
    return QString::fromStdString(text);
}

// Such as "512 × 512 × 234" and "1 × 1 × 1 mm", with "?" for what is unknown.
QString samples_text(const SeriesInfo& info) {
    const auto spacing = [&](std::size_t axis) {
        return info.spacing[axis] > 0 ? QString::number(info.spacing[axis], 'g', 3) : QString("?");
    };
    return QString("%1 × %2 × %3\n%4 × %5 × %6 mm")
        .arg(info.dims[0])
        .arg(info.dims[1])
        .arg(info.dims[2])
        .arg(spacing(0), spacing(1), spacing(2));
}

// What tells apart series with the same description, such as a kernel.
QString description_text(const SeriesReport& series) {
    QStringList details;
    if (!series.kernel.empty()) details << QObject::tr("kernel %1").arg(from(series.kernel));
    if (series.volume_count > 1)
        details << QObject::tr("%1 volumes").arg(series.volume_count);
    else if (series.echo_time)
        details << QObject::tr("echo time %1 ms").arg(*series.echo_time);
    if (details.empty() && series.series.description.empty()) details << from(series.image_type);
    QStringList lines{from(series.series.description), details.join(", ")};
    lines.removeAll({});
    return lines.join('\n');
}

// A remark without the path or series that it begins with, which would take the room of the reason.
QString without_place(const QString& remark, const std::string& series) {
    const QString named = "series " + from(series) + ": ";
    if (remark.startsWith(named)) return remark.mid(named.size());
    const int end = remark.indexOf("': ");
    return remark.startsWith('\'') && end > 0 ? remark.mid(end + 3) : remark;
}

// A tool tip that shows "<" instead of taking it for HTML.
QString tool_tip(const QString& text) {
    return text.isEmpty() ? text : Qt::convertFromPlainText(text, Qt::WhiteSpaceNormal);
}

// The largest series that can be read: images before segmentations, volumes before single images. -1: none.
int proposal(const OpenQuestion& question) {
    int best = -1;
    std::tuple<bool, bool, double> most{false, false, -1};
    for (std::size_t i = 0; i < question.report.series.size(); ++i) {
        const SeriesInfo& info = question.report.series[i].series;
        const auto [nx, ny, nz] = info.dims;
        const std::tuple size{info.modality != "SEG", nz > 1,
                              static_cast<double>(nx) * static_cast<double>(ny) * static_cast<double>(nz)};
        if (question.readable[i] && size > most) most = size, best = static_cast<int>(i);
    }
    return best;
}

}  // namespace

SeriesDialog::SeriesDialog(const OpenQuestion& question, QWidget* parent)
    : QDialog(parent), question_(question), previews_(question.input, question.options) {
    setObjectName("series_dialog");
    const bool several = question_.report.series.size() > 1;
    setWindowTitle(several ? tr("Choose a series") : tr("Choose a volume"));
    auto* layout = new QVBoxLayout(this);
    layout->setContentsMargins(18, 16, 18, 16);
    layout->setSpacing(10);
    auto* top = new QLabel(several ? tr("There are several series. Choose one to open.")
                                   : tr("This series has several volumes. Choose one to open."));
    top->setWordWrap(true);
    layout->addWidget(top);
    make_table();
    layout->addWidget(table_, 1);

    auto* row = new QHBoxLayout;
    volume_label_ = new QLabel(tr("Volume"));
    volume_ = new QComboBox;
    volume_->setObjectName("volume");
    volume_->setToolTip(tr("The volume of the selected series to open: a time point, an echo, ..."));
    volume_->setMaxVisibleItems(20);
    row->addWidget(volume_label_);
    row->addWidget(volume_, 1);
    row->addStretch(1);
    layout->addLayout(row);
    layout->addWidget(dialog_buttons(this, tr("Open"), open_));

    connect(&previews_, &Previews::made, this, [this](int series, const QImage& picture) {
        QIcon icon;  // the same picture in a selected row, without the tint that Qt would add
        for (const auto mode : {QIcon::Normal, QIcon::Selected, QIcon::Disabled})
            icon.addPixmap(QPixmap::fromImage(picture), mode);
        table_->item(series, picture_column)->setIcon(icon);
    });
    connect(table_, &QTableWidget::itemSelectionChanged, this, &SeriesDialog::follow_selection);
    connect(table_, &QTableWidget::itemDoubleClicked, this, [this] {
        if (selected() >= 0) accept();
    });
    connect(volume_, qOverload<int>(&QComboBox::currentIndexChanged), this, [this](int volume) {
        const int series = selected();
        if (series < 0 || volume < 0) return;
        volumes_[static_cast<std::size_t>(series)] = volume;
        previews_.request(series, question_.report.series[static_cast<std::size_t>(series)], volume);
    });

    for (const SeriesReport& series : question_.report.series)
        volumes_.push_back(
            std::clamp<std::int64_t>(question_.options.volume.value_or(0), 0, series.volume_count - 1));
    bool remarks = false;
    for (int i = 0; i < table_->rowCount(); ++i) {
        fill_row(i);
        remarks = remarks || !table_->item(i, remarks_column)->text().isEmpty();
        const auto n = static_cast<std::size_t>(i);
        previews_.request(i, question_.report.series[n], volumes_[n]);
    }
    table_->setColumnHidden(remarks_column, !remarks);
    if (const int row = proposal(question_); row >= 0) table_->selectRow(row);
    follow_selection();
    table_->setFocus();
    const bool any_volumes = std::any_of(question_.report.series.begin(), question_.report.series.end(),
                                         [](const SeriesReport& series) { return series.volume_count > 1; });
    const int height = (any_volumes ? 180 : 144) + kRowHeight * std::min(table_->rowCount(), 5);
    resize(QSize(940, height).boundedTo(parent->size() * 0.96));
}

void SeriesDialog::make_table() {
    table_ = new QTableWidget(static_cast<int>(question_.report.series.size()), column_count);
    table_->setObjectName("series");
    table_->setHorizontalHeaderLabels({{},
                                       tr("No."),
                                       tr("Description"),
                                       tr("Date"),
                                       tr("Modality"),
                                       tr("Samples"),
                                       tr("Files"),
                                       tr("Remarks")});
    table_->verticalHeader()->hide();
    table_->verticalHeader()->setDefaultSectionSize(kRowHeight);
    table_->setIconSize({kPicture, kPicture});
    table_->setSelectionBehavior(QAbstractItemView::SelectRows);
    table_->setSelectionMode(QAbstractItemView::SingleSelection);
    table_->setEditTriggers(QAbstractItemView::NoEditTriggers);
    table_->setVerticalScrollMode(QAbstractItemView::ScrollPerPixel);
    table_->setTabKeyNavigation(false);  // Tab leads to the volumes and buttons
    table_->setShowGrid(false);
    QHeaderView* header = table_->horizontalHeader();
    header->setHighlightSections(false);
    header->setDefaultAlignment(Qt::AlignLeft | Qt::AlignVCenter);
    header->setSectionResizeMode(QHeaderView::ResizeToContents);
    header->setSectionResizeMode(picture_column, QHeaderView::Fixed);
    header->resizeSection(picture_column, kPicture + 14);
    for (const int column : {description_column, remarks_column})
        header->setSectionResizeMode(column, QHeaderView::Stretch);
}

void SeriesDialog::fill_row(int row) {
    const SeriesReport& series = question_.report.series[static_cast<std::size_t>(row)];
    const SeriesInfo& info = series.series;
    const std::string remark = series.refusal             ? *series.refusal
                               : !series.warnings.empty() ? series.warnings.front()
                                                          : std::string();
    std::array<QString, column_count> texts;
    texts[number_column] = series.number ? QString::number(*series.number) : QString();
    texts[description_column] = description_text(series);
    texts[date_column] = from(series.date);
    texts[modality_column] = from(info.modality);
    texts[samples_column] = samples_text(info);
    texts[files_column] = QString::number(info.files);
    const QString whole_remark = from(apps::name_flags(remark));
    texts[remarks_column] = without_place(whole_remark, info.id);
    for (int column = 0; column < column_count; ++column) {
        auto* item = new QTableWidgetItem(texts[static_cast<std::size_t>(column)]);
        if (!question_.readable[static_cast<std::size_t>(row)]) item->setFlags(Qt::NoItemFlags);
        item->setToolTip(tool_tip(column == remarks_column ? whole_remark : from(info.id)));
        table_->setItem(row, column, item);
    }
}

int SeriesDialog::selected() const {
    const QList<QTableWidgetItem*> items = table_->selectedItems();
    return items.empty() ? -1 : items.front()->row();
}

void SeriesDialog::follow_selection() {
    const int row = selected();
    open_->setEnabled(row >= 0);
    const QSignalBlocker quiet(volume_);
    volume_->clear();
    const bool choose = row >= 0 && question_.report.series[static_cast<std::size_t>(row)].volume_count > 1;
    for (QWidget* widget : {static_cast<QWidget*>(volume_label_), static_cast<QWidget*>(volume_)})
        widget->setVisible(choose);
    if (!choose) return;
    const SeriesReport& series = question_.report.series[static_cast<std::size_t>(row)];
    constexpr std::int64_t kMostListed = 10000;  // a damaged header may claim any number
    for (std::int64_t i = 0; i < std::min(series.volume_count, kMostListed); ++i) {
        const auto n = static_cast<std::size_t>(i);
        volume_->addItem(n < series.volumes.size()
                             ? QString("%1:  %2").arg(i).arg(from(series.volumes[n]))
                             : tr("%1  of 0 to %2").arg(i).arg(series.volume_count - 1));
    }
    volume_->setCurrentIndex(static_cast<int>(volumes_[static_cast<std::size_t>(row)]));
}

ScanOptions SeriesDialog::chosen() const {
    ScanOptions options = question_.options;
    const int row = selected();
    if (row < 0) return options;
    const SeriesReport& series = question_.report.series[static_cast<std::size_t>(row)];
    if (question_.report.series.size() > 1) options.series = series.series.id;
    if (series.volume_count > 1) options.volume = volumes_[static_cast<std::size_t>(row)];
    return options;
}

}  // namespace marrow::viewer
