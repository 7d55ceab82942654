# Test files compiled several at a time: most of what a compiler does for one of them alone is the
# same for the next. Each file stands in a namespace of its own, so that their names do not meet.
#
# As a script: writes one of the sources that lahar_tests_together() adds.
#   cmake -D "files=FILE|FILE..." -D output=FILE -P together.cmake

if(CMAKE_SCRIPT_MODE_FILE STREQUAL CMAKE_CURRENT_LIST_FILE)
  string(REPLACE "|" ";" files "${files}")
  set(includes "")
  set(bodies "")
  foreach(file IN LISTS files)
    # Before the namespaces: their guards leave nothing of them within.
    file(STRINGS ${file} lines REGEX "^#include [<\"]")
    list(APPEND includes ${lines})
    get_filename_component(name ${file} NAME)
    string(MAKE_C_IDENTIFIER ${name} name)
    string(APPEND bodies "namespace only_${name} {\n#include \"${file}\"\n}\n")
  endforeach()
  list(REMOVE_DUPLICATES includes)
  list(JOIN includes "\n" includes)
  file(WRITE ${output} "// ${files}\n${includes}\n\n${bodies}")
  return()
endif()

set(together_script ${CMAKE_CURRENT_LIST_FILE})

# lahar_tests_together(VARIABLE FILE...): what to compile in place of the files. Those that define
# something in the program's own namespace, or include fragments, stay alone.
function(lahar_tests_together variable)
  set(alone "")
  set(rest "")
  foreach(file IN LISTS ARGN)
    file(STRINGS ${file} own REGEX "^namespace lahar|^namespace doctest|^#define|^ *#include .*\\.inc\"")
    if(own OR LAHAR_TOGETHER LESS_EQUAL 1)
      list(APPEND alone ${file})
    else()
      list(APPEND rest ${file})
    endif()
  endforeach()
  list(LENGTH rest count)
  math(EXPR groups "(${count} + ${LAHAR_TOGETHER} - 1) / ${LAHAR_TOGETHER}")
  # By name, so that a new file leaves the groups of others.
  foreach(file IN LISTS rest)
    file(RELATIVE_PATH name ${CMAKE_CURRENT_SOURCE_DIR} ${file})
    string(MD5 hash ${name})
    string(SUBSTRING ${hash} 0 7 hash)
    math(EXPR group "0x${hash} % ${groups}")
    list(APPEND group_${group} ${file})
  endforeach()
  set(sources ${alone})
  foreach(group RANGE ${groups})
    if(group_${group})
      set(output ${CMAKE_CURRENT_BINARY_DIR}/together/${variable}_${group}.cpp)
      list(JOIN group_${group} "|" files)
      add_custom_command(OUTPUT ${output} DEPENDS ${group_${group}} ${together_script}
        COMMAND ${CMAKE_COMMAND} -D "files=${files}" -D output=${output} -P ${together_script}
        COMMENT "Together: ${variable} ${group}" VERBATIM)
      list(APPEND sources ${output})
    endif()
  endforeach()
  set(${variable} ${sources} PARENT_SCOPE)
endfunction()
