# Copies the sources named in faults.cmake with their faults planted:
#   cmake -D SOURCE_DIR=... -D OUTPUT_DIR=... -P plant.cmake
# A place that is not found exactly once ends the build and is named: the source has changed, and
# faults.cmake is to follow.
file(REMOVE_RECURSE ${OUTPUT_DIR})
set(names "")

function(plant fault path right wrong)
  set(copy ${OUTPUT_DIR}/${path})
  if(EXISTS ${copy})
    file(READ ${copy} text)
  else()
    file(READ ${SOURCE_DIR}/${path} text)
    set(text "#include \"tests/simulation/planted_fault.h\"\n#line 1 \"${path}\"\n${text}")
  endif()
  string(FIND "${text}" "${right}" first)
  string(FIND "${text}" "${right}" last REVERSE)
  if(first EQUAL -1 OR NOT first EQUAL last)
    message(FATAL_ERROR "${path}: not exactly once there, to plant \"${fault}\":\n${right}")
  endif()
  string(REPLACE "PLANTED" "::treeroll::simulation::planted(\"${fault}\")" wrong "${wrong}")
  string(REPLACE "MEMORY" "::treeroll::simulation::PlantedFault::memory" wrong "${wrong}")
  string(REPLACE "${right}" "${wrong}" text "${text}")
  file(WRITE ${copy} "${text}")
  string(FIND "${names}" "\"${fault}\"" known)
  if(known EQUAL -1)
    set(names "${names}\"${fault}\",\n" PARENT_SCOPE)
  endif()
endfunction()

include(${CMAKE_CURRENT_LIST_DIR}/faults.cmake)
file(WRITE ${OUTPUT_DIR}/planted_faults.inc "${names}")
