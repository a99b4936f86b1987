/// Reads a scan that may be damaged.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <filesystem>

#include <marrow/error.h>
#include <marrow/scan_io.h>

/// Reads a scan, and aborts if the volume is not as its geometry says. Returns false if it needs an option.
inline bool read_scan_with(const std::filesystem::path& path, const marrow::ScanOptions& options) {
    try {
        const marrow::Volume volume = marrow::read_scan(path, options);
        marrow::check_geometry(volume.geometry());
        const std::size_t expected =
            static_cast<std::size_t>(volume.geometry().sample_count()) * marrow::sample_size(volume.type());
        if (volume.bytes() != expected) std::abort();
        // Touch the samples, so that sanitizers find memory that is missing.
        volatile unsigned char sum = 0;
        for (std::size_t i = 0; i < volume.bytes(); i += 4096)
            sum = sum + static_cast<const unsigned char*>(volume.data())[i];
        return true;
    } catch (const marrow::GeometryError&) {
        return false;
    } catch (const marrow::Error&) {
        return true;
    }
}

/// Reads a scan with the options that it needs, if these help: a spacing, or the choice of `volume`.
inline void read_any_scan(const std::filesystem::path& path, std::size_t volume) {
    marrow::ScanOptions options;
    options.threads = 1;
    options.keep_stored = volume % 2 == 0;  // either way
    if (read_scan_with(path, options)) return;
    options.spacing = marrow::Vec3d{1, 1, 1};
    if (read_scan_with(path, options)) return;
    options.spacing.reset();
    options.volume = static_cast<std::int64_t>(volume);
    try {
        read_scan_with(path, options);
        marrow::inspect_scan(path);
    } catch (const marrow::Error&) {
    }
}
