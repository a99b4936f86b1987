#include "mesh_writer.h"

#include <chrono>

namespace marrow::viewer {

void Writer::write(std::vector<File> files, Space space) {
    busy_ = true;
    cancelled_ = false;
    emit started();
    const auto end = [this](const QString& sentence, bool error) {
        QMetaObject::invokeMethod(
            this,
            [=, this] {
                busy_ = false;
                emit finished(sentence, error);
            },
            Qt::QueuedConnection);
    };
    worker_.post({0, 0}, [=, this, files = std::move(files)](const Progress& unless_interrupted) {
        auto told = std::chrono::steady_clock::now();
        std::size_t done = 0;
        const Progress progress = [&](double fraction) {
            const auto now = std::chrono::steady_clock::now();
            if (now - told > std::chrono::milliseconds(30)) {
                told = now;
                const double all = (static_cast<double>(done) + fraction) / static_cast<double>(files.size());
                QMetaObject::invokeMethod(
                    this, [this, all] { emit progressed(all); }, Qt::QueuedConnection);
            }
            return !cancelled_ && unless_interrupted(fraction);
        };
        try {
            MeshFiles set;
            for (; done < files.size(); ++done)
                set.write({&files[done].object, 1}, files[done].path, {space, progress});
            set.commit();
            QString sentence = tr("Wrote %1").arg(QString::fromStdString(files.front().path.string()));
            if (files.size() > 1) sentence += tr(" and %1 more").arg(files.size() - 1);
            end(sentence + ".", false);
        } catch (const Cancelled&) {
            end(tr("Cancelled; no file was changed half-way."), false);
        } catch (const std::exception& error) {
            end(QString::fromUtf8(error.what()), true);
        }
    });
}

}  // namespace marrow::viewer
