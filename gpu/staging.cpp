// Copies in pieces.
#include "staging.h"

#include <algorithm>
#include <cstring>
#include <vector>

#include "base/parallel.h"

namespace marrow::gpu::internal {

namespace {

using marrow::internal::parallel_for_ranges;

constexpr std::size_t kBytesOfThread = std::size_t{1} << 20;  // less is not worth another thread

// A part of a download, and its place in the piece.
struct Fragment {
    const DeviceBuffer* from;
    std::byte* to;
    std::uint64_t bytes, begin, place;
};

// Shares out downloads to pieces.
std::vector<std::vector<Fragment>> fragments(std::span<const Download> downloads, std::uint64_t piece_bytes) {
    std::vector<std::vector<Fragment>> pieces;
    std::uint64_t used = piece_bytes;
    for (const Download& download : downloads) {
        for (std::uint64_t begin = 0; begin < download.bytes;) {
            if (used == piece_bytes) {
                pieces.emplace_back();
                used = 0;
            }
            const std::uint64_t bytes = std::min(piece_bytes - used, download.bytes - begin);
            pieces.back().push_back(
                {download.from, static_cast<std::byte*>(download.to) + begin, bytes, begin, used});
            begin += bytes;
            used += bytes;
        }
    }
    return pieces;
}

void copy_bytes(std::byte* to, const std::byte* from, std::uint64_t bytes) {
    parallel_for_ranges(std::uint64_t{0}, bytes, kBytesOfThread, [&](const auto& range) {
        std::memcpy(to + range.begin(), from + range.begin(), range.end() - range.begin());
    });
}

}  // namespace

Staging::Staging(std::shared_ptr<VulkanDevice> device)
    : device_(std::move(device)), pieces_{Piece(device_), Piece(device_)} {}

Staging::Guard::~Guard() {
    for (Piece& piece : pieces) piece.commands.wait_until_idle();
}

void Staging::reserve(Piece& piece, std::uint64_t bytes) {
    if (piece.memory.bytes() >= bytes) return;
    piece.memory = {};
    piece.memory = DeviceBuffer(device_, bytes, DeviceBuffer::Place::host);
}

void Staging::upload(const DeviceBuffer& to, std::uint64_t unit,
                     const std::function<void(std::uint64_t, std::byte*)>& fill) {
    const Guard guard{pieces_};
    const std::uint64_t units = to.bytes() / unit;
    const std::uint64_t at_once = std::max<std::uint64_t>(1, device_->limits().staging / unit);
    const std::size_t grain = std::max<std::size_t>(1, kBytesOfThread / unit);
    std::size_t turn = 0;
    for (std::uint64_t first = 0; first < units; first += at_once, turn ^= 1) {
        Piece& piece = pieces_[turn];
        piece.commands.wait();
        const std::uint64_t count = std::min(at_once, units - first);
        reserve(piece, count * unit);
        parallel_for_ranges(std::uint64_t{0}, count, grain, [&](const auto& range) {
            for (std::uint64_t k = range.begin(); k < range.end(); ++k)
                fill(first + k, piece.memory.mapped() + k * unit);
        });
        piece.commands.start([&](VkCommandBuffer commands) {
            const VkBufferCopy region{0, first * unit, count * unit};
            vkCmdCopyBuffer(commands, piece.memory.handle(), to.handle(), 1, &region);
            barrier(commands, kCopy, kKernel);
        });
    }
    for (Piece& piece : pieces_) piece.commands.wait();
}

void Staging::download(std::span<const Download> downloads,
                       const std::function<void(std::uint64_t)>& copied) {
    const Guard guard{pieces_};
    const auto parts = fragments(downloads, device_->limits().staging);
    for (std::size_t k = 0; k <= parts.size(); ++k) {
        if (k < parts.size()) {  // its piece of memory was emptied two rounds ago
            Piece& piece = pieces_[k % 2];
            reserve(piece, parts[k].back().place + parts[k].back().bytes);
            piece.commands.start([&](VkCommandBuffer commands) {
                for (const Fragment& f : parts[k]) {
                    const VkBufferCopy region{f.begin, f.place, f.bytes};
                    vkCmdCopyBuffer(commands, f.from->handle(), piece.memory.handle(), 1, &region);
                }
                barrier(commands, kCopy, kHost);
            });
        }
        if (k == 0) continue;
        Piece& before = pieces_[(k - 1) % 2];
        before.commands.wait();
        for (const Fragment& f : parts[k - 1]) copy_bytes(f.to, before.memory.mapped() + f.place, f.bytes);
        copied(parts[k - 1].back().place + parts[k - 1].back().bytes);
    }
}

}  // namespace marrow::gpu::internal
