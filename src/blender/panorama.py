"""Pictures of the world as files: the original if it is linear OpenEXR or Radiance, else a new Radiance picture."""

from __future__ import annotations

import os
import struct
from typing import NamedTuple

import bpy
import numpy

EXR_MAGIC = b"\x76\x2f\x31\x01"
RADIANCE_MAGICS = (b"#?RADIANCE", b"#?RGBE")
LINEAR = {"Linear Rec.709", "Linear", "Non-Color", "Raw"}


class EncodedImage(NamedTuple):
    """The bytes of a picture file."""

    data: bytes
    mime_type: str


def encode(image: bpy.types.Image) -> EncodedImage | None:
    """Returns a picture as a file; None if it has no pixels."""
    width, height = image.size
    if width * height == 0:
        return None
    data = original_bytes(image)
    if data is not None and not image.is_dirty and image.colorspace_settings.name in LINEAR:
        if data.startswith(EXR_MAGIC) and has_offsets(data):
            return EncodedImage(data, "image/x-exr")
        if data.startswith(RADIANCE_MAGICS):
            return EncodedImage(data, "image/vnd.radiance")
    return EncodedImage(radiance_bytes(linear_texels(image)), "image/vnd.radiance")


def has_offsets(exr: bytes) -> bool:
    """Returns True if the first block of an OpenEXR file has a place. Those that Blender 5.2 packs itself have none."""
    position = 8
    try:
        while exr[position] != 0:
            # Name, type and size of an attribute.
            position = exr.index(0, exr.index(0, position) + 1) + 1
            position += 4 + struct.unpack_from("<I", exr, position)[0]
        return any(exr[position + 1 : position + 9])
    except (IndexError, ValueError, struct.error):
        return False


def original_bytes(image: bpy.types.Image) -> bytes | None:
    """Returns the file of a picture, packed or on disk."""
    if image.source != "FILE":
        return None
    if image.packed_file is not None:
        return bytes(image.packed_file.data)
    path = bpy.path.abspath(image.filepath, library=image.library)
    if not os.path.isfile(path):
        return None
    with open(path, "rb") as file:
        return file.read()


def linear_texels(image: bpy.types.Image) -> numpy.ndarray:
    """Returns linear radiance, height x width x 3, with the uppermost row first."""
    width, height = image.size
    texels = numpy.empty(width * height * image.channels, dtype=numpy.float32)
    image.pixels.foreach_get(texels)
    texels = texels.reshape(height, width, image.channels)[::-1]
    colors = texels[..., :3] if image.channels >= 3 else numpy.repeat(texels[..., :1], 3, axis=2)
    # Blender holds pictures of floats in linear light, and pictures of bytes in their own colour space.
    if image.is_float or image.colorspace_settings.name in LINEAR:
        return colors
    return numpy.where(colors <= 0.04045, colors / 12.92, ((colors + 0.055) / 1.055) ** 2.4)


def radiance_bytes(texels: numpy.ndarray) -> bytes:
    """Returns a Radiance picture without run-length encoding, with 8 bits of mantissa."""
    height, width, _ = texels.shape
    texels = numpy.nan_to_num(numpy.maximum(texels, 0.0), posinf=65504.0)
    peak = texels.max(axis=2)
    _, exponent = numpy.frexp(peak)
    scale = numpy.where(peak > 1e-32, numpy.ldexp(1.0, 8 - exponent), 0.0)
    rgbe = numpy.empty((height, width, 4), dtype=numpy.uint8)
    rgbe[..., :3] = numpy.clip(texels * scale[..., None], 0, 255)
    rgbe[..., 3] = numpy.where(peak > 1e-32, numpy.clip(exponent + 128, 0, 255), 0)
    header = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n"
    return header.encode("ascii") + rgbe.tobytes()
