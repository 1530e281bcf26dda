#!/usr/bin/env bash
# VTK's glTF exporter writes colours of cells as one COLOR_0 element for each triangle.
#
# A mapper may take its colours from the cells of a mesh: vtkMapper.SetScalarModeToUseCellData, which simulation results do.
# In the window each cell is uniform. vtkGLTFExporter stores these colours in an attribute of vertices, without copying them
# to vertices: 2 quads have 6 vertices and 4 elements of COLOR_0, one for each triangle. The file is invalid, as all attributes
# of a primitive must have the same count. Readers refuse it, drop the colours, or read past the end of the accessor. A mesh
# with as many triangles as vertices looks valid and shows colours of cells at unrelated corners. No message says so.
#
# Converting cell data to point data before the export (vtkCellDataToPointData) helps.
#
# Seen with VTK 9.7.2 on x86-64: 6 positions, 4 colours.
# Needs Python 3.11 with venv, and pip; no display. Fails if the behaviour changes.
set -euo pipefail

dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3.11 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet vtk==9.7.2

cat >"$dir/cells.py" <<'PYTHON'
import json
import sys

import vtk

path = f'{sys.argv[1]}/cells.gltf'
plane = vtk.vtkPlaneSource()
plane.SetResolution(2, 1)
plane.Update()
colors = vtk.vtkUnsignedCharArray()
colors.SetNumberOfComponents(3)
colors.InsertNextTuple3(255, 0, 0)
colors.InsertNextTuple3(0, 0, 255)
plane.GetOutput().GetCellData().SetScalars(colors)
mapper = vtk.vtkPolyDataMapper()
mapper.SetInputData(plane.GetOutput())
mapper.SetScalarModeToUseCellData()
actor = vtk.vtkActor()
actor.SetMapper(mapper)
renderer = vtk.vtkRenderer()
renderer.AddActor(actor)
window = vtk.vtkRenderWindow()
window.SetOffScreenRendering(1)
window.AddRenderer(renderer)
exporter = vtk.vtkGLTFExporter()
exporter.SetRenderWindow(window)
exporter.SetFileName(path)
exporter.InlineDataOn()
exporter.Write()

with open(path) as file:
    gltf = json.load(file)
attributes = gltf['meshes'][0]['primitives'][0]['attributes']
counts = {name: gltf['accessors'][index]['count'] for name, index in attributes.items()}
print('VTK', vtk.vtkVersion.GetVTKVersion(), counts)
assert (counts['POSITION'], counts['COLOR_0']) == (6, 4), 'colours belong to vertices now'
PYTHON
"$dir/venv/bin/python" "$dir/cells.py" "$dir"
echo "ok: 4 colours for 6 vertices"
