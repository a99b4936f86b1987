// Writes mesh files on a worker thread and reports to the thread of the window.
#include "mesh_writer.h"

#include <chrono>

namespace marrow::viewer {

void MeshWriter::write(std::vector<File> files, Space space) {
    busy_ = true;
    cancelled_ = false;
    emit started();
    const auto end = [this](const QString& message, bool error) {
        QMetaObject::invokeMethod(
            this,
            [=, this] {
                busy_ = false;
                emit finished(message, error);
            },
            Qt::QueuedConnection);
    };
    worker_.post({0, 0}, [=, this, files = std::move(files)](const Progress& job_progress) {
        auto last_report = std::chrono::steady_clock::now();
        std::size_t done = 0;
        const Progress progress = [&](double fraction) {
            const auto now = std::chrono::steady_clock::now();
            if (now - last_report > std::chrono::milliseconds(30)) {
                last_report = now;
                const double all = (static_cast<double>(done) + fraction) / static_cast<double>(files.size());
                QMetaObject::invokeMethod(
                    this, [this, all] { emit progressed(all); }, Qt::QueuedConnection);
            }
            return !cancelled_ && job_progress(fraction);
        };
        try {
            MeshFiles set;
            for (; done < files.size(); ++done)
                set.write({&files[done].object, 1}, files[done].path, {space, progress});
            set.commit();
            const QString first = QString::fromStdString(files.front().path.string());
            end(files.size() > 1 ? tr("Wrote %1 and %2 more.").arg(first).arg(files.size() - 1)
                                 : tr("Wrote %1.").arg(first),
                false);
        } catch (const Cancelled&) {
            end(tr("Export cancelled. No file was changed."), false);
        } catch (const std::exception& error) {
            end(QString::fromUtf8(error.what()), true);
        }
    });
}

}  // namespace marrow::viewer
