#!/usr/bin/env bash
# weft lint on maps that are right, and on maps that were spoilt in a known way.
set -eu
. "$WEFT_TEST_SOURCE/tests/support/script.sh"
"$WEFT_TEST_BUILD/tests/make-weave-maps" weave.maps
printf ':w := ( opaquematerial :scan = "weave.maps" )\n' >w.radattr
"$weft" bake w.radattr -o w.material --size 256x256 --export png >/dev/null
expect 0 '0 wrong' "$weft" lint w.material/png
python3 - <<'TEXT'
import math, struct, zlib

def read(path):  # 8- or 16-bit RGB, as Weft writes it
    data, at, body = open(path, "rb").read(), 8, b""
    while at < len(data):
        n, kind = struct.unpack(">I4s", data[at:at + 8])
        if kind == b"IHDR":
            w, h, bits, colour = struct.unpack(">IIBB", data[at + 8:at + 18])
        if kind == b"IDAT":
            body += data[at + 8:at + 8 + n]
        at += 12 + n
    assert colour == 2
    step, raw, out, last = 3 * bits // 8, zlib.decompress(body), [], bytearray(w * 3 * bits // 8)
    for y in range(h):
        line = bytearray(raw[y * (len(last) + 1) + 1:(y + 1) * (len(last) + 1)])
        rule = raw[y * (len(last) + 1)]
        for i in range(len(line)):
            a, b, c = (line[i - step] if i >= step else 0), last[i], (last[i - step] if i >= step else 0)
            p = a + b - c
            near = min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]
            line[i] = (line[i] + (0, a, b, (a + b) // 2, near)[rule]) & 255
        out.append(line)
        last = line
    return w, h, bits, out

def write(path, w, h, bits, lines):
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    head = struct.pack(">IIBBBBB", w, h, bits, 2, 0, 0, 0)
    body = zlib.compress(b"".join(b"\0" + bytes(line) for line in lines))
    open(path, "wb").write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", body) + chunk(b"IEND", b""))

def waves(sign):  # rows go down where y goes up
    lines = []
    for y in range(128):
        line = bytearray()
        for x in range(128):
            a, b = 2 * math.pi * x / 16, 2 * math.pi * y / 32
            p, q = 0.6 * math.cos(a) * math.cos(b), -0.3 * math.sin(a) * math.sin(b)
            n = (-p, sign * q, 1.0)
            r = math.sqrt(sum(v * v for v in n))
            line += bytes(round(127.5 + 127.5 * v / r) for v in n)
        lines.append(line)
    return lines

write("up_normal.png", 128, 128, 8, waves(1))
write("down_normal.png", 128, 128, 8, waves(-1))
w, h, bits, lines = 128, 128, 8, waves(1)
write("short_normal.png", w, h, bits, [bytes(128 + (v - 128) // 2 for v in line) for line in lines])
w, h, bits, lines = read("w.material/png/albedo.png")
write("dark_albedo.png", w, h, bits, [bytes(v // 8 for v in line) for line in lines])
TEXT
expect 0 'grows upwards' "$weft" lint up_normal.png
expect 0 'grows downwards' "$weft" lint down_normal.png
expect 1 'of the normals are not of unit length' "$weft" lint short_normal.png
expect 1 'less than the black patch' "$weft" lint dark_albedo.png
expect 1 'WRONG' "$weft" lint w.material/png/albedo.png w.material/png/normal.png weave.maps
grep -q 'but the first map of the set is 256 x 256' out
"$weft" lint --json w.material/png | python3 -c 'import json, sys; assert json.load(sys.stdin)["wrong"] == 0'
mkdir empty
expect 1 'empty: holds no pictures' "$weft" lint empty
