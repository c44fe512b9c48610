"""PNG without a library: what Weft writes is read, and pictures for tests are written, by the specification alone.
Not interlaced, 8 or 16 bits, grey (1), grey and alpha (2), RGB (3) or RGBA (4)."""
import struct
import zlib

CHANNELS = {0: 1, 2: 3, 4: 2, 6: 4}
COLOURS = {n: colour for colour, n in CHANNELS.items()}
SIGNATURE = b"\x89PNG\r\n\x1a\n"


def read(path):
    """(width, height, bits, channels, rows): a row is its samples, interleaved, 0 to 2^bits - 1."""
    with open(path, "rb") as file:
        data = file.read()
    assert data[:8] == SIGNATURE and data[-8:-4] == b"IEND", f"{path} is not a whole PNG"
    at, body = 8, b""
    while at < len(data):
        n, kind = struct.unpack(">I4s", data[at:at + 8])
        chunk = data[at + 8:at + 8 + n]
        assert zlib.crc32(kind + chunk) == struct.unpack(">I", data[at + 8 + n:at + 12 + n])[0], f"{path}: {kind}"
        if kind == b"IHDR":
            width, height, bits, colour, _, _, interlaced = struct.unpack(">IIBBBBB", chunk)
        elif kind == b"IDAT":
            body += chunk
        at += 12 + n
    assert not interlaced and bits >= 8
    channels = CHANNELS[colour]
    return width, height, bits, channels, _unfilter(zlib.decompress(body), width * channels, height, channels, bits)


def _unfilter(raw, samples, height, channels, bits):
    step, stride = channels * bits // 8, samples * bits // 8
    above, rows = bytearray(stride), []
    for y in range(height):
        kind, row = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        for i in range(stride):
            a, b, c = (row[i - step] if i >= step else 0), above[i], (above[i - step] if i >= step else 0)
            near = min((abs(b - c), 0, a), (abs(a - c), 1, b), (abs(a + b - 2 * c), 2, c))[2]
            row[i] = (row[i] + (0, a, b, (a + b) // 2, near)[kind]) & 255
        rows.append(struct.unpack(f">{samples}{'H' if bits == 16 else 'B'}", row))
        above = row
    return rows


def encode(width, height, bits, channels, rows):
    """The bytes of a PNG; rows as read() gives them."""
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    code = f">{width * channels}{'H' if bits == 16 else 'B'}"
    body = b"".join(b"\0" + struct.pack(code, *row) for row in rows)
    head = struct.pack(">IIBBBBB", width, height, bits, COLOURS[channels], 0, 0, 0)
    return SIGNATURE + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(body)) + chunk(b"IEND", b"")


def write(path, *picture):
    with open(path, "wb") as file:
        file.write(encode(*picture))
