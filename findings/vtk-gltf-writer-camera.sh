#!/usr/bin/env bash
# vtkGLTFWriter places its camera by the view matrix instead of the inverse.
#
# VTK has two ways to glTF: vtkGLTFExporter writes a render window, vtkGLTFWriter data sets without one. The latter frames
# the data with a camera of its own. The matrix of a glTF camera's node takes the camera to the world; the file has the matrix
# that takes the world to the camera, so a camera that should stand before the data stands behind it and looks away.
# Viewers with orbit controls of their own do not show it; renderers that use the file's camera show nothing.
#
# The camera is said to see from znear to zfar: the data are at these distances in front of the inverse, and behind the
# camera that is written.
#
# Seen with VTK 9.7.2 on x86-64: a sphere of radius .5 is 2.79 to 3.79 behind the camera.
# Needs Python 3.11 with venv, and pip; no display. Fails if the behaviour changes.
set -euo pipefail

dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3.11 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet vtk==9.7.2

cat >"$dir/camera.py" <<'PYTHON'
import json
import sys

import vtk

path = f'{sys.argv[1]}/sphere.gltf'
sphere = vtk.vtkSphereSource()
sphere.SetRadius(.5)
sphere.Update()
building, city = vtk.vtkMultiBlockDataSet(), vtk.vtkMultiBlockDataSet()
building.SetBlock(0, sphere.GetOutput())
city.SetBlock(0, building)
writer = vtk.vtkGLTFWriter()
writer.SetInputData(city)
writer.SetInlineData(True)
writer.SetFileName(path)
writer.Write()

with open(path) as file:
    gltf = json.load(file)
node = next(node for node in gltf['nodes'] if 'camera' in node)
lens = gltf['cameras'][node['camera']]['perspective']
# The camera is not rotated and looks along -z; the sphere is at the origin.
assert node['matrix'][:12] == [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]
z = node['matrix'][14]
print(f'camera at z = {z:.3f}, looks along -z, sees from {lens["znear"]:.2f} to {lens["zfar"]:.2f}')
print(f'the sphere reaches from {z - .5:.2f} to {z + .5:.2f} in front of it')
assert z + .5 < 0, 'the camera sees the sphere now'
assert lens['znear'] <= -z - .5 and -z + .5 <= lens['zfar'], 'the inverse would not see it either'
PYTHON
"$dir/venv/bin/python" "$dir/camera.py" "$dir"
echo "ok: the camera looks away from the data"
