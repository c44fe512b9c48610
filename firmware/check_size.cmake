# Fails, and removes the ELF, when the firmware outgrows its limits or drags in slow arithmetic.
# Flash: 12 of 32 KiB, so that sequences and settings still fit under a bootloader.  RAM: 1 of 2 KiB for
# variables; the rest is the stack.
set(flash_limit 12288)
set(ram_limit 1024)

execute_process(COMMAND ${SIZE} -A ${ELF} OUTPUT_VARIABLE sections COMMAND_ERROR_IS_FATAL ANY)
foreach(name text data bss noinit)
  set(${name} 0)
  if(sections MATCHES "\n\\.${name} +([0-9]+)")
    set(${name} ${CMAKE_MATCH_1})
  endif()
endforeach()
math(EXPR flash "${text} + ${data}")
math(EXPR ram "${data} + ${bss} + ${noinit}")
get_filename_component(name ${ELF} NAME)
message(STATUS "${name}: ${flash} of ${flash_limit} bytes of flash, ${ram} of ${ram_limit} bytes of static RAM")

execute_process(COMMAND ${NM} ${ELF} OUTPUT_VARIABLE symbols COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "__[a-z]*(div|mod)[a-z0-9]*|__(add|sub|mul)sf[0-9]|malloc|printf" slow "${symbols}")
if(flash GREATER flash_limit OR ram GREATER ram_limit OR slow)
  file(REMOVE ${ELF})
  message(FATAL_ERROR "${name} is too large or uses what it must not: ${slow}")
endif()
