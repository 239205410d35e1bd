# cmake --install: the program, and the cycle servo for programs in C, found by find_package(ftcs) or pkg-config.
if(TARGET ftcs)
  install(TARGETS ftcs RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()
install(TARGETS ftcs_cycle_servo ftcs_cycle_servo_small EXPORT ftcs
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
# The include path is the file path, installed or not.
install(FILES ftcs/discipline/ftcs_cycle_servo.h
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/ftcs/discipline)
install(EXPORT ftcs NAMESPACE ftcs:: FILE ftcs-config.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/ftcs)

file(RELATIVE_PATH FTCS_PC_TO_PREFIX
  ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig ${CMAKE_INSTALL_PREFIX})
function(ftcs_pkg_config name libraries cflags)
  configure_file(cmake/cycle-servo.pc.in ${name}.pc @ONLY)
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/${name}.pc
    DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
endfunction()
ftcs_pkg_config(ftcs_cycle_servo "-lftcs_cycle_servo -lm" "")
ftcs_pkg_config(ftcs_cycle_servo_small "-lftcs_cycle_servo_small" " -DFTCS_CYCLE_WITHOUT_ADAPTIVE")
