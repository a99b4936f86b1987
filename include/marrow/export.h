/// Marks what the shared libraries export. Everything else is hidden.
#pragma once

#define MARROW_EXPORT __attribute__((visibility("default")))
