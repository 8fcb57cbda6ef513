# Two functions that add tests: ainsworth_test for a program of tests/, ainsworth_program_test for anything that runs.
# Common arguments:
#   RANKS 1 2 3 4     one CTest test per number, named <name>_np<number>; 0: not through mpiexec
#   ARGS ...          arguments of the program
#   PASS_REGEX ...    extended regular expressions that must occur in the output
#   FAIL_REGEX ...    and such that must not
#   FAILS             the program must end with an error
#   ENVIRONMENT ...   further variables, as NAME=value
#   TIMEOUT s         seconds, 120 by default
#   LABELS ...        CTest labels
#   LEAKS             a sanitizer does not look for leaks: what an error leaves behind is not freed
#   SKIPS             the test is skipped where the program ends with 77
#   NO_DEBUG          without -malloc_debug on one rank
#   PLAIN             without any of what follows
# Leaks, unused options and arrays that are written past their end fail a test (-malloc_dump -options_left), unless it
# FAILS.
# One rank also has -malloc_debug, which walks through all of the heap at every allocation: what has many takes twenty
# times as long, and several ranks wait for each other meanwhile. glibc fills new memory, so that what is read before it
# is set is a number of 1e306.

execute_process(COMMAND "${MPIEXEC_EXECUTABLE}" --version OUTPUT_VARIABLE AINSWORTH_MPI_VERSION
  ERROR_VARIABLE AINSWORTH_MPI_VERSION)
set(AINSWORTH_LAUNCHER "${MPIEXEC_EXECUTABLE}")
if(AINSWORTH_MPI_VERSION MATCHES "Open MPI|OpenRTE|open-mpi")
  list(APPEND AINSWORTH_LAUNCHER --oversubscribe --allow-run-as-root)
endif()
set(AINSWORTH_PLUGIN "${PROJECT_BINARY_DIR}/libainsworth.so")

# Open MPI on one machine: as root, more ranks than cores, no pinning, no look for networks (a second per start), no
# reading of other processes' memory.
# The names of version 4 and, where they differ, of version 5; other MPIs ignore them all.
set(AINSWORTH_ENVIRONMENT
  OMP_NUM_THREADS=1 MALLOC_PERTURB_=128
  OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
  OMPI_MCA_rmaps_base_oversubscribe=1 PRTE_MCA_rmaps_default_mapping_policy=:oversubscribe
  OMPI_MCA_hwloc_base_binding_policy=none PRTE_MCA_hwloc_default_binding_policy=none
  OMPI_MCA_mpi_yield_when_idle=1
  OMPI_MCA_pml=ob1 OMPI_MCA_btl=self,vader
  OMPI_MCA_btl_vader_single_copy_mechanism=none OMPI_MCA_smsc=^cma)
if(AINSWORTH_SANITIZE)
  # The plugin is also loaded by programs without the sanitizer's run time.
  set(AINSWORTH_ASAN_OPTIONS ASAN_OPTIONS=verify_asan_link_order=0:detect_leaks)
  list(APPEND AINSWORTH_ENVIRONMENT ${AINSWORTH_ASAN_OPTIONS}=1 UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1
    LSAN_OPTIONS=print_suppressions=0:suppressions=${PROJECT_SOURCE_DIR}/tests/leaks.supp)
endif()

# What PETSc has, in its own words: PETSC_HAVE_HYPRE, PETSC_HAVE_MUMPS
find_file(petscconf petscconf.h PATHS ${PETSC_INCLUDE_DIRS} NO_DEFAULT_PATH NO_CACHE REQUIRED)
file(STRINGS "${petscconf}" petscconf REGEX "^#define PETSC_HAVE_(HYPRE|MUMPS) ")
foreach(package HYPRE MUMPS)
  string(REGEX MATCH "PETSC_HAVE_${package} " PETSC_HAVE_${package} "${petscconf}")
endforeach()

set(AINSWORTH_TEST_OPTIONS FAILS LEAKS PLAIN NO_DEBUG LOAD INTERNAL SKIPS)
set(AINSWORTH_TEST_SINGLE SOURCE TIMEOUT)
set(AINSWORTH_TEST_MULTIPLE RANKS ARGS PASS_REGEX FAIL_REGEX ENVIRONMENT LABELS COMMAND)

