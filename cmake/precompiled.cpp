// CMake precompiles headers for a target, which needs a source.
