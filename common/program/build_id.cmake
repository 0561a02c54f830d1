# Writes OUTPUT, the source of build_id(), unless it says so already: run at each build, it costs one
# call of git, and what depends on it is built again only where the commit is another one.
#   cmake -D SOURCE=... -D OUTPUT=... -P build_id.cmake
set(id "commit unknown")
find_program(git NAMES git)
if(git AND EXISTS "${SOURCE}/.git")
  execute_process(COMMAND "${git}" -C "${SOURCE}" describe --always --dirty=+ --abbrev=12 --exclude=*
    OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE status)
  if(status EQUAL 0)
    set(id "commit ${commit}")
    string(REPLACE "+" ", changed" id "${id}")
  endif()
endif()
set(text "#include \"common/program/build_id.h\"\n\nconst char* treeroll::build_id() { return \"${id}\"; }\n")
set(before "")
if(EXISTS "${OUTPUT}")
  file(READ "${OUTPUT}" before)
endif()
if(NOT text STREQUAL before)
  file(WRITE "${OUTPUT}" "${text}")
endif()
