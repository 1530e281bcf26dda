"""The PNG originals of the KTX2 files, and KTX2 files of plain formats by the KTX 2.0 specification (tests/gltf/ktx2/).

Needs `pip install zstandard` for the one file with Zstandard."""

import json
import struct
import zlib
from math import cos, exp, hypot, pi, sin

import zstandard

from glb import OUT, png

KTX = OUT / "ktx2"
KTX.mkdir(parents=True, exist_ok=True)


def clamp(v):
    return max(0, min(255, round(v)))


def colour(x, y, n=32):
    u, v = x / (n - 1), y / (n - 1)
    if hypot(u - 0.35, v - 0.4) < 0.2:
        return (230, 60, 30)
    if x > 22 and y > 20:
        return (250, 250, 240) if (x // 3 + y // 3) % 2 else (20, 30, 60)
    return (clamp(40 + 180 * u), clamp(90 + 120 * v), clamp(200 - 150 * u * v))


def alpha(x, y, w=30, h=22):
    d = hypot((x + 0.5) / w - 0.5, ((y + 0.5) / h - 0.5))
    return (clamp(255 * x / (w - 1)), clamp(200 - 100 * y / (h - 1)), 60, clamp(255 * (0.5 - d) * 6))


def normal(x, y, n=32):
    a, b = 2 * pi * x / n, 2 * pi * y / n
    v = (0.6 * sin(a), 0.6 * cos(b), 1)
    s = 127.5 / (sum(c * c for c in v) ** 0.5)
    return tuple(clamp(127.5 + c * s) for c in v)


def busy(x, y):
    """Blocks of many kinds: flat, gradients, two and three colours, noise, grey, with and without alpha."""
    bx, by = x // 4, y // 4
    k, i, j = (bx * 7 + by * 3) % 11, x % 4, y % 4
    r, g, b = 40 + 12 * bx, 60 + 10 * by, 255 - 8 * (bx + by)
    noise = (x * 7919 + y * 104729 + x * y * 31) % 97
    a = 255 if by < 8 else [255, 128, 30 + 50 * i, clamp(255 * exp(-((i - 1.5) ** 2 + (j - 1.5) ** 2) / 4))][bx % 4]
    if k == 0:
        c = (r, g, b)
    elif k < 3:
        c = (r + 8 * i, g + 6 * j, b - 5 * i)
    elif k < 5:
        c = (r, g, b) if i < 2 else (b, r, g)
    elif k == 5:
        c = [(255, 30, 30), (30, 200, 40), (20, 40, 220)][(i + j) % 3]
    elif k == 6:
        c = (r + noise, g + noise // 2, b - noise)
    elif k == 7:
        c = (noise * 2,) * 3
    elif k == 8:
        c = (r + 20 * i, 255 - g - 20 * j, 128)
    elif k == 9:
        c = (r, 40 * j, b) if i > j else (255 - r, 255 - 30 * i, g)
    else:
        c = (r + noise // 4, g, b)
    return tuple(clamp(v) for v in c) + (a,)


def rows(f, w, h):
    return [[f(x, y) for x in range(w)] for y in range(h)]


IMAGES = {
    "colour": rows(colour, 32, 32),
    "alpha": rows(alpha, 30, 22),
    "normal": rows(normal, 32, 32),
    "busy": rows(busy, 64, 64),
}
for name, pixels in IMAGES.items():
    (KTX / f"{name}.png").write_bytes(png(pixels))


def halve(image):
    """The next mip level: a box over 2 × 2 (the last row or column again where the size is odd), rounded."""
    h, w = len(image), len(image[0])
    return [
        [
            tuple(
                (sum(image[min(2 * y + j, h - 1)][min(2 * x + i, w - 1)][c] for i in (0, 1) for j in (0, 1)) + 2) // 4
                for c in range(len(image[0][0]))
            )
            for x in range(max(1, w // 2))
        ]
        for y in range(max(1, h // 2))
    ]


# Vulkan format: code, channels, is sRGB, is BGRA.
FORMATS = {
    "r8_unorm": (9, 1, False),
    "r8g8_unorm": (16, 2, False),
    "r8g8b8_unorm": (23, 3, False),
    "r8g8b8_srgb": (29, 3, True),
    "r8g8b8a8_unorm": (37, 4, False),
    "r8g8b8a8_srgb": (43, 4, True),
    "b8g8r8a8_srgb": (50, 4, True),
}


def descriptor(channels, srgb, swapped, scheme):
    """A basic data format descriptor: model RGBSDA, primaries BT.709, straight alpha."""
    ids = [0, 1, 2, 15][:channels] if not swapped else [2, 1, 0, 15]
    samples = b""
    for i, id_ in enumerate(ids):
        linear = 0x10 if srgb and id_ == 15 else 0
        samples += struct.pack("<HBBIII", 8 * i, 7, id_ | linear, 0, 0, 255)
    size = 24 + len(samples)
    head = struct.pack("<IHH", 0, 2, size)
    planes = bytes([0 if scheme in (2, 3) else channels, 0, 0, 0, 0, 0, 0, 0])
    block = head + struct.pack("<BBBB4B", 1, 1, 2 if srgb else 1, 0, 0, 0, 0, 0) + planes + samples
    return struct.pack("<I", 4 + len(block)) + block


def ktx2(name, image, format_, mips=False, scheme=0, written=None):
    code, channels, srgb = FORMATS[format_]
    swapped = format_.startswith("b8")
    levels = [image]
    while mips and (len(levels[-1]) > 1 or len(levels[-1][0]) > 1):
        levels.append(halve(levels[-1]))

    def pack(level):
        out = bytearray()
        for row in level:
            for p in row:
                p = (tuple(p) + (255,) * 4)[:channels] if channels > len(p) else tuple(p)[:channels]
                out += bytes((p[2], p[1], p[0], p[3]) if swapped else p)
        return bytes(out)

    raw = [pack(level) for level in levels]
    stored = [
        zstandard.ZstdCompressor(level=19).compress(r) if scheme == 2 else zlib.compress(r, 9) if scheme == 3 else r
        for r in raw
    ]
    dfd = descriptor(channels, srgb, swapped, scheme)
    pairs = b""
    for key, value in ((b"KTXorientation", b"rd\0"), (b"KTXwriter", b"blinn test fixtures\0")):
        pair = key + b"\0" + value
        pairs += struct.pack("<I", len(pair)) + pair + bytes(-len(pair) % 4)
    start = 80 + 24 * len(levels)
    kvd = start + len(dfd)
    at = kvd + len(pairs)
    align = 1 if scheme else {1: 4, 2: 4, 3: 12, 4: 4}[channels]
    body, index = b"", [None] * len(levels)
    for i in reversed(range(len(levels))):
        pad = -(at + len(body)) % align
        body += bytes(pad)
        index[i] = (at + len(body), len(stored[i]), len(raw[i]))
        body += stored[i]
    header = b"\xabKTX 20\xbb\r\n\x1a\n" + struct.pack(
        "<9I", code, 1, len(image[0]), len(image), 0, 0, 1, len(levels), scheme
    )
    header += struct.pack("<4I2Q", start, len(dfd), kvd, len(pairs), 0, 0)
    data = header + b"".join(struct.pack("<3Q", *t) for t in index) + dfd + pairs + body
    (KTX / name).write_bytes(data)
    return [
        {"width": len(level[0]), "height": len(level), "bytes": len(r), "crc32": f"{zlib.crc32(r):08x}"}
        for level, r in zip(levels, raw)
    ]


plain = {}
for name, image, format_, options in (
    ("plain_rgba8_srgb_mips.ktx2", "alpha", "r8g8b8a8_srgb", {"mips": True}),
    ("plain_rgba8_unorm.ktx2", "alpha", "r8g8b8a8_unorm", {}),
    ("plain_bgra8_srgb.ktx2", "alpha", "b8g8r8a8_srgb", {}),
    ("plain_rgb8_srgb_mips.ktx2", "colour", "r8g8b8_srgb", {"mips": True}),
    ("plain_rg8_unorm.ktx2", "normal", "r8g8_unorm", {}),
    ("plain_r8_unorm.ktx2", "colour", "r8_unorm", {}),
    ("plain_rgba8_srgb_zstd_mips.ktx2", "alpha", "r8g8b8a8_srgb", {"mips": True, "scheme": 2}),
    ("plain_rgb8_unorm_zlib_mips.ktx2", "normal", "r8g8b8_unorm", {"mips": True, "scheme": 3}),
):
    plain[name] = {"original": f"{image}.png", "format": format_, "levels": ktx2(name, IMAGES[image], format_, **options)}
(KTX / "plain.json").write_text(
    "{\n" + ",\n".join(f"  {json.dumps(k)}: {json.dumps(v)}" for k, v in plain.items()) + "\n}\n"
)
