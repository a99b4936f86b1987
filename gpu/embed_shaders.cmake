# Writes the function that kernels.h declares. Given: KERNELS, their names; FOLDER, which has the SPIR-V file of each;
# and OUTPUT, the C++ file.
cmake_minimum_required(VERSION 3.25)
set(arrays "")
set(cases "")
foreach(kernel IN LISTS KERNELS)
  file(READ ${FOLDER}/${kernel}.spv bytes HEX)
  string(REGEX REPLACE "(..)(..)(..)(..)" "0x\\4\\3\\2\\1," words "${bytes}")
  string(APPEND arrays "constexpr std::uint32_t k_${kernel}[] = {${words}};\n")
  string(APPEND cases "        case Kernel::${kernel}:\n            return k_${kernel};\n")
endforeach()
file(WRITE ${OUTPUT} "// Made from the shaders by embed_shaders.cmake.
#include \"gpu/kernels.h\"

namespace marrow::gpu::internal {

namespace {

${arrays}
}  // namespace

std::span<const std::uint32_t> spirv(Kernel kernel) {
    switch (kernel) {
${cases}    }
    return {};
}

}  // namespace marrow::gpu::internal
")
