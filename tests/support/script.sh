# Sourced by the end-to-end scripts: the program, a scratch folder that is the working folder, expect.
# shellcheck shell=bash
# shellcheck disable=SC2034 # used by the scripts
weft=$WEFT_TEST_BIN/weft
export PYTHONPATH=$WEFT_TEST_SOURCE/tests/support PYTHONDONTWRITEBYTECODE=1 # pngfile.py
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1

expect() { # STATUS WORDS COMMAND...: exit status, and WORDS somewhere in what it printed
    local status=0 wanted=$1 words=$2
    shift 2
    "$@" >out 2>&1 || status=$?
    if [ "$status" != "$wanted" ] || ! grep -qF -- "$words" out; then
        echo "FAILED: $* exited $status (wanted $wanted), wanted: $words"
        cat out
        exit 1
    fi
}

refuse() { # COMMAND...: that must fail ("! COMMAND" on a line of its own never ends a script, whatever comes of it)
    if "$@" >out.refused 2>&1; then
        echo "FAILED: this should not succeed: $*"
        cat out.refused
        exit 1
    fi
}
