/// Session files: a scan, and everything that was set up to look at it.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "camera.h"
#include "session.h"

namespace marrow::viewer {

inline constexpr const char* kSessionExtension = ".marrow";

/// What a session file holds. The ids of the surfaces are their places in the list, from 0.
struct SavedSession {
    std::filesystem::path scan;  ///< absolute
    ScanOptions options;         ///< without the progress function
    std::array<std::int64_t, 3> dims{0, 0, 0};
    Parameters parameters;
    Vec3d crosshair{0, 0, 0};  ///< index
    std::optional<CameraState> camera;
};

/// Whether a file is a session and not a scan, by its name.
bool is_session_file(const std::filesystem::path& file);

/// Writes a session as JSON. The path of the scan is relative if the scan is in the folder of the session, so
/// that both can be moved together. \throw IoError; InputError the session could not be read again
void write_session(const SavedSession& session, const std::filesystem::path& file);

/// Reads a session. Everything that does not depend on the scan is checked.
/// \throw IoError the file is unreadable; InputError it is not a session of this version, or a value in it is
/// impossible
SavedSession read_session(const std::filesystem::path& file);

/// \throw InputError the session is of a scan with other samples, or refers to samples outside of it
void check_session(const SavedSession& session, const Scan& scan);

}  // namespace marrow::viewer
