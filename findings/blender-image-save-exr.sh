#!/usr/bin/env bash
# Image.save() of Blender's Python API writes displayed colours into OpenEXR files.
#
# An image of floats that a script makes with bpy.data.images.new, tags as "Linear Rec.709" and fills holds linear radiance.
# Saved as OPEN_EXR, a format that is linear by convention, it is encoded with the sRGB curve first: a sun of 3000 becomes
# 29.6, and 0.2 becomes 0.485. The file says so only in the attribute colorInteropID, which most readers ignore, and the
# image's own colour space is sRGB afterwards. An environment map that is made in this way has no sun. The order of statements
# decides more: if the colour space is set last, the pixels are lost and the file with the name .exr is a PNG. Images
# that are made with is_data=True are written as they are.
#
# Seen with bpy 5.0.1 and OpenEXR 3.4.2 on x86-64.
# Needs Python 3.11 with venv, and pip. Fails if the behaviour changes.
set -euo pipefail

dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3.11 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet bpy==5.0.1 OpenEXR==3.4.2

cat >"$dir/save.py" <<'PYTHON'
import sys

import bpy
import numpy

folder = sys.argv[-1]
texels = numpy.ones((4, 4, 4), numpy.float32)
texels[..., :3] = 3000, 1, .2


def save(name, space_last=False, **kind):
    image = bpy.data.images.new(name, 4, 4, float_buffer=True, **kind)
    if not kind and not space_last:
        image.colorspace_settings.name = 'Linear Rec.709'
    image.pixels.foreach_set(texels.ravel())
    image.filepath_raw = f'{folder}/{name}.exr'
    image.file_format = 'OPEN_EXR'
    if space_last:
        image.colorspace_settings.name = 'Linear Rec.709'
    before = image.colorspace_settings.name
    image.save()
    print(f'{name}: colour space {before} before, {image.colorspace_settings.name} after saving')


save('linear')
save('space_last', space_last=True)
save('data', is_data=True)
PYTHON

cat >"$dir/look.py" <<'PYTHON'
import sys

import OpenEXR

folder = sys.argv[-1]


def look(name):
    file = OpenEXR.File(f'{folder}/{name}.exr')
    channels = file.channels()
    texel = next(iter(channels.values())).pixels[0, 0][:3]
    print(name, [round(float(v), 3) for v in texel], file.header().get('colorInteropID'))
    return texel


encoded = look('linear')
assert abs(encoded[0] - 29.597) < .01 and abs(encoded[2] - .485) < .001, 'linear values are linear now'
assert abs(look('data')[0] - 3000) < 1
with open(f'{folder}/space_last.exr', 'rb') as file:
    start = file.read(8)
print('space_last.exr starts with', start)
assert start[1:4] == b'PNG', 'it is no PNG now'
PYTHON

"$dir/venv/bin/python" "$dir/save.py" -- "$dir"
"$dir/venv/bin/python" "$dir/look.py" "$dir"
echo "ok: Image.save() writes displayed colours into OpenEXR files"
