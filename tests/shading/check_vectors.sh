#!/usr/bin/env bash
# The tables of reference values, where they are staged; and that the runner can fail.
set -eu -o pipefail
vectors=${WEFT_SHARED:-$WEFT_TEST_SOURCE/../shared}/spec/vectors
run=$WEFT_TEST_BIN/weft-vectors
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

expect() { # STATUS WORDS COMMAND...
    local status=0 wanted=$1 words=$2
    shift 2
    "$@" >"$work/out" 2>&1 || status=$?
    if [ "$status" != "$wanted" ] || ! grep -q -- "$words" "$work/out"; then
        echo "FAILED: $* exited $status (wanted $wanted), wanted the words: $words"
        cat "$work/out"
        exit 1
    fi
}

# D(0) of alpha 0.5 is 1/(pi 0.25): right, wrong in the 8th digit, NaN column, missing input, not a number
printf 'alpha,nx,out_D,tag\n0.5,1.0,1.2732395447351628,a\n' >"$work/ord_ggx_terms.csv"
expect 0 '1 passed, 0 failed, 0 skipped' "$run" "$work/ord_ggx_terms.csv"
printf 'alpha,nx,out_D\n0.5,1.0,1.27323955\n' >"$work/ord_ggx_terms.csv"
expect 1 'FAILED' "$run" "$work"
printf 'file,suggested_rtol\nord_ggx_terms.csv,1e-7\n' >"$work/MANIFEST.csv"
expect 0 '1 passed' "$run" "$work"
printf 'alpha,out_D\n0.5,1\n' >"$work/ord_ggx_terms.csv"
expect 1 'no column nx' "$run" "$work"
printf 'alpha,nx,out_D\n0.5,x,1\n' >"$work/ord_ggx_terms.csv"
expect 1 'row 1, column nx: "x" is not a number' "$run" "$work"
printf 'alpha,nx,out_D\n0.5\n' >"$work/ord_ggx_terms.csv"
expect 1 'line 2 has 1 cells, the header has 3' "$run" "$work"
mv "$work/ord_ggx_terms.csv" "$work/unheard_of.csv"
expect 0 'unheard_of: no model in this build' "$run" "$work"
expect 0 '0 passed, 0 failed, 1 skipped' "$run" "$work"
expect 1 'cannot' "$run" "$work/ord_ggx_spec.csv"
expect 2 'usage' "$run"

if [ ! -d "$vectors" ]; then
    echo "skipped: the staged tables $vectors are not here (set WEFT_SHARED to their folder's parent)"
    exit 77
fi
"$run" "$vectors" | tee "$work/all"
tail -1 "$work/all" | grep -q ', 0 failed, 0 skipped$'
