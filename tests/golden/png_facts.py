#!/usr/bin/python3
"""png_facts.py FILE: prints "WIDTHxHEIGHT COLOURS" of an 8 or 16 bit PNG.

Standard library only, because quickstart runs it on a bare system.
"""
import struct
import sys
import zlib


def read_png(data):
    """width, height, channels, bytes per sample, rows of raw bytes."""
    if data[:8] != b"\x89PNG\r\n\x1a\n":
        raise ValueError("not a PNG file")
    at, packed = 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        chunk = data[at + 8:at + 8 + length]
        if zlib.crc32(kind + chunk) != struct.unpack(">I", data[at + 8 + length:at + 12 + length])[0]:
            raise ValueError("a broken chunk")
        if kind == b"IHDR":
            width, height, depth, color, _, _, interlace = struct.unpack(">IIBBBBB", chunk)
        elif kind == b"IDAT":
            packed += chunk
        at += 12 + length
    if interlace:
        raise ValueError("interlaced")
    channels = {0: 1, 2: 3, 4: 2, 6: 4}[color]
    size = depth // 8
    pixel = channels * size
    raw = zlib.decompress(packed)
    rows, last = [], bytes(width * pixel)
    for y in range(height):
        start = y * (1 + width * pixel)
        rows.append(unfilter(raw[start], bytearray(raw[start + 1:start + 1 + width * pixel]), last, pixel))
        last = rows[-1]
    return width, height, channels, size, rows


def unfilter(kind, row, last, pixel):
    if kind == 2:
        return bytes((a + b) & 255 for a, b in zip(row, last))
    for i in range(len(row)) if kind else ():
        left = row[i - pixel] if i >= pixel else 0
        up, corner = last[i], last[i - pixel] if i >= pixel else 0
        if kind == 1:
            row[i] = (row[i] + left) & 255
        elif kind == 3:
            row[i] = (row[i] + (left + up) // 2) & 255
        elif kind == 4:
            guess = left + up - corner
            near = min((abs(guess - left), 0, left), (abs(guess - up), 1, up),
                       (abs(guess - corner), 2, corner))
            row[i] = (row[i] + near[2]) & 255
    return bytes(row)


def main():
    with open(sys.argv[1], "rb") as file:
        width, height, channels, size, rows = read_png(file.read())
    pixel = channels * size
    colors = {row[i:i + pixel] for row in rows for i in range(0, len(row), pixel)}
    print(f"{width}x{height} {len(colors)}")


if __name__ == "__main__":
    main()
