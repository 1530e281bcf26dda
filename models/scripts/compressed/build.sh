#!/bin/sh
# Makes every fixture in ../../tests/gltf. Needs: node 20 and `npm install` here; Python 3.11 with zstandard ($PYTHON); Blender
# 5.0.1 as a module ($BPY).
set -e
cd "$(dirname "$0")"
PYTHON=${PYTHON:-python3}
BPY=${BPY:-python3}
rm -rf ../../tests/gltf
"$PYTHON" sources.py
"$PYTHON" images.py
node draco.mjs
node meshopt.mjs
sh tools.sh
node ktx2.mjs >/dev/null
node uastc_random.mjs
"$PYTHON" textured.py
"$BPY" blender.py >/dev/null 2>&1
node expect.mjs
"$PYTHON" readme.py
