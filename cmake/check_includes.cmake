# Who may include whom. Given: SOURCE, the root of the repository.
#
# Public headers stand on the standard library alone. src/core adds Highway and oneTBB. Everything else reaches Marrow
# through include/marrow, and its own folder by "name.h"; no room reaches into another.
set(third_party "vtk[A-Z]|itk|gdcm|charls/|dcmtk/|openjpeg|gdal|ogr_|cpl_|Q[A-Z]|cuda|X11/|CLI/|fmt/|nlohmann/|spdlog/|zlib|tbb/|oneapi/|hwy/")
set(core_third_party "vtk[A-Z]|itk|gdcm|charls/|dcmtk/|openjpeg|gdal|ogr_|cpl_|Q[A-Z]|cuda|X11/|CLI/|fmt/|nlohmann/|spdlog/|zlib")
set(faults "")

# Checks the files of `folder`: no <include> that starts as `forbidden`, and only own files in quotes.
function(check_room folder forbidden)
  file(GLOB_RECURSE files ${SOURCE}/${folder}/*.h ${SOURCE}/${folder}/*.cpp ${SOURCE}/${folder}/*.cu)
  if(NOT files)
    message(FATAL_ERROR "there are no sources in ${SOURCE}/${folder}")
  endif()
  foreach(file ${files})
    get_filename_component(here ${file} DIRECTORY)
    file(RELATIVE_PATH name ${SOURCE} ${file})
    file(STRINGS ${file} lines REGEX "^ *# *include")
    foreach(line ${lines})
      if(forbidden AND line MATCHES "<(${forbidden})")
        list(APPEND faults "${name}: ${line} is not for ${folder}")
      elseif(line MATCHES "\"([^\"]+)\"")
        if(CMAKE_MATCH_1 MATCHES "\\.\\./" OR NOT EXISTS ${here}/${CMAKE_MATCH_1})
          list(APPEND faults "${name}: ${line} reaches out of its room")
        endif()
      endif()
    endforeach()
  endforeach()
  set(faults "${faults}" PARENT_SCOPE)
endfunction()

check_room(include/marrow "${third_party}")
check_room(src/core "${core_third_party}")
check_room(src/mesh "${core_third_party}")
foreach(room src/io src/terrain apps/marrow bench)
  check_room(${room} "")
endforeach()

list(JOIN faults "\n" text)
if(faults)
  message(FATAL_ERROR "include directions:\n${text}")
endif()
