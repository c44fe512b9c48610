#!/usr/bin/env python3
"""Full calibrations of virtual scanners, from photographs only, against what the scanners are.

One row a seed: lens, lights, and the normals of a flat grey sheet that is scanned after the lamps have drifted by
1 % (rms), followed by the white strip.  --check asks for the figures that docs/calibration.md promises.
"""
import argparse, json, math, os, shutil, subprocess, sys, time

BOARDS = ",".join(f"board-{i}" for i in range(15))


def parse():
    p = argparse.ArgumentParser(description=__doc__)
    p.add_argument("--bin", default="build/bin", help="folder of weft and weft-rig")
    p.add_argument("--flatness", default="build/tests/flatness", help="the program that judges maps of a flat sheet")
    p.add_argument("--work", default="series", help="scratch folder; what is in it is deleted")
    p.add_argument("--size", default="1232x816")
    p.add_argument("--seeds", default="1-10", help="first-last")
    p.add_argument("--bow-mm", type=float, default=0, help="bow of the white sheet across")
    p.add_argument("--drift", type=float, default=0.01)
    p.add_argument("--no-strip", action="store_true", help="the scan has no white strip")
    p.add_argument("--check", action="store_true", help="exit 1 when a limit is missed")
    return p.parse_args()


def run(stages, name, *command):
    """Runs a command; its seconds (wall, CPU) and peak memory go to stages[name]."""
    start = time.monotonic()
    child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    out, err = child.stdout.read(), child.stderr.read()
    _, status, usage = os.wait4(child.pid, 0)
    if status != 0:
        sys.exit(f"{' '.join(command)}\nfailed: {err}")
    s = stages.setdefault(name, [0.0, 0.0, 0])
    s[0] += time.monotonic() - start
    s[1] += usage.ru_utime + usage.ru_stime
    s[2] = max(s[2], usage.ru_maxrss)
    return out


def errors_over_sigmas(cal, truth):
    """rms of the lights' coordinate errors in units of the standard deviations that the calibration claims."""
    total, n = 0.0, 0
    for light, report, true in zip(cal["lights"], cal["reports"]["lights"]["lights"], truth["lights"]):
        for found, sigma, exact in zip(light["position_mm"], report["sigma"]["position_mm"], true["position_mm"]):
            total += ((found - exact) / sigma) ** 2
            n += 1
    return math.sqrt(total / n)


def calibrate(a, seed, stages):
    weft, rig = os.path.join(a.bin, "weft"), os.path.join(a.bin, "weft-rig")
    work = os.path.join(a.work, f"seed-{seed}")
    shutil.rmtree(work, ignore_errors=True)
    os.makedirs(work)
    scene = {"weft": "scene", "version": 1, "light_drift": a.drift, "sheet": {"bow_mm": [a.bow_mm, 0]}}
    if not a.no_strip:
        scene["strip_mm"] = [-70, 44, 70, 49]
    with open(f"{work}/scene.json", "w") as f:
        json.dump(scene, f)
    render = [rig, "--render", work, "--size", a.size, "--seed", str(seed), "--scene", f"{work}/scene.json", "-q"]
    run(stages, "render", *render, "--sample", f"{BOARDS},board-table")
    boards = [f"{work}/board-{i}.set" for i in range(15)]
    run(stages, "lens", weft, "calibrate", "lens", *boards, "-o", f"{work}/s.cal", "--board-on-table",
        f"{work}/board-table.set", "-q")
    for board in boards:
        shutil.rmtree(board)
    run(stages, "render", *render, "--sample", "white,flat")
    run(stages, "lights", weft, "calibrate", "lights", f"{work}/white.set", "-o", f"{work}/s.cal", "-q")
    shutil.rmtree(f"{work}/white.set")
    run(stages, "solve", weft, "solve", f"{work}/flat.set", "-c", f"{work}/s.cal", "-o", f"{work}/flat.maps",
        "--geometry", "sensor", "-q")
    d = json.loads(run(stages, "compare", weft, "compare", f"{work}/s.cal", f"{work}/truth.cal", "--json"))
    flat = json.loads(run(stages, "flatness", a.flatness, f"{work}/flat.maps"))
    cal = json.load(open(f"{work}/s.cal/calibration.json"))
    truth = json.load(open(f"{work}/truth.cal/calibration.json"))
    # what the middle of the plate gets from the worst light against the truth
    sheet = cal["reports"]["lights"]["sheet"]
    row = {"seed": seed, "lens_px": cal["camera"]["rms_px"], "plane_px": d["camera"]["projection_px_mean"],
           "position_mean": d["lights"]["position_error_mm_mean"], "position_max": d["lights"]["position_error_mm_max"],
           "over_sigma": errors_over_sigmas(cal, truth),
           "intensity": 100 * math.hypot(d["lights"]["irradiance_ratio_mean"] - 1, d["lights"]["irradiance_ratio_spread"]),
           "bow_mm": sheet["bow_mm"][0], "bow_sigma_mm": sheet["bow_sigma_mm"][0],
           "block_mean": flat["block_mean_deg"], "block_worst": flat["block_worst_deg"],
           "pixel_mean": flat["pixel_mean_deg"]}
    shutil.rmtree(work)
    return row


def main():
    a = parse()
    first, last = (int(x) for x in (a.seeds.split("-") * 2)[:2])
    stages, rows, bad = {}, [], []
    print(f"{a.size}, sheet bowed by {a.bow_mm} mm, lamps drift by {100 * a.drift} %"
          + (", not followed" if a.no_strip else ", followed by the white strip"))
    print("seed  lens px  plane px  position mm mean  max  error/sigma  light %   bow mm           "
          "normals deg: mean  worst  (pixel)")
    for seed in range(first, last + 1):
        r = calibrate(a, seed, stages)
        rows.append(r)
        print(f"{r['seed']:4d}  {r['lens_px']:7.3f}  {r['plane_px']:8.3f}  {r['position_mean']:16.2f} {r['position_max']:5.2f}"
              f"  {r['over_sigma']:11.2f}  {r['intensity']:7.3f}  {r['bow_mm']:6.3f} +- {r['bow_sigma_mm']:5.3f}"
              f"  {r['block_mean']:17.3f}  {r['block_worst']:5.3f}  ({r['pixel_mean']:.2f})", flush=True)
        limits = {"position_mean": 1.0, "intensity": 0.3, "block_mean": 0.1, "block_worst": 0.4}
        bad += [f"seed {seed}: {k} {r[k]:.3f} above {v}" for k, v in limits.items() if r[k] > v]
    mean = {k: sum(r[k] for r in rows) / len(rows) for k in rows[0]}
    rms = math.sqrt(sum(r["over_sigma"] ** 2 for r in rows) / len(rows))
    print(f"mean  {mean['lens_px']:7.3f}  {mean['plane_px']:8.3f}  {mean['position_mean']:16.2f} "
          f"{max(r['position_max'] for r in rows):5.2f}  {rms:11.2f}  {mean['intensity']:7.3f}  {mean['bow_mm']:6.3f}"
          f"{'':19}{mean['block_mean']:11.3f}  {max(r['block_worst'] for r in rows):5.3f}  ({mean['pixel_mean']:.2f})")
    print("stage     s each  CPU s each  peak MiB")
    for name, (wall, cpu, peak) in stages.items():
        print(f"{name:8s}  {wall / len(rows):6.1f}  {cpu / len(rows):10.1f}  {peak / 1024:8.0f}")
    for line in bad:
        print("MISSED:", line)
    return 1 if a.check and bad else 0


if __name__ == "__main__":
    sys.exit(main())
