/// Isosurfaces on a GPU, by Vulkan compute.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <marrow/error.h>
#include <marrow/export.h>
#include <marrow/isosurface.h>
#include <marrow/mesh.h>
#include <marrow/volume.h>

namespace marrow::gpu {

namespace internal {
class DeviceBuffer;
}

/// A device cannot extract: no device or several have the number or name, it was lost, its memory is too
/// small, it does not support the volume or the options, or the process was forked from one that had opened a
/// device. The CPU can extract instead, as FallbackExtractor does.
struct MARROW_EXPORT DeviceError : Error {
    using Error::Error;
};

/// What a device is, from the most to the least likely to be fast.
enum class DeviceKind {
    discrete,     ///< a graphics card with its own memory
    integrated,   ///< a part of the processor, whose memory it shares
    virtual_gpu,  ///< of a virtual machine
    other,
    software  ///< emulated by the CPU, so it is good for tests only
};

/// "discrete", "integrated", "virtual", "other" or "software".
MARROW_EXPORT const char* device_kind_name(DeviceKind kind);

/// A device of Vulkan.
struct Device {
    std::string name;
    DeviceKind kind = DeviceKind::other;
    std::string driver = {};   ///< its name and version; empty: unknown
    std::uint64_t memory = 0;  ///< bytes of its largest local memory
    /// The numbers by which CUDA, OpenGL and other instances of Vulkan know the device and its driver. Those
    /// that import memory of the device must have the same.
    std::array<std::uint8_t, 16> uuid{}, driver_uuid{};
};

/// The devices that can be used, in the order of the driver. Empty where there is no Vulkan loader or driver,
/// or where Marrow was built without Vulkan (MARROW_GPU). The first call loads them, which can take a second.
MARROW_EXPORT std::vector<Device> devices();

/// A device that cannot be used, and why.
struct UnusableDevice {
    Device device;
    std::string reason;
};
/// The devices of Vulkan that Marrow cannot use, in the order of the driver.
MARROW_EXPORT std::vector<UnusableDevice> unusable_devices();

/// Why devices() and unusable_devices() are both empty, such as "no Vulkan driver is installed".
MARROW_EXPORT std::string why_no_devices();

/// The number in devices() of the device that a user wants, or none for the CPU. Upper and lower case are the
/// same. `choice` is
/// - "cpu";
/// - "auto": the first GPU of the first DeviceKind that there is, or else the CPU, but never a software
///   device;
/// - "gpu": the same GPU, which must be there;
/// - the number of a device, its name or a part of that: also a software device. Digits alone are a number,
///   and a whole name goes before parts of names.
/// \throw DeviceError there is none, or several have this name, or have it in their names
MARROW_EXPORT std::optional<std::size_t> choose_device(std::string_view choice);

/// An array that was left in the memory of a device. It begins where the memory begins.
///
/// Copies refer to the same memory, which lives as long as one of them, or anything that imported it.
class MARROW_EXPORT DeviceArray {
  public:
    std::uint64_t bytes() const { return bytes_; }  ///< of the array; 0 where there is none
    /// Bytes of the whole memory, which is what imports ask for.
    std::uint64_t allocation() const;
    /// A number that no other memory of this process has had. Memory that was imported once need not be
    /// imported again while it stays the same.
    std::uint64_t id() const;
    /// A new file descriptor of the memory, for imports as VK_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_FD_BIT,
    /// GL_HANDLE_TYPE_OPAQUE_FD_EXT or CU_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_FD; the allocation is not
    /// dedicated. It belongs to the caller, until an import takes it over. \throw InputError there is no
    /// array; DeviceError the device cannot export memory
    int export_fd() const;

  private:
    friend class Extractor;
    std::uint64_t bytes_ = 0;
    std::shared_ptr<const internal::DeviceBuffer> memory_;
};

/// A surface on a device: the arrays of a Mesh, with the same bytes.
struct DeviceMesh {
    std::uint64_t points = 0, triangles = 0;  ///< how many
    DeviceArray positions;                    ///< three float32 a point
    DeviceArray normals;                      ///< three float32 a point, or none
    DeviceArray indices;                      ///< three uint32 a triangle
};

/// Extracts many surfaces from one volume, as IsosurfaceExtractor does, on a GPU.
///
/// The volume is copied to the device once. The mesh is byte for byte that of extract_isosurface. The device
/// takes samples of 8 and 16 bits and float32, and the options `normals`, `closed` and `progress`; `threads`
/// has no meaning. Two threads must not use one extractor at the same time, but may use different ones.
///
/// A device need not compute with denormal numbers or infinities. Where a point or normal depends on numbers
/// so near to zero or so large that they might occur, extract() throws DeviceError instead of giving other
/// bits (docs/gpu.md says which).
class MARROW_EXPORT Extractor {
  public:
    /// Copies the volume to the device whose index in devices() is given. The view's samples are not needed
    /// afterwards. \throw InputError as extract_isosurface; DeviceError see there; Cancelled
    explicit Extractor(const VolumeView& volume, const IsosurfaceOptions& options = {},
                       std::size_t device = 0);
    ~Extractor();
    Extractor(Extractor&&) noexcept;
    Extractor& operator=(Extractor&&) noexcept;

    /// Replaces `mesh` by the surface at `isovalue`, and reuses its memory. After an exception the extractor
    /// can be used as before, unless the device is lost, and the content of the mesh has no meaning. `stats`
    /// may be null; its scratch_bytes are those on the device, and the times to classify and count are
    /// measured there (0 on devices that have no clock). \throw InputError the isovalue is NaN or infinite;
    /// LimitError not enough memory for the mesh; DeviceError see there; Cancelled
    void extract(double isovalue, Mesh& mesh, IsosurfaceStats* stats = nullptr);

    /// The same surface in a mesh that the extractor owns. It is valid until the next call.
    const Mesh& extract(double isovalue, IsosurfaceStats* stats = nullptr);

    /// The same surface, left on the device, where it is complete when this returns. The next
    /// call of any extract function overwrites the arrays. They move to other memory only if they
    /// have to grow. \throw as extract
    const DeviceMesh& extract_on_device(double isovalue, IsosurfaceStats* stats = nullptr);

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// Extracts many surfaces from one volume on a device, and on the CPU after a DeviceError: it has the
/// interface of IsosurfaceExtractor, gives the same bytes, and throws no DeviceError.
class MARROW_EXPORT FallbackExtractor {
  public:
    /// Without a device, or where the device cannot take the volume or the options, the CPU extracts. Borrows
    /// the volume's samples, which must outlive the extractor and not change. \throw as Extractor and
    /// IsosurfaceExtractor, but not DeviceError
    FallbackExtractor(const VolumeView& volume, const IsosurfaceOptions& options,
                      std::optional<std::size_t> device);
    ~FallbackExtractor();
    FallbackExtractor(FallbackExtractor&&) noexcept;
    FallbackExtractor& operator=(FallbackExtractor&&) noexcept;

    /// As IsosurfaceExtractor::extract. Previews, with `level` > 0, are always extracted on the CPU.
    void extract(double isovalue, Mesh& mesh, int level = 0, IsosurfaceStats* stats = nullptr);

    /// The same surface in a mesh that the extractor owns. It is valid until the next call with this level.
    const Mesh& extract(double isovalue, int level = 0, IsosurfaceStats* stats = nullptr);

    /// Whether the device extracts. Once it has failed, it is not tried again.
    bool on_device() const;

    /// Why the CPU took over from the device, in a clause; empty if it did not.
    const std::string& failure() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace marrow::gpu
