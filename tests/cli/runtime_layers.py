#!/usr/bin/env python3
"""runtime_layers.py EXPORT: blends layers/ of a png export as layers.json says, pixel by pixel as an engine would, and
holds the result against the flattened pictures beside it.  Prints the largest differences; exits 1 beyond what the
codes of the pictures leave open."""
import json
import math
import sys
from pathlib import Path

import pngfile


def read_png(path):
    """[pixels][channels] in 0..1, and the size."""
    width, height, bits, n, rows = pngfile.read(path)
    top = 2 ** bits - 1
    return [[v / top for v in row[x * n:(x + 1) * n]] for row in rows for x in range(width)], width, height


def decode(v):
    return v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4


DECODERS = {"albedo": lambda p: [decode(v) for v in p], "specular": list, "roughness": list,
            "normal": lambda p: [2 * v - 1 for v in p]}
GROUPS = {"albedo": "albedo", "specular": "specular", "roughness": "specular", "normal": "normal"}


def quantity(folder, constants, name, n):
    path = folder / f"{name}.png"
    if path.exists():
        return [DECODERS[name](p) for p in read_png(path)[0]]
    return [constants[name]] * n


def unit(v):
    length = math.sqrt(sum(x * x for x in v))
    return [x / length for x in v]


def mix(name, below, above, w):
    if name != "normal":
        return [a + w * (b - a) for a, b in zip(below, above)]
    slopes = [below[k] / below[2] + w * (above[k] / above[2] - below[k] / below[2]) for k in range(2)]
    return unit(slopes + [1])


export = Path(sys.argv[1])
doc = json.loads((export / "layers/layers.json").read_text())
assert doc["weft"] == "runtime-layers" and doc["masks"] == "masks.png"
masks, width, height = read_png(export / "layers/masks.png")
n = width * height
limits = {"albedo": 0.006, "specular": 0.0003, "roughness": 0.004, "normal": 0.2}
bad = False
for name, limit in limits.items():
    value = quantity(export / "layers" / doc["base"]["folder"], doc["base"]["constants"], name, n)
    for layer in doc["layers"]:
        if GROUPS[name] not in layer["channels"]:
            continue
        above = quantity(export / "layers" / layer["folder"], layer["constants"], name, n)
        channel = "rgba".index(layer["mask"])
        value = [mix(name, b, a, m[channel]) for b, a, m in zip(value, above, masks)]
    flat_constants = json.loads((export.parent / "material.json").read_text())["maps"]
    flat = quantity(export, {k: v["constant"] for k, v in flat_constants.items()}, name, n)
    if name == "normal":
        worst = max(math.degrees(math.acos(min(sum(a * b for a, b in zip(unit(u), unit(v))), 1))) for u, v in zip(value, flat))
    else:
        worst = max(abs(a - b) for u, v in zip(value, flat) for a, b in zip(u, v))
    print(f"  {name}: largest difference {worst:.5f}{' degrees' if name == 'normal' else ''} over {n} pixels (limit {limit})")
    bad = bad or worst > limit
sys.exit(bad)
