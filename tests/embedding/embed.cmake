# Builds and runs a small program that uses Marrow in one of three ways.
# Given: WAY (subdirectory, FetchContent or installed), SHARED (ON or OFF), MARROW (its source folder), BUILD (its build
# folder), WORK (a folder to use), GENERATOR, CXX, CXX_FLAGS, RELEASE_FLAGS (those that BUILD has for Release), NM.
function(must_run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "failed (${result}): ${command}\n${output}")
  endif()
endfunction()

# These builds test CMake's side. They have one SIMD target and no optimization, unless a compiler cache can give them the
# objects of BUILD, which must have the same flags. Marrow has no flags of its own for this build type.
set(flags "-O0 -DHWY_COMPILE_ONLY_STATIC")
if(DEFINED ENV{CMAKE_CXX_COMPILER_LAUNCHER})
  set(flags "${RELEASE_FLAGS}")
endif()
set(compiler -G ${GENERATOR} -D CMAKE_CXX_COMPILER=${CXX} -D CMAKE_BUILD_TYPE=Embedded
  "-DCMAKE_CXX_FLAGS=${CXX_FLAGS}" "-DCMAKE_CXX_FLAGS_EMBEDDED=${flags}")
set(here ${MARROW}/tests/embedding)
file(REMOVE_RECURSE ${WORK} ${WORK}-marrow)

if(NOT WAY STREQUAL "installed")
  must_run(${CMAKE_COMMAND} -S ${here}/core -B ${WORK} ${compiler} -D WAY=${WAY} -D MARROW=${MARROW} -D MARROW_SHARED=${SHARED})
  set(program app)
  if(NOT SHARED)  # static libraries are built for the installed way, and FetchContent adds a subdirectory
    set(program exact)
  endif()
  must_run(${CMAKE_COMMAND} --build ${WORK} --target ${program})
  must_run(${WORK}/${program})
  return()
endif()

# The shared libraries are those of BUILD; the static ones are built here, without the programs.
set(build ${BUILD})
if(NOT SHARED)
  set(build ${WORK}-marrow)
  must_run(${CMAKE_COMMAND} -S ${MARROW} -B ${build} ${compiler} -D MARROW_SHARED=OFF -D MARROW_APPS=OFF)
  must_run(${CMAKE_COMMAND} --build ${build})
endif()
must_run(${CMAKE_COMMAND} --install ${build} --prefix ${WORK}/prefix)
must_run(${CMAKE_COMMAND} -S ${here}/installed -B ${WORK}/app ${compiler} -D CMAKE_PREFIX_PATH=${WORK}/prefix)
must_run(${CMAKE_COMMAND} --build ${WORK}/app)
if(SHARED)
  must_run(${WORK}/prefix/bin/marrow --version)
  # The libraries find each other in any folder, such as lib/x86_64-linux-gnu.
  file(GLOB libraries ${WORK}/prefix/lib/libmarrow*)
  file(COPY ${libraries} DESTINATION ${WORK}/moved)
  execute_process(COMMAND ldd ${WORK}/moved/libmarrow.so OUTPUT_VARIABLE found COMMAND_ERROR_IS_FATAL ANY)
  if(found MATCHES "libmarrow[^\n]*not found")
    message(FATAL_ERROR "libmarrow.so does not find a library beside it:\n${found}")
  endif()
else()
  # A plugin that holds Marrow exports nothing of it but, as they are thrown out of it, its exceptions.
  execute_process(COMMAND ${NM} --dynamic --defined-only --demangle ${WORK}/app/libplugin.so OUTPUT_VARIABLE symbols
    COMMAND_ERROR_IS_FATAL ANY)
  string(REGEX REPLACE "[^\n]*marrow::([A-Za-z]*Error|Cancelled)[^\n]*" "" others "${symbols}")
  if(others MATCHES "marrow::")
    message(FATAL_ERROR "a plugin exports the static Marrow that it holds:\n${symbols}")
  endif()
endif()

# A scan of 3 x 3 x 3 samples, of which the middle one is inside.
string(REPEAT "0 " 13 zeros)
string(REPLACE " " "" zeros "${zeros}")
file(WRITE ${WORK}/scan.nrrd "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 3 3 3\nspace: left-posterior-superior\n"
  "space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\nencoding: raw\n\n${zeros}1${zeros}")
must_run(${WORK}/app/app ${WORK}/scan.nrrd ${WORK}/mesh.stl)
file(SIZE ${WORK}/mesh.stl size)
if(NOT size GREATER 84)
  message(FATAL_ERROR "mesh.stl has ${size} bytes and so no triangle")
endif()
