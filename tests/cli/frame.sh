#!/usr/bin/env bash
# The frame of the command line: help, exit status, nearest word, completion.
set -u
. "$WEFT_TEST_SOURCE/tests/support/script.sh"
failures=0

expect 0 "usage: weft COMMAND" "$weft" --help
expect 0 "weft 0." "$weft" --version
expect 2 "usage: weft COMMAND" "$weft"
expect 0 "usage: weft calibrate lens" "$weft" help calibrate lens
expect 0 "weft calibrate white" "$weft" help calibrate
expect 2 "no such command" "$weft" help embroider
expect 2 "did you mean \"weft completion\"" "$weft" completoin
expect 2 "calibrate lenz: no such command; did you mean \"weft calibrate lens\"" "$weft" calibrate lenz
expect 2 "did you mean \"weft light on\"" "$weft" lihgt on 3
expect 2 "calibrate everything: no such command; \"weft calibrate --help\" lists" "$weft" calibrate everything
expect 2 "behind its name" "$weft" --json brdf
expect 2 "no such command" "$weft" ""
expect 2 "no such command" "$weft" embroider
expect 2 "SHELL is missing" "$weft" completion
expect 2 "too many words" "$weft" completion bash fish
expect 2 "there is: bash" "$weft" completion tcsh
expect 2 "no such option" "$weft" completion --colour bash
expect 2 "did you mean --quiet" "$weft" completion --quite bash
expect 2 "did you mean --method" "$weft" solve --metod=robust
expect 2 "wanted numbers with commas between (" "$weft" preview a.maps --light abc

# Results that cannot be written are a failure, said in one line; a reader that goes away early is none of it.
for what in --help --version "brdf" "completion bash" "brdf --json"; do
    # shellcheck disable=SC2086
    expect 1 "cannot be written" bash -c '"$@" >/dev/full' bash "$weft" $what
    # shellcheck disable=SC2086
    expect 1 "cannot be written" bash -c '"$@" >&-' bash "$weft" $what
done
[ "$("$weft" brdf --json 2>err | head -c 1)" = "{" ] && [ ! -s err ] || { echo "FAIL: a closed pipe: $(cat err)"; failures=$((failures + 1)); }

# Every command explains itself, with an example, on stdout.
while read -r name; do
    # shellcheck disable=SC2086
    help=$("$weft" $name --help 2>/dev/null) || { echo "FAIL: weft $name --help"; failures=$((failures + 1)); }
    [[ $help == *"example:"*"weft "* ]] || { echo "FAIL: weft $name --help has no example"; failures=$((failures + 1)); }
done < <("$weft" --help | sed -n 's/^  \([a-z][a-z ]*[a-z]\)  .*/\1/p')

# The completion is valid shell, and completes.
eval "$("$weft" completion bash)" || failures=$((failures + 1))
COMP_WORDS=(weft compl) COMP_CWORD=1
_weft
[ "${COMPREPLY[*]}" = completion ] || { echo "FAIL: completing \"compl\" gave ${COMPREPLY[*]}"; failures=$((failures + 1)); }
COMP_WORDS=(weft completion bash --qu) COMP_CWORD=3
_weft
[ "${COMPREPLY[*]}" = --quiet ] || { echo "FAIL: completing \"--qu\" gave ${COMPREPLY[*]}"; failures=$((failures + 1)); }

[ $failures -eq 0 ]
