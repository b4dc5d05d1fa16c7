"""Reads and writes PNG and reads EXR, by itself: an independent look at what the programs encode."""

import struct
import zlib

PNG_MAGIC = b"\x89PNG\r\n\x1a\n"


class Picture:
    """Width, height, channels and rows from the top: rows[y][x * channels + c]."""

    def __init__(self, width, height, channels, rows):
        self.width, self.height, self.channels, self.rows = width, height, channels, rows

    def at(self, x, y):
        """The first three samples of a pixel (or the one there is)."""
        start = x * self.channels
        return tuple(self.rows[y][start : start + min(3, self.channels)])


def png_write(width, height, rows, bits=8, channels=1):
    """A PNG of integer samples: grey (1 channel) or RGB (3), 8 or 16 bits."""
    code = ">H" if bits == 16 else ">B"
    raw = bytearray()
    for row in rows:
        assert len(row) == width * channels
        raw.append(0)
        for sample in row:
            raw += struct.pack(code, sample)

    def chunk(kind, data):
        crc = zlib.crc32(kind + data)
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", crc)

    colour = {1: 0, 3: 2}[channels]
    header = struct.pack(">IIBBBBB", width, height, bits, colour, 0, 0, 0)
    return (PNG_MAGIC + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(bytes(raw)))
            + chunk(b"IEND", b""))


def _png_chunks(data):
    if data[:8] != PNG_MAGIC:
        raise ValueError("not a PNG: it begins with %r" % data[:8])
    at, seen_end = 8, False
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        body = data[at + 8 : at + 8 + length]
        (crc,) = struct.unpack(">I", data[at + 8 + length : at + 12 + length])
        if crc != zlib.crc32(kind + body):
            raise ValueError("PNG chunk %s has a wrong checksum" % kind)
        yield kind, body
        at += 12 + length
        seen_end = kind == b"IEND"
    if not seen_end:
        raise ValueError("PNG without an end")


def _paeth(a, b, c):
    p = a + b - c
    pa, pb, pc = abs(p - a), abs(p - b), abs(p - c)
    if pa <= pb and pa <= pc:
        return a
    return b if pb <= pc else c


def _png_unfilter(kind, line, above, bpp):
    for i in range(len(line)):
        left = line[i - bpp] if i >= bpp else 0
        up = above[i]
        corner = above[i - bpp] if i >= bpp else 0
        guess = (0, left, up, (left + up) // 2, _paeth(left, up, corner))[kind]
        line[i] = (line[i] + guess) & 255
    return line


def png_read(data):
    """Decodes 8-bit grey, RGB or RGBA, not interlaced. `text` chunks are an error: pictures carry
    neither time nor host."""
    header, packed = None, b""
    for kind, body in _png_chunks(data):
        if kind == b"IHDR":
            header = struct.unpack(">IIBBBBB", body)
        elif kind == b"IDAT":
            packed += body
        elif kind in (b"tIME",):
            raise ValueError("the PNG carries a time")
    width, height, bits, colour, _, _, interlaced = header
    if bits != 8 or interlaced or colour not in (0, 2, 6):
        raise ValueError("PNG of %d bits, colour type %d, interlace %d" % (bits, colour, interlaced))
    channels = {0: 1, 2: 3, 6: 4}[colour]
    raw = zlib.decompress(packed)
    stride = width * channels
    if len(raw) != (stride + 1) * height:
        raise ValueError("PNG holds %d bytes, not %d" % (len(raw), (stride + 1) * height))
    rows, above = [], bytearray(stride)
    for y in range(height):
        start = y * (stride + 1)
        line = bytearray(raw[start + 1 : start + 1 + stride])
        above = _png_unfilter(raw[start], line, above, channels)
        rows.append(above)
    return Picture(width, height, channels, rows)


# ---- EXR: single part, scan lines, uncompressed or deflated -------------------------------------

_EXR_LINES = {0: 1, 2: 1, 3: 16}  # scan lines a block, by compression


def _exr_header(data):
    magic, version = struct.unpack("<II", data[:8])
    if magic != 20000630 or version & 0xFF != 2 or version & 0x1A00:
        raise ValueError("not a plain EXR of scan lines")
    at, attributes = 8, {}

    def text():
        nonlocal at
        end = data.index(b"\0", at)
        word = data[at:end].decode()
        at = end + 1
        return word

    while True:
        name = text()
        if not name:
            return attributes, at
        kind = text()
        (size,) = struct.unpack("<i", data[at : at + 4])
        attributes[name] = (kind, data[at + 4 : at + 4 + size])
        at += 4 + size


def _exr_channels(blob):
    channels, at = [], 0
    while blob[at]:
        end = blob.index(b"\0", at)
        name = blob[at:end].decode()
        kind, _, xs, ys = struct.unpack("<iB3xii", blob[end + 1 : end + 17])
        if kind not in (1, 2) or (xs, ys) != (1, 1):
            raise ValueError("EXR channel %s of kind %d" % (name, kind))
        channels.append((name, kind))
        at = end + 17
    return channels


def _exr_inflate(packed, size):
    if len(packed) == size:
        return packed
    raw = bytearray(zlib.decompress(packed))
    for i in range(1, len(raw)):
        raw[i] = (raw[i - 1] + raw[i] - 128) & 255
    out = bytearray(size)
    half = (size + 1) // 2
    out[0::2], out[1::2] = raw[:half], raw[half:]
    return bytes(out)


def exr_read(data):
    """A picture with float samples R G B, and the header's attributes as (kind, bytes)."""
    attributes, at = _exr_header(data)
    x0, y0, x1, y1 = struct.unpack("<iiii", attributes["dataWindow"][1])
    width, height = x1 - x0 + 1, y1 - y0 + 1
    channels = _exr_channels(attributes["channels"][1])
    compression = attributes["compression"][1][0]
    lines = _EXR_LINES[compression]
    blocks = (height + lines - 1) // lines
    offsets = struct.unpack("<%dQ" % blocks, data[at : at + 8 * blocks])
    row_bytes = width * sum(4 if kind == 2 else 2 for _, kind in channels)
    planes = {}
    for offset in offsets:
        y, size = struct.unpack("<ii", data[offset : offset + 8])
        count = min(lines, y1 - y + 1)
        raw = _exr_inflate(data[offset + 8 : offset + 8 + size], row_bytes * count)
        place = 0
        for line in range(y - y0, y - y0 + count):
            for name, kind in channels:
                code, step = ("f", 4) if kind == 2 else ("e", 2)
                planes[name, line] = struct.unpack(
                    "<%d%s" % (width, code), raw[place : place + width * step])
                place += width * step
    rows = []
    for y in range(height):
        row = [0.0] * (3 * width)
        for c, name in enumerate("RGB"):
            row[c::3] = planes[name, y]
        rows.append(row)
    return Picture(width, height, 3, rows), attributes
