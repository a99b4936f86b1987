/// STL files inside DICOM objects (PS3.3, A.85.1: Encapsulated STL).
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include <marrow/mesh.h>

namespace marrow::internal::io {

/// An STL file that a DICOM object holds.
struct EncapsulatedStl {
    std::string bytes;
    double scale = 1;  ///< millimetres per unit of its coordinates
};

/// \throw IoError; InputError it is no such object, or damaged
EncapsulatedStl read_encapsulated_stl(const std::filesystem::path& path);

/// What an object states beside the STL file.
struct StlObject {
    MeshView mesh;                                ///< the surface in the file
    std::uint32_t bytes = 0;                      ///< size of the file, even
    std::string title;                            ///< in UTF-8
    std::span<const std::filesystem::path> scan;  ///< DICOM files that the surface is made of
    bool keep_patient = false;                    ///< state patient and study, and refer to the files
};

/// The bytes of a DICOM file before and after the STL file in it.
struct StlWrapping {
    std::string before, after;
};

/// Makes the object around an STL file in millimetres. Its frame of reference is that of the scan. The same
/// input always gives the same bytes. \throw IoError, InputError a file of the scan cannot be read;
/// OptionError keep_patient without a scan
StlWrapping wrap_stl(const StlObject& object);

}  // namespace marrow::internal::io
