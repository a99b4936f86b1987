/* What emscripten has, as OpenJPEG asks for it. */
#pragma once

#define OPJ_HAVE_INTTYPES_H 1
#define OPJ_HAVE_POSIX_MEMALIGN 1
#define OPJ_PACKAGE_VERSION "2.5.0"
#define _POSIX_C_SOURCE 200112L
