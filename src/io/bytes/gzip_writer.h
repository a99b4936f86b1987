/// Compresses output by gzip.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
namespace marrow::internal::io {

/// Compresses bytes and passes them on to `write`. The same input always gives the same output.
class GzipWriter {
  public:
    using Write = std::function<void(const void* data, std::size_t bytes)>;

    explicit GzipWriter(Write write);
    ~GzipWriter();

    void write(const void* data, std::size_t bytes);
    /// Writes the rest. \pre no write follows
    void finish();

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace marrow::internal::io
