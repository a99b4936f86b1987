# Checks that lines of C++ have at most 110 columns: clang-format leaves long comments and strings as they are. Given:
# SOURCE, the root of the repository.
cmake_minimum_required(VERSION 3.25)

# In this locale a column is a character, not a byte.
execute_process(
  COMMAND ${CMAKE_COMMAND} -E env LC_ALL=C.UTF-8 grep -rnE --include=*.h --include=*.cpp "^.{111,}$"
    apps bench bindings examples fuzz gpu include src tests web/wasm
  WORKING_DIRECTORY ${SOURCE} OUTPUT_VARIABLE lines RESULT_VARIABLE result)
if(NOT result EQUAL 1)  # grep found nothing
  message(FATAL_ERROR "Lines that are too long, or grep failed:\n${lines}")
endif()
