// Notes whether codecs are needed.
#include "needed.h"

#include <atomic>

namespace marrow::web {
namespace {

std::atomic<bool> needed = false;

}  // namespace

void need_codecs() {
    needed = true;
}

bool take_need_of_codecs() {
    return needed.exchange(false);
}

}  // namespace marrow::web
