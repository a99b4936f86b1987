// Sets the parameters of glibc's heap.
#include "memory.h"

#include <malloc.h>

#include <limits>

namespace marrow::bench {

void set_memory(Memory memory) {
    if (memory == Memory::fresh) {
        mallopt(M_MMAP_MAX, 1 << 16);
        mallopt(M_MMAP_THRESHOLD, 1 << 17);
        mallopt(M_TRIM_THRESHOLD, 1 << 17);
        malloc_trim(0);
    } else {
        mallopt(M_MMAP_MAX, 0);
        mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());
        mallopt(M_TOP_PAD, 1 << 26);
    }
}

}  // namespace marrow::bench
