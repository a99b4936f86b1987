# Checks who includes whom. Given: SOURCE, the root of the repository.
#
# A quoted name is a file of the same folder, or a path from src/ (from the application's folder in apps/, or from apps/ for apps/shared). The tables
# below say which folders a folder may include, and which libraries it may use, so that dependencies run one way.
cmake_minimum_required(VERSION 3.25)
set(faults "")

# check_folder(FOLDER ROOT MAY_INCLUDE LIBRARIES): the files of FOLDER include in quotes only files of their own folder
# and, by their path from ROOT, of the folders MAY_INCLUDE ("." is ROOT itself); in angle brackets, beside the standard
# library, the system and Marrow's public headers, only what begins with one of LIBRARIES ("*": anything).
# [EXCEPT FILES...]: these are not checked.
function(check_folder folder root may_include libraries)
  file(GLOB files ${SOURCE}/${folder}/*.h ${SOURCE}/${folder}/*.cpp)
  cmake_parse_arguments(PARSE_ARGV 4 arg "" "" "EXCEPT")
  list(TRANSFORM arg_EXCEPT PREPEND ${SOURCE}/${folder}/)
  list(REMOVE_ITEM files ${arg_EXCEPT})
  if(NOT files)
    list(APPEND faults "there are no sources in ${folder}")
  endif()
  foreach(file IN LISTS files)
    file(RELATIVE_PATH name ${SOURCE} ${file})
    file(STRINGS ${file} lines REGEX "^ *# *include")
    foreach(line IN LISTS lines)
      if(line MATCHES "\"([^\"]+)\"")
        set(included ${CMAKE_MATCH_1})
        cmake_path(GET included PARENT_PATH included_folder)
        if(included_folder STREQUAL "")
          if(NOT EXISTS ${SOURCE}/${folder}/${included} AND
             NOT ("." IN_LIST may_include AND EXISTS ${SOURCE}/${root}/${included}))
            list(APPEND faults "${name}: there is no ${included} in this folder")
          endif()
        elseif(NOT included_folder IN_LIST may_include)
          list(APPEND faults "${name}: ${folder} may not include ${included_folder}")
        elseif(NOT EXISTS ${SOURCE}/${root}/${included} AND NOT EXISTS ${SOURCE}/apps/${included})
          list(APPEND faults "${name}: there is no ${root}/${included}")
        endif()
      elseif(line MATCHES "<([^>]+)>" AND NOT libraries STREQUAL "*")
        set(included ${CMAKE_MATCH_1})
        set(allowed FALSE)
        # The standard library has no extension; the system's and C's headers are plain names or lie in sys/.
        foreach(prefix IN LISTS libraries ITEMS marrow/ sys/)
          string(FIND ${included} ${prefix} position)
          if(position EQUAL 0)
            set(allowed TRUE)
          endif()
        endforeach()
        if(included MATCHES "^[a-z_0-9]+$" OR included MATCHES "^(fcntl|unistd|dlfcn|signal|time|termios|errno|immintrin)\\.h$")
          set(allowed TRUE)
        endif()
        if(NOT allowed)
          list(APPEND faults "${name}: ${folder} may not use <${included}>")
        endif()
      endif()
    endforeach()
  endforeach()
  set(faults "${faults}" PARENT_SCOPE)
endfunction()

check_folder(include/marrow include "" "")

# What the libraries share.
check_folder(src/base src "" "tbb/")  # and nothing else may

# The meshes' part of the core: each folder may include those before it, and src/mesh itself all of them.
set(mesh_folders)
foreach(room IN ITEMS connectivity geometry search intersections smoothing reduction)
  check_folder(src/mesh/${room} src "base;${mesh_folders}" "hwy/")
  list(APPEND mesh_folders mesh/${room})
endforeach()
check_folder(src/mesh src "base;${mesh_folders}" "hwy/")

# The core: each folder may include those before it.
set(rooms volume grid marching_cubes snap surface_nets trust isosurface parts)
set(before base)
foreach(room IN LISTS rooms)
  # These two change surfaces that are valid, and ask src/mesh whether they still are.
  set(also "")
  if(room STREQUAL snap OR room STREQUAL surface_nets)
    set(also ";${mesh_folders}")
  endif()
  check_folder(src/core/${room} src "${before}${also}" "hwy/")
  list(APPEND before core/${room})
endforeach()

set(image_libraries "png.h;tiffio.h;turbojpeg.h;zlib.h;charls/;dcmtk/;openjpeg-2.5/;openjpeg.h")
check_folder(src/io/bytes src "base" "fmt/;nlohmann/;zlib.h;archive;expat.h")
check_folder(src/io/scan src "base;io/bytes" "fmt/;${image_libraries}")
check_folder(src/io/dicom src "base;io/bytes;io/scan" "fmt/;${image_libraries}")
check_folder(src/io/zarr src "base;io/bytes" "fmt/;nlohmann/;blosc.h;lz4.h;zlib.h;zstd.h")
check_folder(src/io/mesh src "base;io/bytes;io/dicom" "fmt/;nlohmann/;zlib.h")
check_folder(src/io src "base;io/bytes;io/scan;io/dicom;io/zarr" "fmt/")
check_folder(gpu src "base;core/volume;core/grid;core/marching_cubes" "volk.h")
check_folder(src/terrain src "base" "fmt/;gdal;ogr_;cpl_")

# Only the main programs include commands.
check_folder(apps/shared apps "" "CLI/;fmt/;X11/")
check_folder(apps/marrow apps/marrow "shared" "*" EXCEPT main.cpp terrain_main.cpp)
check_folder(apps/marrow/commands apps/marrow ".;shared" "*")
check_folder(apps/viewer/model apps/viewer "shared" "*")
check_folder(apps/viewer/views apps/viewer "model" "*")
check_folder(apps/viewer/window apps/viewer "model;views;shared" "*")
check_folder(apps/viewer apps/viewer "window;shared" "*")
check_folder(bindings/python/native bindings/python/native "" "fmt/;pybind11/;hwy/;tbb/")
check_folder(bench bench "paper" "*")
check_folder(bench/accuracy bench "marrow" "*")
check_folder(bench/paper bench "" "*")
check_folder(examples examples "" "")

# marrow.h includes all public headers of the library.
set(own_libraries gpu.h terrain.h marrow.h)
file(GLOB public_headers RELATIVE ${SOURCE}/include/marrow ${SOURCE}/include/marrow/*.h)
list(REMOVE_ITEM public_headers ${own_libraries})
file(READ ${SOURCE}/include/marrow/marrow.h all)
foreach(header IN LISTS public_headers)
  string(FIND "${all}" "#include <marrow/${header}>" at)
  if(at EQUAL -1)
    list(APPEND faults "include/marrow/marrow.h: does not include ${header}")
  endif()
endforeach()

list(JOIN faults "\n" text)
if(faults)
  message(FATAL_ERROR "Includes that are missing or break the order of the modules:\n${text}")
endif()
