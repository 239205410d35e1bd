# The standard library's headers (and GoogleTest's, fmt's) are parsed once per build instead of once per file
# (decision 0016). Each file still names what it includes: the presets clang and tidy build without.
option(FTCS_PRECOMPILED_HEADERS "Parse the headers of other projects once for all files" ON)

# A compiler takes a precompiled header only for the flags that it was made with: one for each set of flags.
#   ftcs_precompiled(NAME LIBRARIES what brings the flags HEADERS what is parsed)
function(ftcs_precompiled name)
  if(NOT FTCS_PRECOMPILED_HEADERS)
    return()
  endif()
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "LIBRARIES;HEADERS")
  set(source ${CMAKE_BINARY_DIR}/precompiled/${name}.cpp)
  file(CONFIGURE OUTPUT ${source} CONTENT "")
  add_library(ftcs_precompiled_${name} OBJECT EXCLUDE_FROM_ALL ${source})
  target_link_libraries(ftcs_precompiled_${name} PRIVATE ftcs_warnings ${arg_LIBRARIES})
  target_precompile_headers(ftcs_precompiled_${name} PRIVATE ${arg_HEADERS})
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    # ccache sees in the preprocessed text which header was taken.
    target_compile_options(ftcs_precompiled_${name} PUBLIC -fpch-preprocess)
  endif()
endfunction()

# Does nothing where there is no such precompiled header.
function(ftcs_use_precompiled target name)
  if(TARGET ftcs_precompiled_${name})
    target_precompile_headers(${target} REUSE_FROM ftcs_precompiled_${name})
    if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
      target_compile_options(${target} PRIVATE -fpch-preprocess)
      if(NOT name STREQUAL realtime)
        # g++ 12 warns of its own std::string (GCC bug 105651) where it does not see that the header is the system's.
        target_compile_options(${target} PRIVATE -Wno-array-bounds -Wno-restrict -Wno-stringop-overread
          -Wno-stringop-overflow)
      endif()
    endif()
  endif()
endfunction()

set(ftcs_core_headers <algorithm> <array> <chrono> <cmath> <cstddef> <cstdint> <limits> <optional> <span>
  <string_view> <utility> <variant>)
set(ftcs_hosted_headers ${ftcs_core_headers} <filesystem> <fstream> <functional> <memory> <random> <sstream>
  <string> <vector>)
ftcs_precompiled(realtime LIBRARIES ftcs_realtime HEADERS ${ftcs_core_headers})
ftcs_precompiled(hosted HEADERS ${ftcs_hosted_headers})

# These files of a target are compiled as one: where each would generate the code of the same heavy templates again
# (CLI11, nlohmann::json). Names that they keep to themselves must differ, which the compiler says.
function(ftcs_compile_together target group)
  if(FTCS_PRECOMPILED_HEADERS)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
    set_source_files_properties(${ARGN} PROPERTIES UNITY_GROUP ${group})
  endif()
endfunction()
