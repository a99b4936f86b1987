/// Marks what a shared library exports; everything else is hidden.
#pragma once

#define MARROW_EXPORT __attribute__((visibility("default")))
