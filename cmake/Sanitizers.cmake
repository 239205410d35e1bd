# FTCS_SANITIZE is a -fsanitize= list, e.g. "address,undefined" or "thread".
set(FTCS_SANITIZE "" CACHE STRING "Sanitizers for the whole build, as in -fsanitize=")
if(FTCS_SANITIZE)
  # vptr: it needs run-time type information, which real-time layers do without.
  add_compile_options(-fsanitize=${FTCS_SANITIZE} -fno-sanitize=vptr -fno-sanitize-recover=all
    -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${FTCS_SANITIZE})
endif()
