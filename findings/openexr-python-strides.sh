#!/usr/bin/env bash
# The OpenEXR Python module writes other pixels than those of a NumPy view.
#
# OpenEXR.File takes arrays for its channels. It reads the address of their first element and assumes that the rest follows
# without gaps: strides are ignored. A channel taken out of an image, `rgb[..., 1]`, is written as the interleaved numbers
# from there on: the picture has three columns for each of the left part of the original, in all its channels. A transposed
# view, or every second column, is wrong as well. Nothing is reported. numpy.ascontiguousarray around each array helps.
#
# Seen with OpenEXR 3.5.3 and NumPy 2.4.6 on x86-64.
# Needs Python 3.11 with venv, and pip. Fails if the behaviour changes.
set -euo pipefail

dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3.11 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet OpenEXR==3.5.3 numpy==2.4.6

cat >"$dir/views.py" <<'PYTHON'
import sys

import numpy
import OpenEXR

path = f'{sys.argv[1]}/z.exr'
header = {'compression': OpenEXR.NO_COMPRESSION, 'type': OpenEXR.scanlineimage}


def stored(array):
    OpenEXR.File(header, {'Z': array}).write(path)
    return OpenEXR.File(path).channels()['Z'].pixels


# The red channel is 0, 10, 20 ..., green 1, 11, 21 ..., blue 2, 12, 22 ...
rgb = (10 * numpy.arange(8).reshape(2, 4, 1) + numpy.arange(3)).astype(numpy.float32)
green = rgb[..., 1]
print('given ', green.tolist())
print('stored', stored(green).tolist())
assert numpy.array_equal(stored(numpy.ascontiguousarray(green)), green)
assert not numpy.array_equal(stored(green), green), 'strides are used now'
assert stored(green)[0].tolist() == [1, 2, 10, 11], 'other pixels are written now'
PYTHON
"$dir/venv/bin/python" "$dir/views.py" "$dir"
echo "ok: strides are ignored"
