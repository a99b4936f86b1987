// Tests that the viewer goes on where there is not enough memory for its work in the background.
#include <atomic>
#include <cstdlib>
#include <new>
#include <thread>

#include <QClipboard>
#include <QLabel>
#include <QPushButton>
#include <QSpinBox>

#include "support/viewer_ball.h"

namespace {

std::atomic<bool> scarce{false};
const std::thread::id window_thread = std::this_thread::get_id();

}  // namespace

// While memory is scarce, only the thread of the window gets as much as the mesh of a ball needs.
void* operator new(std::size_t bytes) {
    constexpr std::size_t kMuch = 10000;
    const bool refused = bytes > kMuch && scarce && std::this_thread::get_id() != window_thread;
    void* const memory = refused ? nullptr : std::malloc(bytes > 0 ? bytes : 1);
    if (memory == nullptr) throw std::bad_alloc();
    return memory;
}

// By default it would call the one above, but AddressSanitizer has its own.
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept {
    try {
        return operator new(bytes);
    } catch (const std::bad_alloc&) {
        return nullptr;
    }
}

void operator delete(void* memory) noexcept {
    std::free(memory);
}

void operator delete(void* memory, std::size_t) noexcept {
    std::free(memory);
}

namespace marrow::test {
namespace {

class ScarceMemory : public BallViewer {
  protected:
    void SetUp() override {
        BallViewer::SetUp();
        if (IsSkipped()) return;
        QObject::connect(&window->surfaces(), &viewer::Surfaces::failed, window.get(), [this] {
            scarce = false;
            ++failures;
        });
    }
    void TearDown() override {
        scarce = false;
        BallViewer::TearDown();
    }

    // Makes memory scarce at the next signal of the surfaces.
    template <class Signal>
    void scarce_after(Signal signal) {
        QObject::connect(&window->surfaces(), signal, window.get(), [] { scarce = true; });
    }
    bool fails() {
        return wait([&] { return failures > 0; }) && window->banner().startsWith("Not enough memory");
    }
    QString light() { return window->findChild<QLabel*>("closedness")->text(); }

    int failures = 0;
};

TEST_F(ScarceMemory, TheExportDialogSaysThatThereIsNoSurface) {
    key(Qt::Key_S, Qt::ControlModifier);
    auto* dialog = window->findChild<viewer::ExportDialog*>("export_dialog");
    ASSERT_TRUE(dialog);
    const auto* size = dialog->findChild<QLabel*>("size");
    const auto* accept = dialog->findChild<QPushButton*>("accept");
    EXPECT_TRUE(size->text().startsWith("About")) << size->text().toStdString();
    scarce = true;
    session().set_isovalue(100);
    EXPECT_TRUE(size->text().startsWith("About")) << size->text().toStdString();
    ASSERT_TRUE(fails()) << window->banner().toStdString();
    EXPECT_TRUE(size->text().startsWith("Not enough memory")) << size->text().toStdString();
    EXPECT_FALSE(accept->isEnabled());
    session().set_isovalue(50);
    ASSERT_TRUE(settle());
    EXPECT_TRUE(size->text().startsWith("About")) << size->text().toStdString();
    EXPECT_TRUE(accept->isEnabled());
}

TEST_F(ScarceMemory, ASurfaceIsShownThatCannotBeMeasured) {
    scarce_after(&viewer::Surfaces::shape_changed);
    session().set_isovalue(100);
    ASSERT_TRUE(fails()) << window->banner().toStdString();
    EXPECT_TRUE(window->surfaces().exact(session().parameters().current));
    EXPECT_EQ(light(), "");
}

TEST_F(ScarceMemory, ASurfaceIsMeasuredThatCannotBeChecked) {
    scarce_after(&viewer::Surfaces::measured);
    window->findChild<QSpinBox*>("smooth")->setValue(5);
    ASSERT_TRUE(fails()) << window->banner().toStdString();
    EXPECT_TRUE(window->surfaces().settled());
    EXPECT_TRUE(light().endsWith("not checked")) << light().toStdString();
}

TEST_F(ScarceMemory, ThereIsNoPictureWithoutTheSurface) {
    QApplication::clipboard()->setText("before");
    scarce = true;
    session().set_isovalue(100);
    ASSERT_TRUE(fails()) << window->banner().toStdString();
    key(Qt::Key_Escape);
    EXPECT_EQ(window->banner(), "");
    key(Qt::Key_C, Qt::ControlModifier);
    EXPECT_FALSE(window->busy());
    EXPECT_TRUE(window->banner().startsWith("Not enough memory")) << window->banner().toStdString();
    EXPECT_EQ(QApplication::clipboard()->text(), "before");
}

TEST_F(ScarceMemory, AnExportFailsWithASentence) {
    scarce = true;
    window->write({{session().parameters().current, folder / "ball.stl"}}, Space::LPS);
    ASSERT_TRUE(wait([&] { return !window->busy(); }));
    EXPECT_EQ(window->banner(), "Not enough memory for this export. Crop the scan and try again.");
    EXPECT_FALSE(std::filesystem::exists(folder / "ball.stl"));
}

}  // namespace
}  // namespace marrow::test
