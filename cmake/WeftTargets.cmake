# How a folder becomes a library, and a check_*.c becomes a test.

set(WEFT_WARNINGS -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wdouble-promotion -Wstrict-prototypes
    -Wmissing-prototypes -Wvla -Wundef)

add_library(weft_options INTERFACE)
target_include_directories(weft_options INTERFACE ${CMAKE_SOURCE_DIR} ${CMAKE_BINARY_DIR}/generated)
target_compile_definitions(weft_options INTERFACE _GNU_SOURCE)
target_compile_options(weft_options INTERFACE $<$<COMPILE_LANGUAGE:C>:${WEFT_WARNINGS}>)
target_link_libraries(weft_options INTERFACE m)
if(WEFT_SANITIZE)
  target_compile_options(weft_options INTERFACE -fsanitize=address,undefined -fno-sanitize-recover=undefined
                         -fno-omit-frame-pointer)
  target_link_options(weft_options INTERFACE -fsanitize=address,undefined)
endif()

if(WEFT_FUZZ)
  target_compile_options(weft_options INTERFACE -fsanitize=fuzzer-no-link,address,undefined -fno-omit-frame-pointer)
  target_link_options(weft_options INTERFACE -fsanitize=address,undefined)
endif()

# weft_library(NAME SOURCES a.c b.c [LIBS x y])
function(weft_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LIBS" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  target_link_libraries(${name} PUBLIC weft_options ${ARG_LIBS})
endfunction()

# weft_test(check_NAME [SOURCES more.c] [LIBS x y] [TIMEOUT s] [SERIAL]): a cmocka program from check_NAME.c in this folder.
# Exit status 77 is "skipped"; the program says why.  SERIAL: uses the virtual scanner's or its board's devices alone.
# SERIAL gives the label "clock": what runs against the machine's clock, which ./dev test tries a second time.
function(weft_test name)
  cmake_parse_arguments(ARG "SERIAL" "TIMEOUT" "SOURCES;LIBS" ${ARGN})
  add_executable(${name} ${name}.c ${ARG_SOURCES})
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  target_link_libraries(${name} PRIVATE weft_options weft_test_support cmocka ${ARG_LIBS})
  add_test(NAME ${name} COMMAND ${name})
  weft_test_properties(${name} "${ARG_TIMEOUT}" "${ARG_SERIAL}")
endfunction()

# weft_script_test(NAME script.sh [TIMEOUT s] [SERIAL]): an end-to-end test; the script gets BIN and SOURCE in its environment.
function(weft_script_test name script)
  cmake_parse_arguments(ARG "SERIAL" "TIMEOUT" "" ${ARGN})
  add_test(NAME ${name} COMMAND bash ${CMAKE_CURRENT_SOURCE_DIR}/${script})
  weft_test_properties(${name} "${ARG_TIMEOUT}" "${ARG_SERIAL}")
endfunction()

function(weft_test_properties name timeout serial)
  if(NOT timeout)
    set(timeout 600) # generous: a busy machine is no failure
  endif()
  set(sanitized) # "1": scripts repeat what is slow less often
  if(WEFT_SANITIZE)
    set(sanitized 1)
  endif()
  set_tests_properties(${name} PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT ${timeout}
    ENVIRONMENT "WEFT_SOCKET=none;WEFT_TEST_BIN=${CMAKE_BINARY_DIR}/bin;WEFT_TEST_SOURCE=${CMAKE_SOURCE_DIR};WEFT_TEST_BUILD=${CMAKE_BINARY_DIR};WEFT_TEST_SANITIZE=${sanitized};ASAN_OPTIONS=detect_leaks=1;LSAN_OPTIONS=suppressions=${CMAKE_SOURCE_DIR}/tests/lsan.supp:print_suppressions=0;OPENBLAS_NUM_THREADS=1")
  if(serial)
    set_tests_properties(${name} PROPERTIES RESOURCE_LOCK rig LABELS clock)
  endif()
endfunction()
