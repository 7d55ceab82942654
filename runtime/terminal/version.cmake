# Writes the header named by `header` (see the top-level CMakeLists.txt); run with cmake -P.

# "dirty" means: compiled from files that differ from the commit. Outside a git checkout: unknown.
set(commit unknown)
find_program(git git)
if(git AND EXISTS "${source}/.git")
  execute_process(COMMAND ${git} --no-optional-locks -C "${source}"
      describe --always --dirty --abbrev=12
    OUTPUT_VARIABLE described OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
  if(NOT failed)
    set(commit "${described}")
  endif()
endif()
string(REPLACE "\"" "\\\"" flags "${flags}")

set(text "/// \\file What this program was built from; generated, see runtime/terminal/version.cmake.
#pragma once

#define LAHAR_VERSION \"${version}\"
#define LAHAR_COMMIT \"${commit}\"
#define LAHAR_COMPILER \"${compiler}\"
#define LAHAR_BUILD_TYPE \"${build_type}\"
#define LAHAR_FLAGS \"${flags}\"
")
set(present "")
if(EXISTS "${header}")
  file(READ "${header}" present)
endif()
if(NOT present STREQUAL text)
  file(WRITE "${header}" "${text}")
endif()