# ainsworth_program_test(name COMMAND <target or program> [arguments] [LOAD] ...): LOAD adds -dll_append <the plugin>
function(ainsworth_program_test name)
  cmake_parse_arguments(T "${AINSWORTH_TEST_OPTIONS}" "${AINSWORTH_TEST_SINGLE}" "${AINSWORTH_TEST_MULTIPLE}" ${ARGN})
  if(T_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "test ${name}: what is ${T_UNPARSED_ARGUMENTS}?")
  endif()
  list(GET T_COMMAND 0 program)
  if(TARGET "${program}")
    list(REMOVE_AT T_COMMAND 0)
    list(PREPEND T_COMMAND "$<TARGET_FILE:${program}>")
  endif()
  if("${T_TIMEOUT}" STREQUAL "")
    set(T_TIMEOUT 120)
  endif()
  set(judge)
  foreach(regex IN LISTS T_PASS_REGEX)
    list(APPEND judge --pass "${regex}")
  endforeach()
  foreach(regex IN LISTS T_FAIL_REGEX)
    list(APPEND judge --fail "${regex}")
  endforeach()
  if(T_FAILS)
    list(APPEND judge --fails)
  elseif(NOT T_PLAIN)
    list(APPEND judge --strict)
  endif()
  if(T_SKIPS)
    list(APPEND judge --skips)
  endif()
  if(NOT T_PLAIN)
    list(APPEND T_ARGS -malloc_dump -options_left)
  endif()
  if(AINSWORTH_SANITIZE AND (T_LEAKS OR T_FAILS))
    list(APPEND T_ENVIRONMENT ${AINSWORTH_ASAN_OPTIONS}=0)
  endif()
  if(T_LOAD)
    list(PREPEND T_ARGS -dll_append "${AINSWORTH_PLUGIN}")
  endif()
  foreach(ranks IN LISTS T_RANKS)
    set(launcher)
    set(processors 1)
    set(debug)
    if(ranks LESS 2 AND NOT T_PLAIN AND NOT T_NO_DEBUG)
      set(debug -malloc_debug)
    endif()
    if(ranks GREATER 0)
      set(launcher ${AINSWORTH_LAUNCHER} ${MPIEXEC_NUMPROC_FLAG} ${ranks})
      set(processors ${ranks})
    endif()
    # A folder of its own for each test: some programs write files where they run.
    set(folder "${CMAKE_CURRENT_BINARY_DIR}/run/${name}_np${ranks}")
    file(MAKE_DIRECTORY "${folder}")
    add_test(NAME "${name}_np${ranks}" WORKING_DIRECTORY "${folder}"
      COMMAND sh "${PROJECT_SOURCE_DIR}/tests/run.sh" ${judge} -- ${launcher} ${T_COMMAND} ${T_ARGS} ${debug})
    set_tests_properties("${name}_np${ranks}" PROPERTIES
      TIMEOUT "${T_TIMEOUT}" PROCESSORS ${processors} LABELS "${T_LABELS}"
      ENVIRONMENT "${AINSWORTH_ENVIRONMENT};${T_ENVIRONMENT}")
    if(T_SKIPS)
      set_tests_properties("${name}_np${ranks}" PROPERTIES SKIP_RETURN_CODE 77)
    endif()
  endforeach()
endfunction()

# ainsworth_test(name SOURCE file.cpp ...): the program is linked to the plugin; INTERNAL: to its objects, with src/
# among the include folders. Several tests may share a source.
function(ainsworth_test name)
  cmake_parse_arguments(T "${AINSWORTH_TEST_OPTIONS}" "${AINSWORTH_TEST_SINGLE}" "${AINSWORTH_TEST_MULTIPLE}" ${ARGN})
  get_filename_component(program "${T_SOURCE}" NAME_WE)
  set(program "test_${program}")
  if(NOT TARGET ${program})
    add_executable(${program} "${T_SOURCE}")
    if(T_INTERNAL)
      target_link_libraries(${program} PRIVATE ainsworth_objects)
      # The objects call the LAPACK that PETSc brings with it, whichever that is.
      target_link_options(${program} PRIVATE LINKER:--copy-dt-needed-entries)
      target_include_directories(${program} PRIVATE "${PROJECT_SOURCE_DIR}/src")
    else()
      target_link_libraries(${program} PRIVATE ainsworth)
    endif()
  endif()
  set(arguments ${ARGN})
  ainsworth_program_test(${name} ${arguments} COMMAND ${program})
endfunction()

# Says why a test is left out, or stops where none may be.
function(ainsworth_leave_out what why)
  if(AINSWORTH_ALL_TESTS)
    message(FATAL_ERROR "${what}: ${why}")
  endif()
  message(STATUS "Left out: ${what}: ${why}")
endfunction()
