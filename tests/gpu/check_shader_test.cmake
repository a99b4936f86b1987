# The build's checks of shaders find what they are for. Given: GLSLC, SPIRV_VAL, SPIRV_DIS and SPIRV_AS, the tools; GPU, the
# folder of check_shader.cmake and of the shaders; and WORK, a folder.
cmake_minimum_required(VERSION 3.25)
file(MAKE_DIRECTORY ${WORK})
set(module ${WORK}/shader.spv)

# Compiles a shader that computes `c` from `a` and `b`.
function(compile statement)
  file(WRITE ${WORK}/shader.comp "#version 460
layout(local_size_x = 64) in;
layout(std430, binding = 0) buffer Numbers { float at[]; };
void main() {
    float a = at[0], b = at[1];
    ${statement}
    at[2] = c;
}
")
  execute_process(COMMAND ${GLSLC} --target-env=vulkan1.2 -o ${module} ${WORK}/shader.comp COMMAND_ERROR_IS_FATAL ANY)
endfunction()

# Checks the module, which is expected to pass, or to be refused for a reason.
function(check_module name expected)
  execute_process(COMMAND ${CMAKE_COMMAND} -D MODULE=${module} -D SPIRV_DIS=${SPIRV_DIS} -P ${GPU}/check_shader.cmake
    RESULT_VARIABLE failed ERROR_VARIABLE message)
  string(REGEX REPLACE "[ \n]+" " " message "${message}")  # CMake breaks its lines
  if(expected STREQUAL "passes")
    if(failed)
      message(SEND_ERROR "${name} was refused: ${message}")
    endif()
  elseif(NOT failed OR NOT message MATCHES "${expected}")
    message(SEND_ERROR "${name} was not refused because of ${expected}: ${message}")
  endif()
endfunction()

function(check statement expected)
  compile("${statement}")
  check_module("'${statement}'" "${expected}")
endfunction()

check("precise float c = a + b;" passes)
check("precise float d = a * b; precise float c = d - b;" passes)
check("float c = abs(min(a, b));" passes)
check("float c = a + b;" "may be contracted")
check("float c = a - b;" "may be contracted")
check("float c = a * b;" "may be contracted")
check("precise float c = a / b;" OpFDiv)
check("precise float c = mod(a, b);" "OpFMod|OpFDiv")
check("precise float c = fma(a, b, a);" Fma)
check("precise float c = sqrt(a);" Sqrt)
check("precise float c = inversesqrt(a);" InverseSqrt)
check("precise float c = normalize(vec2(a, b)).x;" Normalize)
check("precise float c = dot(vec2(a, b), vec2(b, a));" OpDot)
check("precise float c = exp(a);" Exp)
check("precise float c = pow(a, b);" Pow)
check("precise float c = mix(a, b, a);" FMix)
check("precise float c = (a * vec2(a, b)).x;" OpVectorTimesScalar)
check("precise float c = sin(a);" Sin)

# The reason why the shaders are compiled without -O.
execute_process(COMMAND ${GLSLC} -O --target-env=vulkan1.2 -o ${module} ${GPU}/shaders/points.comp
  COMMAND_ERROR_IS_FATAL ANY)
check_module("points.comp with -O" Fma)

# spirv-val refuses a module that is not valid.
compile("precise float c = a + b;")
execute_process(COMMAND ${SPIRV_DIS} ${module} OUTPUT_VARIABLE text COMMAND_ERROR_IS_FATAL ANY)
string(REPLACE "OpCapability Shader" "OpCapability Kernel" text "${text}")
file(WRITE ${WORK}/shader.spvasm "${text}")
execute_process(COMMAND ${SPIRV_AS} --target-env vulkan1.2 -o ${module} ${WORK}/shader.spvasm COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${SPIRV_VAL} --target-env vulkan1.2 ${module} RESULT_VARIABLE failed OUTPUT_QUIET ERROR_QUIET)
if(NOT failed)
  message(SEND_ERROR "spirv-val accepted a module without the capability Shader")
endif()
