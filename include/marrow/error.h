/// What Marrow throws.
#pragma once

#include <stdexcept>

#include <marrow/export.h>

namespace marrow {

/// Base of every error that Marrow throws on purpose; what() is one line: what, where, what to do.
struct MARROW_EXPORT Error : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// A bad argument, or a file whose content is not what it should be.
struct MARROW_EXPORT InputError : Error {
    using Error::Error;
};

/// The content is readable but its geometry is ambiguous or would distort: several series, uneven slices, no
/// spacing.
struct MARROW_EXPORT GeometryError : InputError {
    using InputError::InputError;
};

/// The operating system said no: missing file, no permission, full disk.
struct MARROW_EXPORT IoError : Error {
    using Error::Error;
};

/// A result or an input beyond what can be represented: more than 2^32 - 1 points, not enough memory.
struct MARROW_EXPORT LimitError : Error {
    using Error::Error;
};

/// The progress callback asked to stop.
struct MARROW_EXPORT Cancelled : Error {
    Cancelled() : Error("cancelled") {}
};

}  // namespace marrow
