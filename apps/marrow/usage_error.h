#pragma once

#include <marrow/error.h>

namespace marrow {

/// The command line does not make sense, by itself or for this scan.
struct UsageError : Error {
    using Error::Error;
};

}  // namespace marrow
