# A folder is a target, a namespace and a layer. Ranks are those of ARCHITECTURE.md: a layer may use only
# layers of lower rank that it names. An arrow against the flow is an error at configure time.
#
#   ftcs_layer(servo RANK 2 REALTIME SOURCES ... HEADERS ... DEPENDS time measurement LIBRARIES fmt::fmt TESTS a_test.cpp)
#
# REALTIME: built without exceptions and RTTI, with a limit on each stack frame; a test looks for symbols of an allocator,
# an exception or a lock in the archive.
# TESTS: GoogleTest files beside the sources; each file becomes one program named <layer>_<file>.
function(ftcs_layer name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "REALTIME" "RANK" "SOURCES;HEADERS;DEPENDS;LIBRARIES;TESTS")
  if(arg_SOURCES)
    add_library(ftcs_${name} STATIC ${arg_SOURCES})
    set(scope PUBLIC)
    target_link_libraries(ftcs_${name} PRIVATE $<BUILD_INTERFACE:ftcs_warnings>)
    if(arg_REALTIME)
      target_link_libraries(ftcs_${name} PRIVATE $<BUILD_INTERFACE:ftcs_realtime>)
      if(FTCS_BUILD_TESTS AND NOT FTCS_SANITIZE)
        add_test(NAME realtime_symbols_${name}
          COMMAND ${PROJECT_SOURCE_DIR}/tools/check-realtime-symbols $<TARGET_FILE:ftcs_${name}>)
        set_tests_properties(realtime_symbols_${name} PROPERTIES LABELS unit TIMEOUT 30)
      endif()
      ftcs_use_precompiled(ftcs_${name} realtime)
    else()
      ftcs_use_precompiled(ftcs_${name} hosted)
    endif()
  else()
    add_library(ftcs_${name} INTERFACE)
    set(scope INTERFACE)
  endif()
  add_library(ftcs::${name} ALIAS ftcs_${name})
  target_sources(ftcs_${name} ${scope}
    FILE_SET HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR} FILES ${arg_HEADERS})
  target_compile_features(ftcs_${name} ${scope} cxx_std_20)
  set_target_properties(ftcs_${name} PROPERTIES
    FTCS_RANK ${arg_RANK} VERIFY_INTERFACE_HEADER_SETS ON)
  set_property(GLOBAL APPEND PROPERTY FTCS_LAYERS ${name})
  foreach(dependency IN LISTS arg_DEPENDS)
    if(NOT TARGET ftcs_${dependency})
      message(FATAL_ERROR "${name} names the layer ${dependency}, which does not exist below it")
    endif()
    get_target_property(rank ftcs_${dependency} FTCS_RANK)
    if(NOT rank LESS arg_RANK)
      message(FATAL_ERROR
        "${name} (rank ${arg_RANK}) must not depend on ${dependency} (rank ${rank})")
    endif()
    target_link_libraries(ftcs_${name} ${scope} ftcs::${dependency})
  endforeach()
  target_link_libraries(ftcs_${name} ${scope} ${arg_LIBRARIES})
  foreach(test IN LISTS arg_TESTS)
    ftcs_test(${test} DEPENDS ${name})
  endforeach()
endfunction()

# One GoogleTest program per file; labels: unit (default), scenario, live, slow. `make test` leaves slow ones out.
function(ftcs_test file)
  if(NOT FTCS_BUILD_TESTS)
    return()
  endif()
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "LABEL;TIMEOUT" "DEPENDS;LIBRARIES")
  get_filename_component(stem ${file} NAME_WE)
  get_filename_component(folder ${CMAKE_CURRENT_SOURCE_DIR} NAME)
  set(target ${folder}_${stem})
  add_executable(${target} ${file})
  list(TRANSFORM arg_DEPENDS PREPEND ftcs::)
  target_link_libraries(${target} PRIVATE ${arg_DEPENDS} ${arg_LIBRARIES} ftcs_test_support ftcs_warnings
    GTest::gtest_main)
  ftcs_use_precompiled(${target} test)
  # What is tested is optimised in full, in its layer: a test is compiled once for each time that it runs.
  target_compile_options(${target} PRIVATE $<$<CONFIG:RelWithDebInfo>:-O1>)
  if(NOT arg_LABEL)
    set(arg_LABEL unit)
  endif()
  if(NOT arg_TIMEOUT)
    set(arg_TIMEOUT 120)
  endif()
  add_test(NAME ${target} COMMAND ${target})
  set_tests_properties(${target} PROPERTIES LABELS ${arg_LABEL} TIMEOUT ${arg_TIMEOUT}
    WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
endfunction()
