#!/usr/bin/env python3
"""u3m.py make: U3M materials of other vendors, and archives that no reader may take.  u3m.py same A B: whether two
U3Ms say the same: documents as JSON, every other file byte for byte."""
import json
import random
import struct
import sys
import zlib
from pathlib import Path

MADE = "2024-02-29T08:30:00+01:00"


def png(width, height, channels, texel):
    """8 bit; texel(x, y) gives the channels."""
    rows = b"".join(b"\0" + bytes(v for x in range(width) for v in texel(x, y)) for y in range(height))
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    head = struct.pack(">IIBBBBB", width, height, 8, {1: 0, 3: 2}[channels], 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def entry(name, data, offset, flags=0x800, method=8, claim=None, extra=b"", local_name=None, made=63):
    """A file and its line in the directory."""
    method = method if data else 0
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    packed = packer.compress(data) + packer.flush() if method == 8 else data
    size = len(data) if claim is None else claim
    common = lambda n: struct.pack("<HHHHHIIIHH", 20, flags, method, 0x4210, 0x585d, zlib.crc32(data), len(packed), size, len(n), len(extra))
    local = (local_name or name).encode()
    name = name.encode()
    line = b"PK\x01\x02" + struct.pack("<H", made) + common(name) + struct.pack("<HHHII", 0, 0, 0, 0, offset) + name + extra
    return b"PK\x03\x04" + common(local) + local + extra + packed, line


def archive(files, shift=0, tail=b"", comment=b"", odd=1, **oddity):
    """Strict, but for what `oddity` does to the last `odd` entries."""
    body, lines = b"", []
    for i, (name, data) in enumerate(files):
        is_odd = i >= len(files) - odd
        one, line = entry(name, data, len(body) + (shift if is_odd else 0), **(oddity if is_odd else {}))
        body += one
        lines.append(line)
    directory = b"".join(lines)
    end = struct.pack("<IHHHHIIH", 0x06054b50, 0, 0, len(lines), len(lines), len(directory), len(body), len(comment))
    return body + tail + directory + end + comment


def image(path, width_mm, height_mm, pixels):
    return {"path": path, "width": width_mm, "height": height_mm, "dpi": {"x": pixels[0] * 25.4 / width_mm, "y": pixels[1] * 25.4 / height_mm},
            "repeat": {"mode": "normal", "rotation": 0}}


def document():
    """What a scanner of another maker could write: odd names, its own section, physics, metadata, clear coat."""
    number = lambda v: {"constant": v, "texture": None}
    up = {"constant": {"x": 0, "y": 0, "z": 1}, "texture": None}
    front = {key: number(0) for key in ("anisotropy_rotation", "clearcoat_roughness", "metalness", "displacement", "sheen_value",
                                        "sheen_tint", "specular_tint", "subsurface_radius", "subsurface_value", "transmission")}
    front |= {"shader": "principled", "preview": None, "clearcoat_normal": up, "clearcoat_value": number(0.25), "ior": number(1.45),
              "specular_value": number(0.5), "anisotropy_value": number(0.4), "alpha": number(1),
              "subsurface_color": {"constant": {"r": 1, "g": 1, "b": 1}, "texture": None}}
    front["basecolor"] = {"constant": {"r": 0.5, "g": 0.25, "b": 0.125},
                          "texture": {"mode": "multiply", "factor": {"r": 1, "g": 0.5, "b": 1}, "image": image("maps/Base Colour.png", 40.5, 20.25, (64, 32))}}
    front["roughness"] = {"constant": 0.6, "texture": {"factor": 0.5, "offset": 0.25, "image": image("maps/rough.png", 40.5, 20.25, (64, 32))}}
    front["normal"] = {"constant": {"x": 0, "y": 0, "z": 1}, "texture": {"scale": 0.5, "image": image("maps/normal.png", 40.5, 20.25, (64, 32))}}
    return {"schema": "1.1",
            "material": {"id": "{45d231aa-96a0-4d94-9aae-4a99fae0e32a}", "name": "Harris Tweed 7", "description": "straße", "created": MADE,
                         "modified": MADE, "front": front, "back": None, "side": None, "metadata": {"price": 12.30, "tags": ["a", None, True]},
                         "physics": {"thickness": 0.8, "weight": 310, "composition": None, "devices": {"fab": "physics/tweed.fab"},
                                     "material_type": None, "construction": None}},
            "custom": {"Vizoo": {"secret": "q83vEjRWeJCrze8=", "precise": 0.1234567890123456, "large": 9007199254740993, "extra": "vizoo_custom/data.bin"},
                       "weaver": [1, {"deep": {"er": "ß"}}, None]}}


def files_of(doc, folder=""):
    texel = lambda x, y: (40 + 3 * x, 200 - 4 * y, (x * y) % 256)
    tilt = lambda x, y: (128 + 60 * (x % 2) - 30, 140 - 12 * (y % 2), 230)
    return [(folder + "Harris Tweed 7.u3m", json.dumps(doc, ensure_ascii=False, indent=1).encode()),
            (folder + "maps/Base Colour.png", png(64, 32, 3, texel)), (folder + "maps/rough.png", png(64, 32, 1, lambda x, y: (4 * x,))),
            (folder + "maps/normal.png", png(64, 32, 3, tilt)), (folder + "physics/tweed.fab", b'{"bend": 3}'),
            (folder + "vizoo_custom/data.bin", bytes(range(256))), (folder + "nobody/refers.txt", b"keep me")]


def make():
    good = files_of(document())
    Path("tweed.u3ma").write_bytes(archive(good))
    Path("inside.u3ma").write_bytes(archive([("a/", b"")] + files_of(document(), "a/")))
    for name, data in good:
        path = Path("folder") / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    Path("legacy.u3ma").write_bytes(archive(good, flags=0, made=0x0314))

    def bad(name, data):
        Path(f"bad-{name}.u3ma").write_bytes(data)

    for name, evil in (("slip", "../evil.png"), ("absolute", "/tmp/evil.png"), ("backslash", "a\\..\\evil.png"), ("drive", "C:evil.png"),
                       ("dot", "a/./evil.png"), ("nul", "a\0b.png"), ("control", "a\nb.png")):
        bad(name, archive(good + [(evil, b"x")]))
    bad("twice", archive(good + [good[1]]))
    bad("file-and-folder", archive(good + [("maps/normal.png/x", b"x")]))
    bad("bomb", archive(good + [("bomb", bytes(1 << 20))], claim=3 << 30))
    bad("big", archive(good + [(f"big{i}", random.Random(i).randbytes(1 << 20)) for i in range(3)], odd=3, claim=1000 << 20))
    bad("grows", archive(good + [("grows", b"x" * 1000)], claim=999))
    bad("shrinks", archive(good + [("shrinks", b"x" * 1000)], claim=1001))
    bad("encrypted", archive(good, flags=0x801))
    bad("descriptor", archive(good, flags=0x808))
    bad("method", archive(good, method=12))
    bad("overlap", archive(good, shift=-40))
    bad("two-names", archive(good, local_name="nobody/Refers.txt"))
    bad("comment", archive(good, comment=b"hello"))
    bad("gap", archive(good, tail=b"hidden"))
    whole = archive(good)
    bad("before", b"MZ" + whole)
    bad("behind", whole + b"x")
    for cut in (0, 3, 21, len(whole) // 2, len(whole) - 1):
        bad(f"cut-{cut}", whole[:cut])
    damaged = bytearray(whole)
    damaged[whole.index(b"maps/Base Colour.png") + 60] ^= 0x55
    bad("bits", bytes(damaged))
    bad("none", archive(good[1:]))
    bad("both", archive(good + [("second.u3m", good[0][1])]))
    bad("lost", archive([good[0]] + good[2:]))
    bad("text", archive([("x.u3m", b"{")]))
    bad("list", archive([("x.u3m", b"[]")]))

    def bad_document(name, change):
        doc = document()
        change(doc, doc["material"]["front"])
        bad(name, archive(files_of(doc)))

    bad_document("version", lambda d, f: d.update(schema="2.0"))
    bad_document("blind", lambda d, f: d["material"].update(front=None))
    bad_document("key", lambda d, f: f.pop("roughness"))
    bad_document("constant", lambda d, f: f["alpha"].update(constant="x"))
    bad_document("width", lambda d, f: f["normal"]["texture"]["image"].update(width=0))
    bad_document("path", lambda d, f: f["normal"]["texture"]["image"].update(path="../maps/normal.png"))
    bad_document("device", lambda d, f: f["normal"]["texture"]["image"].update(path="maps/CON.png"))
    bad_document("picture", lambda d, f: f["normal"]["texture"]["image"].update(path="vizoo_custom/data.bin"))


def contents(path):
    """Name to bytes of an archive (checked elsewhere byte by byte) or a folder."""
    if path.is_dir():
        return {str(p.relative_to(path)): p.read_bytes() for p in path.rglob("*") if p.is_file() and p.suffix != ".u3ma" and p.name != "report.json"}
    import zipfile
    with zipfile.ZipFile(path) as z:
        return {name: z.read(name) for name in z.namelist()}


def same(a, b):
    one, two = contents(Path(a)), contents(Path(b))
    assert set(one) == set(two), set(one) ^ set(two)
    for name in one:
        if name.endswith(".u3m"):
            assert json.loads(one[name]) == json.loads(two[name]), name
        else:
            assert one[name] == two[name], name


if sys.argv[1] == "make":
    make()
else:
    same(*sys.argv[2:])
