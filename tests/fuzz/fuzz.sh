#!/usr/bin/env bash
# Fuzzes every reader for some seconds with libFuzzer, ASan and UBSan.  Run by ./dev fuzz.
set -euo pipefail
cd "$(dirname "$0")/../.."
seconds=${1:-20}

cmake -S . -B build/fuzz -G Ninja -DCMAKE_BUILD_TYPE=RelWithDebInfo -DCMAKE_C_COMPILER=clang \
    -DCMAKE_CXX_COMPILER=clang++ -DWEFT_FUZZ=ON >/dev/null
cmake --build build/fuzz >/dev/null
ASAN_OPTIONS=detect_leaks=0 build/fuzz/bin/fuzz_seeds build/fuzz/seeds

passed=0
for program in build/fuzz/bin/fuzz_*; do
    name=${program##*/fuzz_}
    if [ ! -x "$program" ] || [ "$name" = seeds ]; then continue; fi
    mkdir -p "build/fuzz/corpus/$name" "build/fuzz/seeds/$name" "build/fuzz/artifacts"
    # Leaks inside LibRaw and libtiff after damaged input are theirs; ours show in the test suite.
    if ! "$program" -max_total_time="$seconds" -timeout=20 -rss_limit_mb=4096 -detect_leaks=0 -verbosity=0 \
        -close_fd_mask=3 -print_final_stats=1 -artifact_prefix="build/fuzz/artifacts/$name-" \
        "build/fuzz/corpus/$name" "build/fuzz/seeds/$name" >"build/fuzz/$name.log" 2>&1; then
        tail -40 "build/fuzz/$name.log"
        echo "fuzz $name: FAILED; the input is build/fuzz/artifacts/$name-*"
        exit 1
    fi
    echo "fuzz $name: $(awk '/number_of_executed_units/ {print $2}' "build/fuzz/$name.log") inputs, nothing found"
    passed=$((passed + 1))
done
echo "$passed passed, 0 failed"
