# What cmake --install puts where. Nothing of it names the prefix: the folder may be moved.
include(CMakePackageConfigHelpers)

# Private headers of PETSc are used: the plugin fits one minor version.
string(REGEX MATCH "^([0-9]+)\\.([0-9]+)" _ "${PETSC_VERSION}")
math(EXPR PETSC_NEXT_MINOR_VERSION "${CMAKE_MATCH_2} + 1")
string(PREPEND PETSC_NEXT_MINOR_VERSION "${CMAKE_MATCH_1}.")
file(RELATIVE_PATH PC_TO_PREFIX "${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig" "${CMAKE_INSTALL_PREFIX}")
string(REGEX REPLACE "/$" "" PC_TO_PREFIX "${PC_TO_PREFIX}")
# A PETSc outside the system's folders is found by its path.
set(PETSC_RPATH)
foreach(folder IN LISTS PETSC_LIBRARY_DIRS)
  string(APPEND PETSC_RPATH " -Wl,-rpath,${folder}")
endforeach()
set(AINSWORTH_PYTHON_DIR "${CMAKE_INSTALL_LIBDIR}/ainsworth" CACHE STRING
  "Where ainsworth.py is installed, below the prefix")
configure_file(makefiles/ainsworth.pc.in ainsworth.pc @ONLY)

set(AINSWORTH_NEEDS_MPI OFF)
if(TARGET MPI::MPI_C)
  set(AINSWORTH_NEEDS_MPI ON)
endif()
set(config "${CMAKE_INSTALL_LIBDIR}/cmake/ainsworth")
set(data "${CMAKE_INSTALL_DATADIR}/ainsworth")
configure_package_config_file(makefiles/ainsworth-config.cmake.in ainsworth-config.cmake INSTALL_DESTINATION "${config}"
  PATH_VARS CMAKE_INSTALL_LIBDIR AINSWORTH_PYTHON_DIR NO_CHECK_REQUIRED_COMPONENTS_MACRO)
write_basic_package_version_file(ainsworth-config-version.cmake COMPATIBILITY SameMinorVersion)

set_target_properties(ainsworth_petsc PROPERTIES EXPORT_NAME petsc)
install(TARGETS ainsworth ainsworth_petsc EXPORT ainsworth LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}")
install(EXPORT ainsworth NAMESPACE ainsworth:: FILE ainsworth-targets.cmake DESTINATION "${config}")
install(FILES "${PROJECT_BINARY_DIR}/ainsworth-config.cmake" "${PROJECT_BINARY_DIR}/ainsworth-config-version.cmake"
  DESTINATION "${config}")
install(FILES "${PROJECT_BINARY_DIR}/ainsworth.pc" DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig")
# The name that PETSc looks for in its own folder
file(CREATE_LINK libainsworth.so "${PROJECT_BINARY_DIR}/libpetscainsworth.so" SYMBOLIC)
install(FILES "${PROJECT_BINARY_DIR}/libpetscainsworth.so" DESTINATION "${CMAKE_INSTALL_LIBDIR}")
install(FILES include/petscainsworth.h DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")
if(TARGET ainsworthslepc)
  install(TARGETS ainsworthslepc LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}")
  install(FILES include/slepcainsworth.h DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")
endif()
install(FILES include/ainsworth.py DESTINATION "${AINSWORTH_PYTHON_DIR}")
set(tutorials tutorials/ex1.c tutorials/ex1.py tutorials/dynamics.py tutorials/loads.py tutorials/monitor.py
  tutorials/modes.c tutorials/modes.py tutorials/part.py)
install(FILES ${tutorials} DESTINATION "${data}/tutorials")
install(DIRECTORY tests/bench/solvers/ DESTINATION "${data}/options" FILES_MATCHING PATTERN "*.opts")
install(FILES README.md LICENSE CITATION.cff CHANGELOG.md DESTINATION "${CMAKE_INSTALL_DOCDIR}")
install(DIRECTORY docs DESTINATION "${CMAKE_INSTALL_DOCDIR}" FILES_MATCHING PATTERN "*.md" PATTERN "*.svg"
  PATTERN "*.png" PATTERN "*.csv" PATTERN study EXCLUDE)
# What these pages have links to
install(FILES ${tutorials} DESTINATION "${CMAKE_INSTALL_DOCDIR}/tutorials")
install(DIRECTORY tests/bench/solvers DESTINATION "${CMAKE_INSTALL_DOCDIR}/tests/bench" FILES_MATCHING PATTERN "*.opts")

# The comparison of solvers on the user's own files, in folders like those of the sources, where it looks for its parts
set(tools "${CMAKE_INSTALL_LIBEXECDIR}/ainsworth")
install(FILES docs/study/errortime.py DESTINATION "${tools}/docs/study")
foreach(module __init__ errors errorspage machine measured plots prose)
  install(FILES "docs/study/common/${module}.py" DESTINATION "${tools}/docs/study/common")
endforeach()
install(FILES tests/bench/market.py DESTINATION "${tools}/tests/bench")
install(DIRECTORY tests/bench/solvers DESTINATION "${tools}/tests/bench" FILES_MATCHING PATTERN "*.opts")
install(TARGETS errortime RUNTIME DESTINATION "${tools}/build/bench")
file(RELATIVE_PATH from_tools "/${tools}/build" "/${CMAKE_INSTALL_LIBDIR}/libainsworth.so")
file(MAKE_DIRECTORY "${PROJECT_BINARY_DIR}/installed")
file(CREATE_LINK "${from_tools}" "${PROJECT_BINARY_DIR}/installed/libainsworth.so" SYMBOLIC)
install(FILES "${PROJECT_BINARY_DIR}/installed/libainsworth.so" DESTINATION "${tools}/build")

add_custom_target(uninstall COMMAND "${CMAKE_COMMAND}" -P "${PROJECT_SOURCE_DIR}/makefiles/uninstall.cmake"
  WORKING_DIRECTORY "${PROJECT_BINARY_DIR}")
