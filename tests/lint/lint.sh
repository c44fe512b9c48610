#!/usr/bin/env bash
# Formatting, headers that compile alone, layers, forbidden calls, links of the documents, static analysis.
# Run by ./dev lint after a build (it needs build/compile_commands.json).
set -uo pipefail
cd "$(dirname "$0")/../.." || exit 1
passed=0
failures=0

check() { # check NAME COMMAND...: runs it, prints its output only when it fails
    local output
    if output=$("${@:2}" 2>&1); then
        echo "ok    $1"
        passed=$((passed + 1))
    else
        echo "FAIL  $1"
        printf '%s\n' "$output" | head -60
        failures=$((failures + 1))
    fi
}

sources() { git ls-files '*.c' '*.h' '*.cpp'; }

formatting() { sources | xargs clang-format --dry-run -Werror; }

# Arrows run one way: host -> calibration, shading -> core; the wire is shared with the firmware.
layers() {
    local bad=0
    wrong() { # wrong FOLDER PATTERN: includes of FOLDER that match PATTERN
        if git grep -nE "^#include \"($2)/" -- "$1/*.c" "$1/*.h" "$1/*.cpp"; then
            echo "$1 must not include the above"
            bad=1
        fi
    }
    wrong core 'calibration|shading|host|firmware'
    wrong calibration 'shading|host|firmware'
    wrong shading 'calibration|host|firmware'
    wrong firmware 'core|calibration|shading|host'
    wrong host/set 'host/(cli|capture|solve|camera|light|rig)'
    wrong host/light 'host/(cli|capture|solve|camera|set|rig)'
    wrong host/camera 'host/(cli|capture|solve|light|set|rig)'
    wrong host/solve 'host/(cli|capture|camera|light|rig)'
    wrong host/photo 'host/(cli|daemon|library|capture|camera|light|rig)'
    wrong host/capture 'host/(cli|solve|rig)'
    wrong host/library 'host/(cli|daemon|capture|solve|camera|light|rig)'
    wrong host/batch 'host/(cli|capture|solve|camera|light|rig|library|daemon)'
    wrong host/process 'calibration|shading|host/([^p][a-z]*|p[^r][a-z]*)'
    wrong host/client 'calibration|shading|host/(cli|[^c][a-z]*|c[^l][a-z]*)'
    wrong host/cli 'host/(daemon|docs)'
    wrong host/daemon 'host/(capture|solve|camera|light|rig)'
    return $bad
}

unique_names() {
    local twice
    twice=$(git ls-files '*.c' '*.h' '*.cpp' | sed 's|.*/||' | sort | uniq -d)
    [ -z "$twice" ] || { echo "file names that occur twice: $twice"; return 1; }
}

headers_alone() {
    local bad=0 header flags
    read -ra flags < <(pkg-config --cflags jansson OpenEXR aravis-0.8 libmicrohttpd)
    for header in $(git ls-files 'core/*.h' 'calibration/*.h' 'shading/*.h' 'host/*.h' 'firmware/protocol.h'); do
        echo "#include \"$header\"" |
            gcc -std=c17 -D_GNU_SOURCE -fopenmp -Wall -Wextra -Werror -fsyntax-only -I. -Ibuild/generated \
                "${flags[@]}" -x c - || bad=1
    done
    return $bad
}

# Calls that core/ replaces, or that cannot be used safely.
forbidden_calls() {
    ! git grep -nE '\b(strcpy|strcat|sprintf|strtok|atoi|atof|alloca|gets)\(' -- '*.c' '*.h' '*.cpp' &&
        ! git grep -nE '\b(malloc|calloc|realloc)\(' -- 'calibration/*.c' 'shading/*.c' 'host/*.c' &&
        ! git grep -nE '\bstrtod\(' -- 'calibration/*.c' 'shading/*.c' 'host/*.c'
}

words() {
    ! git grep -nE '\b(TODO|FIXME|HACK)\b' -- ':!tests/lint/lint.sh'
}

# What set -e passes over: a command behind "!", and all but the last of "A && B".
checks_that_cannot_fail() {
    ! git grep -nE '^ *! (cmp|grep|diff|test|\[) [^|&]*$|^ *(\[|cmp|grep|diff|test) .* && (\[|! |cmp|grep|diff|test) [^|]*$' -- 'tests/*.sh' |
        grep -vE '&& (return|break|continue)'
}

no_opencv_in_weft() {
    ! ldd build/bin/weft | grep -E 'opencv|simavr|aravis|gphoto|libcamera'
}

scripts() { git ls-files '*.sh' dev .ci/run | xargs shellcheck -S warning; }

tidy() {
    local findings # not in a pipe's condition: with pipefail clang-tidy's own status would hide what grep found
    findings=$(git ls-files 'core/*.c' 'calibration/*.c' 'shading/*.c' 'host/*.c' 'firmware/protocol.c' |
        xargs -P "$(nproc)" -n 4 clang-tidy -p build --quiet 2>&1 | grep -E 'error:|warning:.*\[')
    [ -z "$findings" ] || { printf '%s\n' "$findings"; return 1; }
}

ten_longest() {
    echo "ten longest functions (lines, place):"
    sources | grep -v '^tests/' | xargs awk '
        FNR == 1 { start = 0 }
        /^\{/ { start = FNR }
        /^\}/ { if (start) print FNR - start - 1, FILENAME ":" start; start = 0 }' | sort -rn | head -10 | sed 's/^/    /'
}

check "formatting (clang-format)" formatting
check "layers" layers
check "file names are unique" unique_names
check "each header compiles alone" headers_alone
check "no forbidden calls" forbidden_calls
check "no left-over marks" words
check "every check of a script can fail it" checks_that_cannot_fail
check "weft links no OpenCV, simavr or camera library" no_opencv_in_weft
check "links and pictures of the documents" python3 tests/lint/doc_links.py
check "shell scripts (shellcheck)" scripts
check "static analysis (clang-tidy)" tidy
ten_longest
echo
echo "$passed passed, $failures failed"
[ $failures -eq 0 ]
