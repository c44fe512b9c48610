#!/usr/bin/env bash
# Holes, tears, creases and lint of the virtual scanner's fabrics against their truth.
#   WEFT_FLAWS_SEEDS="2 3"                   one scanner and its damage each   (default 1)
#   WEFT_FLAWS_SAMPLES="lace lace+flaws ..." fabrics, spoilt and sound         (default plain-weave+flaws)
set -eu
. "$WEFT_TEST_SOURCE/tests/support/script.sh"
[ -x "$WEFT_TEST_BIN/weft-rig" ] || { echo "skipped: this build has no weft-rig"; exit 77; }
samples=${WEFT_FLAWS_SAMPLES:-plain-weave+flaws}

# shellcheck disable=SC2154 # weft is set by script.sh
for seed in ${WEFT_FLAWS_SEEDS:-1}; do
    "$WEFT_TEST_BIN/weft-rig" --render "$seed" --seed "$seed" --sample "${samples// /,}" -q
    # shellcheck disable=SC2086 # a list
    "$WEFT_TEST_BUILD/tests/fabric_truth" "$seed" "$seed" 1232x816 0.125 $samples
    for sample in $samples; do
        "$weft" solve "$seed/$sample.set" -c "$seed/truth.cal" -o m.maps --mm-per-px 0.125 --ground 0.02 --flaws \
            --force -q --json >solved.json
        "$weft" compare m.maps "$seed/$sample.truth/plane.maps" --json >compared.json 2>/dev/null
        python3 - "$seed" "$sample" <<'PY' >>figures
import json, sys
seed, sample = sys.argv[1:]
solved = json.load(open("solved.json"))["solved"][0]["info"]["result"]["flaws"]
compared = json.load(open("compared.json"))
flaws = compared.get("flaws", {})  # the truth of a sound cloth has none
for kind in "tears", "creases", "lint":
    f = flaws.get(kind, {"precision": None, "recall": None})
    print(seed, sample, kind, solved[kind]["n"], f["precision"], f["recall"])
if "alpha" in compared:
    print(seed, sample, "cover", compared["cover"][0], compared["cover"][1], compared["alpha"]["mean"])
PY
    done
    rm -rf "$seed"
done

python3 - <<'PY'
import sys
from collections import defaultdict
rows, failed = defaultdict(list), []
for line in open("figures"):
    seed, sample, kind, *figures = line.split()
    rows[sample, kind].append([None if x == "None" else float(x) for x in figures])
for (sample, kind), of in rows.items():
    mean = [sum(x[i] or 0 for x in of) / len(of) for i in range(3)]
    if kind == "cover":
        print(f"{sample:18} {'cover':8} {100 * mean[0]:6.1f} %, truth {100 * mean[1]:.1f} %")
        if abs(mean[0] - mean[1]) > 0.03:
            failed.append(f"{sample}: {mean[0]:.3f} covered, the truth is {mean[1]:.3f}")
        continue
    if "+flaws" not in sample:  # nothing is to be found
        print(f"{sample:18} {kind:8} {mean[0]:6.1f} places")
        if mean[0] > 2:
            failed.append(f"{sample}: {mean[0]} {kind} in a sound cloth")
        continue
    print(f"{sample:18} {kind:8} {mean[0]:6.1f} places, precision {100 * mean[1]:5.1f} %, recall {100 * mean[2]:5.1f} %")
    if (mean[1] < 0.9 or mean[2] < 0.9) and not (kind == "lint" and sample.startswith("lace")):
        failed.append(f"{sample}: {kind} precision {mean[1]:.2f}, recall {mean[2]:.2f}")
if failed:
    sys.exit("FAILED: " + "; ".join(failed))
PY
