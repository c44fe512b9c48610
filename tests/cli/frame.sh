#!/usr/bin/env bash
# The frame of the command line: help, exit status, nearest word, completion.
set -u
. "$WEFT_TEST_SOURCE/tests/support/script.sh"
failures=0

expect 0 "usage: weft COMMAND" "$weft" --help
expect 0 "weft 0." "$weft" --version
expect 2 "usage: weft COMMAND" "$weft"
expect 2 "did you mean \"weft completion\"" "$weft" completoin
expect 2 "no such command" "$weft" embroider
expect 2 "SHELL is missing" "$weft" completion
expect 2 "too many words" "$weft" completion bash fish
expect 2 "there is: bash" "$weft" completion tcsh
expect 2 "no such option" "$weft" completion --colour bash
expect 2 "did you mean --quiet" "$weft" completion --quite bash

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
