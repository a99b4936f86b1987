/// Small pictures of series, made in the background.
#pragma once

#include <cstdint>
#include <filesystem>

#include <QImage>
#include <QObject>

#include <marrow/scan_io.h>

#include "worker.h"

namespace marrow::viewer {

class Previews : public QObject {
    Q_OBJECT
  public:
    /// Makes pictures of the series of an input. The destructor cancels what is unfinished.
    Previews(std::filesystem::path input, const ScanOptions& options, QObject* parent = nullptr);

    /// Starts to make the picture of a series: the middle slice of one of its volumes, as `marrow info
    /// --picture` draws it, on a black square. Replaces an earlier request for the same series. A series
    /// that cannot be read gets none.
    void request(int series, const SeriesReport& report, std::int64_t volume);

  signals:
    void made(int series, const QImage& picture);

  private:
    std::filesystem::path input_;
    ScanOptions options_;
    Worker worker_;
};

}  // namespace marrow::viewer
