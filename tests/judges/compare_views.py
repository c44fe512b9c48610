#!/usr/bin/env python3
"""compare_views.py A.png B.png: two pictures of one swatch under one light.  Prints the mean colours (linear), their
ratio, the correlation of the brightness, and the direction that the weave's slopes prefer in each; with limits
"MIN-CORRELATION MAX-RATIO MAX-DEGREES" behind, exits 1 beyond them."""
import math
import sys

import pngfile


def read_png(path):
    """8 bit RGB or RGBA, as linear light."""
    width, _, bits, step, rows = pngfile.read(path)
    assert bits == 8 and step > 2, path
    linear = [v / 255 / 12.92 if v <= 10 else ((v / 255 + 0.055) / 1.055) ** 2.4 for v in range(256)]
    return [[[linear[row[x * step + c]] for c in range(3)] for x in range(width)] for row in rows]


def mean(picture):
    n = len(picture) * len(picture[0])
    return [sum(texel[c] for row in picture for texel in row) / n for c in range(3)]


def brightness(picture):
    return [[0.2126 * t[0] + 0.7152 * t[1] + 0.0722 * t[2] for t in row] for row in picture]


def blurred(y):
    """Each pixel with its neighbours: renderers filter a pixel's width differently."""
    h, w = len(y), len(y[0])
    y = [[(row[max(x - 1, 0)] + 2 * row[x] + row[min(x + 1, w - 1)]) / 4 for x in range(w)] for row in y]
    return [[(y[max(j - 1, 0)][x] + 2 * y[j][x] + y[min(j + 1, h - 1)][x]) / 4 for x in range(w)] for j in range(h)]


def correlation(a, b):
    u, v = [x for row in a for x in row], [x for row in b for x in row]
    mu, mv = sum(u) / len(u), sum(v) / len(v)
    return sum((x - mu) * (y - mv) for x, y in zip(u, v)) / math.sqrt(sum((x - mu) ** 2 for x in u) * sum((y - mv) ** 2 for y in v))


def direction(y):
    """Of the structure tensor's smaller axis: along the lines of the weave, degrees from +X, up positive."""
    xx = yy = xy = 0.0
    for j in range(1, len(y) - 1):
        for i in range(1, len(y[0]) - 1):
            gx, gy = y[j][i + 1] - y[j][i - 1], y[j - 1][i] - y[j + 1][i]
            xx, yy, xy = xx + gx * gx, yy + gy * gy, xy + gx * gy
    return math.degrees(0.5 * math.atan2(2 * xy, xx - yy)) + 90


a, b = read_png(sys.argv[1]), read_png(sys.argv[2])
ma, mb = mean(a), mean(b)
ratio = max(max(x / y, y / x) for x, y in zip(ma, mb))
ya, yb = blurred(brightness(a)), blurred(brightness(b))
r, da, db = correlation(ya, yb), direction(blurred(blurred(ya))), direction(blurred(blurred(yb)))
turn = abs((da - db + 90) % 180 - 90)
print("mean %.4f %.4f %.4f and %.4f %.4f %.4f, ratio %.3f; correlation %.3f; weave at %.1f and %.1f degrees" % (*ma, *mb, ratio, r, da, db))
if len(sys.argv) > 3:
    least, most, degrees = map(float, sys.argv[3:6])
    sys.exit(r < least or ratio > most or turn > degrees)
