"""Least squares of all pixels at once in NumPy: peer_numpy.py FILE PIXELS LIGHTS

FILE holds doubles: rows [pixels][lights][3], samples [pixels][lights], our normals [pixels][3].
Prints the nanoseconds per pixel (least of 20 rounds) and the largest angle to our normals in degrees.
Planes in float32, the 3 x 3 systems by cofactors: the fastest of the ways that were tried.
"""
import sys
import time

import numpy as np

path, pixels, lights = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
data = np.fromfile(path)
rows = data[: pixels * lights * 3].reshape(pixels, lights, 3)
samples = data[pixels * lights * 3 : pixels * lights * 4].reshape(pixels, lights)
ours = data[pixels * lights * 4 :].reshape(pixels, 3)
lx, ly, lz = (np.ascontiguousarray(rows[:, :, c].T, dtype=np.float32) for c in range(3))
grey = np.ascontiguousarray(samples.T, dtype=np.float32)


def solve():
    xx, xy, xz = (lx * lx).sum(0), (lx * ly).sum(0), (lx * lz).sum(0)
    yy, yz, zz = (ly * ly).sum(0), (ly * lz).sum(0), (lz * lz).sum(0)
    bx, by, bz = (lx * grey).sum(0), (ly * grey).sum(0), (lz * grey).sum(0)
    c00, c01, c02 = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    c11, c12, c22 = xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy
    over = 1 / (xx * c00 + xy * c01 + xz * c02)
    x, y, z = (
        (c00 * bx + c01 * by + c02 * bz) * over,
        (c01 * bx + c11 * by + c12 * bz) * over,
        (c02 * bx + c12 * by + c22 * bz) * over,
    )
    k = np.sqrt(x * x + y * y + z * z)
    return np.stack((x / k, y / k, z / k), axis=1), k


least = 1e9
for _ in range(20):
    begin = time.perf_counter()
    normals, _albedo = solve()
    least = min(least, time.perf_counter() - begin)
cross = np.linalg.norm(np.cross(normals.astype(float), ours), axis=1)
dot = (normals * ours).sum(1)
print(least * 1e9 / pixels, np.degrees(np.arctan2(cross, dot)).max())
