#!/usr/bin/env bash
# gltf-builder writes the login name of its user into every glTF file.
#
# Builder.build() fills asset.extras with the login name of the user who runs it and the full name in the system's list of users,
# with the versions of Python and NumPy, and the time. Nobody asked for it, and a picture does not show it. Files that are
# published name the account, and the same scene is another file at each build, which defeats caches and checksums.
#
# Deleting asset.extras before the file is saved helps.
#
# Seen with gltf-builder 0.1.8 on x86-64 under Linux: extras.username is $LOGNAME.
# Needs Python 3.11 with venv, and pip. Fails if the behaviour changes.
set -euo pipefail

dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3.11 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet gltf-builder==0.1.8

cat >"$dir/triangle.py" <<'PYTHON'
import json
import struct
import sys

from gltf_builder import Builder, PrimitiveMode

path = f'{sys.argv[1]}/triangle.glb'
builder = Builder()
mesh = builder.add_mesh('triangle')
mesh.add_primitive(PrimitiveMode.TRIANGLES, (0, 0, 0), (1, 0, 0), (0, 1, 0))
builder.add_node(name='node', mesh=mesh)
builder.build().save_binary(path)

with open(path, 'rb') as file:
    data = file.read()
size = struct.unpack_from('<I', data, 12)[0]
extras = json.loads(data[20:20 + size])['asset']['extras']
print(sorted(extras), extras['username'])
assert extras['username'] == 'alice-the-author', 'the login name is left out now'
PYTHON
LOGNAME=alice-the-author "$dir/venv/bin/python" "$dir/triangle.py" "$dir"
echo "ok: the file names its user"
