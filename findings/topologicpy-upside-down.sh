#!/usr/bin/env bash
# TopologicPy exports OBJ files upside down.
#
# Topology.ExportToOBJ has transposeAxes=True by default, "so that Y points up". Z is up in TopologicPy, and Y in most programs
# that read OBJ. But (x, y, z) becomes (x, -z, y): the top of a tower is below its foot. A box looks right.
# The file always names `example.mtl`, while ExportToOBJ writes an MTL with the name of the OBJ: readers that do not search for
# other names show no colours.
#
# transposeAxes=False and a reader's "Z up" help.
#
# Seen with TopologicPy 0.9.87 and topologic_core 8.0.4 on x86-64: a point at z = 3 is written with y = -3.
# Needs Python 3.11 with venv, and pip. Fails if the behaviour changes.
set -euo pipefail

dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3.11 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet topologicpy==0.9.87 topologic_core==8.0.4

cat >"$dir/tower.py" <<'PYTHON'
import os
import sys

from topologicpy.Face import Face
from topologicpy.Topology import Topology
from topologicpy.Vertex import Vertex

os.chdir(sys.argv[1])
foot_foot_top = [(1, 2, 0), (5, 2, 0), (3, 2, 3)]
face = Face.ByVertices([Vertex.ByCoordinates(*point) for point in foot_foot_top])
assert Topology.ExportToOBJ(face, path='tower.obj')

with open('tower.obj') as file:
    lines = file.read().splitlines()
points = {tuple(map(float, line.split()[1:])) for line in lines if line.startswith('v ')}
for point in sorted(points):
    print('v', *point)
expected = {(x, -z, y) for x, y, z in map(lambda point: map(float, point), foot_foot_top)}
assert points == expected, 'the axes are turned in another way now'
assert 'Y points "up"' in Topology.ExportToOBJ.__doc__, 'the documentation does not promise that Y is up now'
library = next(line.split()[1] for line in lines if line.startswith('mtllib'))
print('mtllib', library, 'beside', sorted(name for name in os.listdir('.') if name.endswith('.mtl')))
assert not os.path.exists(library), 'the named library is written now'
PYTHON
"$dir/venv/bin/python" "$dir/tower.py" "$dir"
echo "ok: the top is at y = -3, and the named MTL does not exist"
