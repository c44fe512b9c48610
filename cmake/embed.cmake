# weft_embed(TARGET NAME FILE...): compiles files into a target as byte arrays.
#
# Makes NAME.c in the build folder with `const weft_embedded NAME[]` (core/embedded.h), one entry per
# file under the file's own name, a NUL behind its bytes, an entry of NULLs at the end; and adds it to TARGET.
# The file is written again whenever one of the FILEs changes.

if(CMAKE_SCRIPT_MODE_FILE) # run by the custom command below: cmake -DOUT= -DNAME= -P embed.cmake FILE...
  set(text "/* Made by cmake/embed.cmake. */\n#include \"core/embedded.h\"\n\n")
  set(entries "")
  set(index 0)
  set(i 0)
  math(EXPR last "${CMAKE_ARGC} - 1")
  set(is_file FALSE)
  foreach(i RANGE ${last})
    set(file "${CMAKE_ARGV${i}}")
    if(is_file)
      get_filename_component(short "${file}" NAME)
      file(READ "${file}" hex HEX)
      string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${hex}")
      string(REGEX REPLACE "(................................................................................)" "\\1\n"
             bytes "${bytes}")
      string(APPEND text "static const unsigned char file_${index}[] = {\n${bytes}0x00};\n\n")
      string(APPEND entries "    {\"${short}\", file_${index}, sizeof file_${index} - 1},\n")
      math(EXPR index "${index} + 1")
    elseif(file STREQUAL "--")
      set(is_file TRUE)
    endif()
  endforeach()
  string(APPEND text "extern const weft_embedded ${NAME}[];\nconst weft_embedded ${NAME}[] = {\n${entries}    {0},\n};\n")
  file(WRITE "${OUT}" "${text}")
  return()
endif()

set(WEFT_EMBED_SCRIPT ${CMAKE_CURRENT_LIST_FILE})

function(weft_embed target name)
  set(out ${CMAKE_CURRENT_BINARY_DIR}/${name}.c)
  set(files "")
  foreach(file ${ARGN})
    list(APPEND files ${CMAKE_CURRENT_SOURCE_DIR}/${file})
  endforeach()
  add_custom_command(OUTPUT ${out}
    COMMAND ${CMAKE_COMMAND} -DOUT=${out} -DNAME=${name} -P ${WEFT_EMBED_SCRIPT} -- ${files}
    DEPENDS ${files} ${WEFT_EMBED_SCRIPT} VERBATIM)
  target_sources(${target} PRIVATE ${out})
endfunction()
