/* What emscripten has, as DCMTK's libraries for JPEG and JPEG-LS ask for it. */
#pragma once

#define BEGIN_EXTERN_C extern "C" {
#define END_EXTERN_C }
#define C_INLINE inline
#define HAVE_CLASS_TEMPLATE 1
#define HAVE_CXX11 1
#define HAVE_C_CONST 1
#define HAVE_STATIC_TEMPLATE_METHOD 1
#define HAVE_STDDEF_H 1
#define HAVE_STDLIB_H 1
#define HAVE_STD_NAMESPACE 1
#define HAVE_STL_LIMITS 1
#define HAVE_STL_STRING 1
#define HAVE_STRING_H 1
