/// What Marrow throws.
#pragma once

#include <stdexcept>

namespace marrow {

/// Base of every error that Marrow throws on purpose; what() is one line: what, where, what to do.
struct Error : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// A bad argument, or a file whose content is not what it should be.
struct InputError : Error {
    using Error::Error;
};

/// The content is readable but its geometry is ambiguous or would distort: several series, uneven slices, no
/// spacing.
struct GeometryError : InputError {
    using InputError::InputError;
};

/// The operating system said no: missing file, no permission, full disk.
struct IoError : Error {
    using Error::Error;
};

/// A result or an input beyond what can be represented: more than 2^32 - 1 points, not enough memory.
struct LimitError : Error {
    using Error::Error;
};

/// The progress callback asked to stop.
struct Cancelled : Error {
    Cancelled() : Error("cancelled") {}
};

}  // namespace marrow
