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

set(text "/// \\file What this program was built from; generated, see runtime/version.cmake.
#pragma once

namespace lahar::build {

inline constexpr const char* version = \"${version}\";
inline constexpr const char* commit = \"${commit}\";
inline constexpr const char* compiler = \"${compiler}\";
inline constexpr const char* type = \"${build_type}\";
inline constexpr const char* flags = \"${flags}\";

}  // namespace lahar::build
")
set(present "")
if(EXISTS "${header}")
  file(READ "${header}" present)
endif()
if(NOT present STREQUAL text)
  file(WRITE "${header}" "${text}")
endif()
