/// Copies between the host and a device.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include "commands.h"
#include "device_buffer.h"

namespace marrow::gpu::internal {

/// The first bytes of a buffer, and where they go.
struct Download {
    const DeviceBuffer* from;
    std::uint64_t bytes;
    void* to;
};

/// Copies through two pieces of memory that both sides see: while the device copies one, the host fills or
/// empties the other by all threads.
class Staging {
  public:
    explicit Staging(std::shared_ptr<VulkanDevice> device);

    /// Fills `to`, whose size is a multiple of `unit`: fill(k, memory) writes the k-th unit, on any thread.
    void upload(const DeviceBuffer& to, std::uint64_t unit,
                const std::function<void(std::uint64_t, std::byte*)>& fill);
    /// Copies several buffers one after the other, and calls copied(bytes) after each piece.
    void download(std::span<const Download> downloads, const std::function<void(std::uint64_t)>& copied);

  private:
    struct Piece {
        explicit Piece(const std::shared_ptr<VulkanDevice>& device) : commands(device) {}
        DeviceBuffer memory;
        Commands commands;
    };
    /// Waits for both when it ends, because of an exception too, so that nothing is copied any more.
    struct Guard {
        std::array<Piece, 2>& pieces;
        ~Guard();
    };

    void reserve(Piece& piece, std::uint64_t bytes);

    std::shared_ptr<VulkanDevice> device_;
    std::array<Piece, 2> pieces_;
};

}  // namespace marrow::gpu::internal
