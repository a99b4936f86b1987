# What every target of Marrow shares.
function(marrow_target target)
  target_compile_features(${target} PUBLIC cxx_std_20)
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF)
  target_compile_options(${target} PRIVATE -Wall -Wextra $<$<BOOL:${MARROW_DEVELOPER}>:-Werror>)
  # Output must have the same bits on every processor: no fused multiply-add unless written.
  target_compile_options(${target} PRIVATE -ffp-contract=off)
endfunction()

# A library that is installed and exported as marrow::<name>.
function(marrow_library target export_name)
  marrow_target(${target})
  add_library(marrow::${export_name} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${export_name} VERSION ${PROJECT_VERSION}
                        SOVERSION ${PROJECT_VERSION_MAJOR} POSITION_INDEPENDENT_CODE ON)
  target_include_directories(${target} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  install(TARGETS ${target} EXPORT marrow)
endfunction()
