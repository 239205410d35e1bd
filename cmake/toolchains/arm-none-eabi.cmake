# Cortex-M with Debian's gcc-arm-none-eabi, newlib and libstdc++:
#
#   cmake -B build-m4f --toolchain cmake/toolchains/arm-none-eabi.cmake -DFTCS_CPU=m4f -DFTCS_CORE_ONLY=ON
#
# FTCS_CPU: m0plus (no floating point unit), m4f (single precision) or m7 (double precision).
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR arm)
set(CMAKE_C_COMPILER arm-none-eabi-gcc)
set(CMAKE_CXX_COMPILER arm-none-eabi-g++)
# A program needs a start-up file and a linker script of the board: that a library can be made is all that is asked.
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES FTCS_CPU)

set(FTCS_CPU m4f CACHE STRING "Cortex-M: m0plus, m4f or m7")
if(FTCS_CPU STREQUAL m0plus)
  set(ftcs_cpu_flags "-mcpu=cortex-m0plus -mfloat-abi=soft")
elseif(FTCS_CPU STREQUAL m4f)
  set(ftcs_cpu_flags "-mcpu=cortex-m4 -mfpu=fpv4-sp-d16 -mfloat-abi=hard")
elseif(FTCS_CPU STREQUAL m7)
  set(ftcs_cpu_flags "-mcpu=cortex-m7 -mfpu=fpv5-d16 -mfloat-abi=hard")
else()
  message(FATAL_ERROR "FTCS_CPU is '${FTCS_CPU}', expected m0plus, m4f or m7")
endif()
set(CMAKE_C_FLAGS_INIT "${ftcs_cpu_flags} -mthumb -ffunction-sections -fdata-sections")
set(CMAKE_CXX_FLAGS_INIT "${CMAKE_C_FLAGS_INIT} -fno-exceptions -fno-rtti -fno-threadsafe-statics")
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
