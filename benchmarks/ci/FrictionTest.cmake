# Tests that run a solver, and then hold its result against the answer of a problem. README.md says how to use it.
#
#     include(path/to/benchmarks/ci/FrictionTest.cmake)
#     friction_test(09 samples.csv EVENTS events.csv REQUIRE budget COMMAND my_solver samples.csv events.csv)
#
# friction_test(PROBLEM RESULTS [EVENTS file] [REQUIRE bounds...] COMMAND solver...)
#
# The command writes the files RESULTS and EVENTS to the build folder, in which it is run. The two tests are named
# solve-PROBLEM-RESULTS and check-PROBLEM-RESULTS; the report is friction-PROBLEM-RESULTS.xml. In these names any other
# character than a letter, a digit, a dot, a hyphen and an underscore becomes a hyphen.
function(friction_test problem results)
  cmake_parse_arguments(PARSE_ARGV 2 arg "" "EVENTS" "REQUIRE;COMMAND")
  if(NOT arg_COMMAND OR arg_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "friction_test(${problem} ${results}): give [EVENTS file] [REQUIRE bounds...] COMMAND ...")
  endif()
  find_package(Python3 3.9 REQUIRED COMPONENTS Interpreter)
  set(check "${CMAKE_CURRENT_FUNCTION_LIST_DIR}/../check.py")
  set(options "")
  if(arg_EVENTS)
    list(APPEND options --events "${arg_EVENTS}")
  endif()
  foreach(bound IN LISTS arg_REQUIRE)
    list(APPEND options "--require=${bound}")
  endforeach()
  string(REGEX REPLACE "[^A-Za-z0-9._-]+" "-" name "${problem}-${results}")
  add_test(NAME "solve-${name}" COMMAND ${arg_COMMAND})
  add_test(NAME "check-${name}" COMMAND "${Python3_EXECUTABLE}" "${check}" "${problem}" "${results}" ${options}
                                        --junit "friction-${name}.xml")
  set_tests_properties("solve-${name}" PROPERTIES FIXTURES_SETUP "solved-${name}")
  set_tests_properties("check-${name}" PROPERTIES FIXTURES_REQUIRED "solved-${name}")
endfunction()
