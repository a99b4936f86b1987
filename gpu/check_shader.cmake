# Checks that a shader's floating-point operations have the same bits on every device: no addition, subtraction or
# multiplication may be contracted, and what Vulkan does not round correctly is not used. Given: MODULE, a SPIR-V file,
# and SPIRV_DIS, the disassembler.
cmake_minimum_required(VERSION 3.25)
execute_process(COMMAND ${SPIRV_DIS} --raw-id --no-color ${MODULE} OUTPUT_VARIABLE text COMMAND_ERROR_IS_FATAL ANY)

string(REGEX MATCHALL "OpFDiv|OpFRem|OpFMod|OpDot|OpOuterProduct|Op(Vector|Matrix)Times[A-Za-z]+" forbidden "${text}")
# Of the other functions of GLSL, only those that choose or count are exact.
string(REGEX MATCHALL "OpExtInst %[0-9]+ %[0-9]+ [A-Za-z0-9]+" functions "${text}")
list(TRANSFORM functions REPLACE ".* " "")
list(FILTER functions EXCLUDE REGEX "^([FSU](Abs|Min|Max|Clamp)|Find[ISU][LM]sb)$")
list(APPEND forbidden ${functions})
if(forbidden)
  list(REMOVE_DUPLICATES forbidden)
  message(FATAL_ERROR "${MODULE} uses operations that devices round in different ways: ${forbidden}")
endif()

string(REGEX MATCHALL "%[0-9]+ = OpF(Add|Sub|Mul) " operations "${text}")
foreach(operation IN LISTS operations)
  string(REGEX MATCH "%[0-9]+" id "${operation}")
  if(NOT text MATCHES "OpDecorate ${id} NoContraction")
    message(FATAL_ERROR "${MODULE}: ${operation} may be contracted; its result must be 'precise'")
  endif()
endforeach()
