# Checks that lines of C++ have at most 110 columns: clang-format leaves long comments and strings as they are. Given:
# SOURCE, the root of the repository.
cmake_minimum_required(VERSION 3.25)
set(faults "")

set(globs "")
foreach(folder apps bench bindings examples fuzz gpu include src tests web/wasm)
  list(APPEND globs ${SOURCE}/${folder}/*.h ${SOURCE}/${folder}/*.cpp)
endforeach()
file(GLOB_RECURSE files RELATIVE ${SOURCE} ${globs})
if(NOT files)
  message(FATAL_ERROR "there are no sources in ${SOURCE}")
endif()

string(REPEAT "." 111 too_long)
foreach(file IN LISTS files)
  file(STRINGS ${SOURCE}/${file} lines REGEX "${too_long}")
  if(lines)
    list(GET lines 0 line)
    list(APPEND faults "${file}: longer than 110 columns: ${line}")
  endif()
endforeach()

list(JOIN faults "\n" text)
if(faults)
  message(FATAL_ERROR "Lines that are too long:\n${text}")
endif()
