/// The version of Marrow.
#pragma once

#define MARROW_VERSION_MAJOR 0
#define MARROW_VERSION_MINOR 2
#define MARROW_VERSION_PATCH 0
#define MARROW_VERSION "0.2.0"
