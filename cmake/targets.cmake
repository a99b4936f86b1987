# What the targets of Marrow have in common.
set(MARROW_CMAKE_FOLDER ${CMAKE_INSTALL_LIBDIR}/cmake/marrow)  # where find_package(marrow) looks

# The output has the same bits on every processor: the compiler must not contract to fused multiply-add. Exact predicates
# and checks for NaN fail under -ffast-math, which a project that Marrow is part of may have; clang warns if what undoes it
# does not come last.
function(marrow_arithmetic target)
  target_compile_options(${target} PRIVATE -ffp-contract=off -fno-fast-math)
endfunction()

# Language, warnings and reproducible arithmetic.
function(marrow_target target)
  target_compile_features(${target} PUBLIC cxx_std_20)
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF
    INSTALL_RPATH $ORIGIN  # a library finds the others beside it
    UNITY_BUILD OFF)  # sources that Highway compiles once for each SIMD target cannot be joined
  target_compile_options(${target} PRIVATE -Wall -Wextra $<$<BOOL:${MARROW_WERROR}>:-Werror>)
  marrow_arithmetic(${target})
  if(MARROW_PRECOMPILED_HEADERS)
    target_precompile_headers(${target} REUSE_FROM precompiled_headers)
  endif()
endfunction()

# Headers that many sources include. To share them, all targets need the flags that the libraries have.
if(MARROW_PRECOMPILED_HEADERS)
  add_library(precompiled_headers OBJECT ${CMAKE_CURRENT_LIST_DIR}/precompiled.cpp)
  target_compile_features(precompiled_headers PUBLIC cxx_std_20)
  marrow_arithmetic(precompiled_headers)
  set_target_properties(precompiled_headers PROPERTIES
    CXX_EXTENSIONS OFF POSITION_INDEPENDENT_CODE ON CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
  target_precompile_headers(precompiled_headers PRIVATE ${CMAKE_CURRENT_LIST_DIR}/precompiled.h)
endif()

# marrow_library(NAME EXPORT_NAME [PACKAGE package] [SOURCES ...] [PUBLIC ...] [PRIVATE ...]): a library that is exported as
# marrow::EXPORT_NAME. Its objects form a target of their own, NAME_objects, so that the tests can link the hidden
# symbols too. With PACKAGE it is installed, and found by CMake, apart from the others.
function(marrow_library name export_name)
  cmake_parse_arguments(PARSE_ARGV 2 arg "" "PACKAGE" "SOURCES;PUBLIC;PRIVATE")
  add_library(${name}_objects OBJECT ${arg_SOURCES})
  marrow_target(${name}_objects)
  set_target_properties(${name}_objects PROPERTIES
    POSITION_INDEPENDENT_CODE ON CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
  target_include_directories(${name}_objects PUBLIC ${PROJECT_SOURCE_DIR}/include PRIVATE ${PROJECT_SOURCE_DIR}/src)
  target_link_libraries(${name}_objects PUBLIC ${arg_PUBLIC} PRIVATE ${arg_PRIVATE})

  if(MARROW_SHARED)
    add_library(${name} SHARED $<TARGET_OBJECTS:${name}_objects>)
  else()
    add_library(${name} STATIC $<TARGET_OBJECTS:${name}_objects>)
    # A shared library that holds this one does not export it, so that two with different versions of Marrow do not call
    # each other's functions.
    if(CMAKE_SYSTEM_NAME STREQUAL Linux)
      target_link_options(${name} INTERFACE LINKER:--exclude-libs,$<TARGET_FILE_NAME:marrow::${export_name}>)
    endif()
  endif()
  add_library(marrow::${export_name} ALIAS ${name})
  marrow_target(${name})
  # Until 1.0 each minor version may break binary compatibility.
  set_target_properties(${name} PROPERTIES EXPORT_NAME ${export_name} VERSION ${PROJECT_VERSION}
    SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR} LINKER_LANGUAGE CXX)
  target_include_directories(${name} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_link_libraries(${name} PUBLIC ${arg_PUBLIC} PRIVATE ${arg_PRIVATE})
  if(MARROW_INSTALL)
    set(export marrow)
    set(library library)
    set(development development)
    if(arg_PACKAGE)
      set(export marrow-${arg_PACKAGE})
      set(library ${arg_PACKAGE})
      set(development ${arg_PACKAGE})
      install(EXPORT ${export} NAMESPACE marrow:: FILE ${export}-targets.cmake
        DESTINATION ${MARROW_CMAKE_FOLDER} COMPONENT ${development})
    endif()
    install(TARGETS ${name} EXPORT ${export}
      LIBRARY COMPONENT ${library} NAMELINK_COMPONENT ${development} ARCHIVE COMPONENT ${development})
  endif()
endfunction()

# marrow_program(TARGET NAME COMPONENT): an executable that is called NAME and is installed with COMPONENT.
function(marrow_program target name component)
  marrow_target(${target})
  file(RELATIVE_PATH libraries ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_LIBDIR})
  set_target_properties(${target} PROPERTIES OUTPUT_NAME ${name} INSTALL_RPATH $ORIGIN/${libraries})
  if(MARROW_INSTALL)
    install(TARGETS ${target} COMPONENT ${component})
  endif()
endfunction()
