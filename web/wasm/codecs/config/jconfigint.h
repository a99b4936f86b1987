/* What emscripten has, as libjpeg-turbo asks for it. */
#pragma once

#define BUILD "emscripten"
#define FALLTHROUGH __attribute__((fallthrough));
#define HAVE_BUILTIN_CTZL 1
#define INLINE inline
#define PACKAGE_NAME "libjpeg-turbo"
#define SIZEOF_SIZE_T 4
#define THREAD_LOCAL /* for the texts of errors alone, which are not read */
#define VERSION "2.1.5"
