# The cycle servo for programs in C: static libraries that hold all they need but memcpy, memset, memmove and libm. Their sources
# are compiled once more, so that no other archive has to be linked.
set(ftcs_cycle_sources ftcs_cycle_servo.cpp
  ${PROJECT_SOURCE_DIR}/ftcs/clock/cycle_timer.cpp
  ${PROJECT_SOURCE_DIR}/ftcs/measurement/outlier_gate.cpp
  ${PROJECT_SOURCE_DIR}/ftcs/servo/ftcs_servo.cpp
  ${PROJECT_SOURCE_DIR}/ftcs/servo/pics_servo.cpp)
function(ftcs_cycle_library name)
  add_library(${name} STATIC ${ftcs_cycle_sources} ${ARGN})
  add_library(ftcs::${name} ALIAS ${name})
  target_include_directories(${name} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_link_libraries(${name} PRIVATE $<BUILD_INTERFACE:ftcs_warnings> $<BUILD_INTERFACE:ftcs_realtime>)
  # LinuxCNC's drivers are shared objects. A microcontroller's image has no table of offsets to fill in.
  if(NOT FTCS_CORE_ONLY)
    set_target_properties(${name} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  endif()
  # A sanitizer's run-time library is what a C program would have to do without.
  target_compile_options(${name} PRIVATE -fno-threadsafe-statics -fno-sanitize=all)
endfunction()

ftcs_cycle_library(ftcs_cycle_servo_small)
target_compile_definitions(ftcs_cycle_servo_small PUBLIC FTCS_CYCLE_WITHOUT_ADAPTIVE)
get_target_property(ftcs_servo_sources ftcs_servo SOURCES)
list(FILTER ftcs_servo_sources INCLUDE REGEX "^adaptive/.*\\.cpp$")
list(TRANSFORM ftcs_servo_sources PREPEND ${PROJECT_SOURCE_DIR}/ftcs/servo/)
get_target_property(ftcs_estimation_sources ftcs_estimation SOURCES)
list(TRANSFORM ftcs_estimation_sources PREPEND ${PROJECT_SOURCE_DIR}/ftcs/estimation/)
ftcs_cycle_library(ftcs_cycle_servo bus_clock.cpp cycle_servo.cpp ftcs_bus_clock.cpp
  ${ftcs_servo_sources} ${ftcs_estimation_sources})
target_link_libraries(ftcs_cycle_servo PUBLIC m)

if(FTCS_BUILD_TESTS)
  foreach(library ftcs_cycle_servo ftcs_cycle_servo_small)
    add_executable(${library}_consumer ftcs_cycle_servo_consumer.c)
    set_target_properties(${library}_consumer PROPERTIES C_STANDARD 99 C_STANDARD_REQUIRED ON
      C_EXTENSIONS OFF LINKER_LANGUAGE C)
    target_compile_options(${library}_consumer PRIVATE -Wall -Wextra -Wpedantic -Werror
      -fno-sanitize=all)
    target_link_libraries(${library}_consumer PRIVATE ${library})
    add_test(NAME ${library}_c99 COMMAND ${library}_consumer)
    add_test(NAME ${library}_symbols
      COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/check_cycle_servo_symbols.sh $<TARGET_FILE:${library}>)
    set_tests_properties(${library}_c99 ${library}_symbols PROPERTIES LABELS unit TIMEOUT 30)
  endforeach()
  add_executable(ftcs_bus_clock_consumer ftcs_bus_clock_consumer.c)
  set_target_properties(ftcs_bus_clock_consumer PROPERTIES C_STANDARD 99 C_STANDARD_REQUIRED ON C_EXTENSIONS OFF
    LINKER_LANGUAGE C)
  target_compile_options(ftcs_bus_clock_consumer PRIVATE -Wall -Wextra -Wpedantic -Werror -fno-sanitize=all)
  target_link_libraries(ftcs_bus_clock_consumer PRIVATE ftcs_cycle_servo)
  add_test(NAME ftcs_bus_clock_c99 COMMAND ftcs_bus_clock_consumer)
  set_tests_properties(ftcs_bus_clock_c99 PROPERTIES LABELS unit TIMEOUT 30)
endif()
