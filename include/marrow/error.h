/// The exceptions that Marrow throws.
#pragma once

#include <stdexcept>

#include <marrow/export.h>

namespace marrow {

/// The base of all errors that Marrow throws. what() is one line that says what is wrong, where, and what to
/// do.
struct MARROW_EXPORT Error : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// A bad argument, or a file whose content is damaged or not supported.
struct MARROW_EXPORT InputError : Error {
    using Error::Error;
};

/// An option that does not fit the input: a series or volume that it does not have, or a spacing that
/// contradicts it.
struct MARROW_EXPORT OptionError : InputError {
    using InputError::InputError;
};

/// The content is readable, but its geometry is ambiguous or would distort the result: several series, uneven
/// slices, no spacing.
struct MARROW_EXPORT GeometryError : InputError {
    using InputError::InputError;
};

/// The operating system refused: missing file, no permission, full disk.
struct MARROW_EXPORT IoError : Error {
    using Error::Error;
};

/// An input or a result that is too large: more than 2^32 - 1 points, not enough memory.
struct MARROW_EXPORT LimitError : Error {
    using Error::Error;
};

/// The progress callback returned false, which stops the work.
struct MARROW_EXPORT Cancelled : Error {
    Cancelled() : Error("cancelled") {}
};

}  // namespace marrow
