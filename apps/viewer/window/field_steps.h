/// Divides the changes of a field into steps of undo.
#pragma once

#include <QWidget>

#include "model/session.h"

namespace marrow::viewer {

/// Watches a spin box or slider whose changes merge into one step of undo. A key while it is held is a step
/// of its own, and so are a drag and a typed value.
class FieldSteps : public QObject {
    Q_OBJECT
  public:
    FieldSteps(QWidget* field, Session& session);

  protected:
    bool eventFilter(QObject* field, QEvent* event) override;

  private:
    Session& session_;
};

}  // namespace marrow::viewer
