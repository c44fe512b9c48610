#!/usr/bin/env python3
"""judge_u3m.py SCHEMA FOLDER...: .u3m against the schema, its pictures against its sizes, .u3ma byte by byte."""
import json
import struct
import sys
import zlib
from pathlib import Path

import jsonschema

def png_size(data):
    return struct.unpack(">II", data[16:24])

def images(node):
    if isinstance(node, dict):
        if "path" in node and "dpi" in node:
            yield node
        for value in node.values():
            yield from images(value)

def check_document(schema, path):
    document = json.loads(path.read_text("utf-8"))
    errors = [e.message for e in jsonschema.Draft7Validator(schema, format_checker=jsonschema.FormatChecker()).iter_errors(document)]
    for image in images(document["material"]):
        data = (path.parent / image["path"]).read_bytes()
        if not data.startswith(b"\x89PNG"):
            continue # passed on from elsewhere
        width, height = png_size(data)
        if abs(image["width"] / 25.4 * image["dpi"]["x"] - width) > 1e-3 or abs(image["height"] / 25.4 * image["dpi"]["y"] - height) > 1e-3:
            errors.append(f"{image['path']}: size, dpi and pixels disagree")
    return errors

def check_archive(path):
    """The rules of u3m_additional_spec_u3ma.txt, without a zip library."""
    data, errors, at, names = path.read_bytes(), [], 0, {}
    while data[at:at + 4] == b"PK\x03\x04":
        need, flags, method, _, _, crc, packed, size, n_name, n_extra = struct.unpack("<HHHHHIIIHH", data[at + 4:at + 30])
        name = data[at + 30:at + 30 + n_name].decode("utf-8")
        body = data[at + 30 + n_name:at + 30 + n_name + packed]
        plain = body if method == 0 else zlib.decompress(body, -15)
        if need != 0x14 or flags & ~6 != 0x800 or method not in (0, 8) or n_extra:
            errors.append(f"{name}: local header")
        if len(plain) != size or zlib.crc32(plain) != crc or name in names or name.startswith("/") or ".." in name:
            errors.append(f"{name}: content or name")
        names[name] = (at, data[at + 4:at + 30])
        at += 30 + n_name + packed
    start, count = at, 0
    while data[at:at + 4] == b"PK\x01\x02":
        made, = struct.unpack("<H", data[at + 4:at + 6])
        n_name, n_extra, n_comment, disk, internal, external, offset = struct.unpack("<HHHHHII", data[at + 28:at + 46])
        name = data[at + 46:at + 46 + n_name].decode("utf-8")
        if made >> 8 or n_extra or n_comment or disk or internal or external:
            errors.append(f"{name}: directory")
        if name not in names or names[name][0] != offset or names[name][1] != data[at + 6:at + 32]:
            errors.append(f"{name}: directory and local header differ")
        at += 46 + n_name
        count += 1
    end = struct.unpack("<4sHHHHIIH", data[at:at + 22])
    if end != (b"PK\x05\x06", 0, 0, count, count, at - start, start, 0) or len(data) != at + 22 or count != len(names):
        errors.append("end of central directory")
    return errors

schema = json.load(open(sys.argv[1], encoding="utf-8"))
bad = 0
for folder in map(Path, sys.argv[2:]):
    for path in sorted(folder.glob("*.u3m")) + sorted(folder.glob("*.u3ma")):
        errors = check_document(schema, path) if path.suffix == ".u3m" else check_archive(path)
        print(f"{path}: {errors or 'good'}")
        bad += len(errors)
sys.exit(bool(bad))
