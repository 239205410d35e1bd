# cmake --install: the program; the layers without I/O for programs in C++; the cycle servo for programs in C. Found by
# find_package(ftcs) and by pkg-config.
include(CMakePackageConfigHelpers)
if(TARGET ftcs)
  install(TARGETS ftcs RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
  install(DIRECTORY ${PROJECT_BINARY_DIR}/manual/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 FILES_MATCHING PATTERN "*.1")
  install(FILES ${PROJECT_BINARY_DIR}/manual/completion.bash RENAME ftcs OPTIONAL
    DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
  install(FILES ${PROJECT_BINARY_DIR}/manual/completion.zsh RENAME _ftcs OPTIONAL
    DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions)
endif()
set(FTCS_PACKAGE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/ftcs)

# What is simulated is what ships, up to the nodes: no system call below them. Lowest rank first.
set(installed_layers time clock measurement analysis estimation servo discipline ptp ethercat node)
set(ftcs_libraries "")
foreach(layer IN LISTS installed_layers)
  if(NOT TARGET ftcs_${layer})
    continue()
  endif()
  set_target_properties(ftcs_${layer} PROPERTIES EXPORT_NAME ${layer})
  install(TARGETS ftcs_${layer} EXPORT ftcs
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
    FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
  get_target_property(kind ftcs_${layer} TYPE)
  if(kind STREQUAL STATIC_LIBRARY)
    string(PREPEND ftcs_libraries "-lftcs_${layer} ")  # a linker reads from users to used
  endif()
endforeach()

install(TARGETS ftcs_cycle_servo ftcs_cycle_servo_small EXPORT ftcs
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
# The include path is the file path, installed or not.
install(FILES ftcs/discipline/ftcs_cycle_servo.h ftcs/discipline/ftcs_bus_clock.h
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/ftcs/discipline)
install(EXPORT ftcs NAMESPACE ftcs:: FILE ftcs-config.cmake DESTINATION ${FTCS_PACKAGE_DIR})
# Before 1.0 a minor version may break what stood before.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/ftcs-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/ftcs-config-version.cmake DESTINATION ${FTCS_PACKAGE_DIR})

file(RELATIVE_PATH FTCS_PC_TO_PREFIX
  ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig ${CMAKE_INSTALL_PREFIX})
function(ftcs_pkg_config name description libraries cflags)
  configure_file(cmake/ftcs.pc.in ${name}.pc @ONLY)
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/${name}.pc
    DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
endfunction()
set(cycle_servo "keeps a cyclic task in phase with a reference clock (EtherCAT distributed clocks)")
ftcs_pkg_config(ftcs_cycle_servo "${cycle_servo}" "-lftcs_cycle_servo -lm" "")
ftcs_pkg_config(ftcs_cycle_servo_small "${cycle_servo}" "-lftcs_cycle_servo_small" " -DFTCS_CYCLE_WITHOUT_ADAPTIVE")
ftcs_pkg_config(ftcs "clocks that follow other clocks, in C++20: servos, PTP and EtherCAT without I/O"
  "${ftcs_libraries}-lm" " -ffp-contract=off")
