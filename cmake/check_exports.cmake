# Checks that a shared library exports no internal symbol. Given: NM and LIBRARY.
execute_process(COMMAND ${NM} --dynamic --defined-only --demangle ${LIBRARY} OUTPUT_VARIABLE symbols
  COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "[^\n]*marrow::internal[^\n]*" internal "${symbols}")
if(internal)
  list(JOIN internal "\n" text)
  message(FATAL_ERROR "Internal symbols are exported by ${LIBRARY}:\n${text}")
endif()
if(NOT symbols MATCHES "marrow::")
  message(FATAL_ERROR "${LIBRARY} exports nothing of Marrow")
endif()
