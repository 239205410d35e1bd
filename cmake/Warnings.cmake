# One interface target carries every warning and the floating-point rules of the whole project.
add_library(ftcs_warnings INTERFACE)
target_compile_options(ftcs_warnings INTERFACE
  -Wall -Wextra -Wpedantic -Wconversion -Wsign-conversion -Wshadow -Wdouble-promotion
  -Wold-style-cast -Wnon-virtual-dtor -Woverloaded-virtual -Wimplicit-fallthrough)
if(FTCS_WARNINGS_AS_ERRORS)
  target_compile_options(ftcs_warnings INTERFACE -Werror)
endif()

# g++ looks through its memory for what can be freed each time that it has grown by a third: a tenth of the build, where
# no file needs more than this many kilobytes before it is done.
add_compile_options($<$<COMPILE_LANG_AND_ID:CXX,GNU>:--param=ggc-min-heapsize=524288>)

# The same seed must give the same bytes on gcc and clang: no contraction to fused multiply-add.
add_compile_options(-ffp-contract=off)

# Real-time layers: no exceptions, no run-time type information, a bound on every stack frame.
add_library(ftcs_realtime INTERFACE)
target_compile_options(ftcs_realtime INTERFACE -fno-exceptions -fno-rtti)
if(NOT FTCS_SANITIZE)
  target_compile_options(ftcs_realtime INTERFACE -Wframe-larger-than=4096)
endif()
