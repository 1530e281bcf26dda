#!/bin/sh
# Makes fixtures with gltfpack and glTF Transform. Run in this folder after sources.py.
set -e
OUT=../../tests/gltf
BIN=node_modules/.bin
pack() { node "$BIN/gltfpack" "$@" >/dev/null; }
transform() { node "$BIN/gltf-transform" "$@" >/dev/null 2>&1; }

# gltfpack without -c: quantization only (-kn keeps the names, -af 0 keeps the keys).
pack -i $OUT/torus.glb -o $OUT/torus_pack_quantised.glb -kn -km -kv -vp 14 -vt 12 -vn 8 -at 16 -ar 12
pack -i $OUT/patch.glb -o $OUT/patch_pack_quantised.glb -kn -km -kv -vp 12
pack -i $OUT/patch.glb -o $OUT/patch_pack_normalised.glb -kn -km -kv -vpn -vn 8
pack -i $OUT/mixed.glb -o $OUT/mixed_pack_quantised.glb -kn -km -kv -vi
# EXT_meshopt_compression.
pack -i $OUT/torus.glb -o $OUT/torus_pack_c.glb -kn -km -kv -c
pack -i $OUT/torus.glb -o $OUT/torus_pack_cc.glb -kn -km -kv -cc -af 0
pack -i $OUT/patch.glb -o $OUT/patch_pack_cc.glb -kn -km -kv -cc
pack -i $OUT/patch.glb -o $OUT/patch_pack_cf.gltf -kn -km -kv -c -cf
pack -i $OUT/ring.glb -o $OUT/ring_pack_cc_noq.glb -kn -km -cc -noq
pack -i $OUT/mixed.glb -o $OUT/mixed_pack_cc.glb -kn -km -kv -cc -vpf
pack -i $OUT/instances.glb -o $OUT/instances_pack_mi.glb -km -mi -noq
pack -i $OUT/instances.glb -o $OUT/instances_pack_mi_cc.glb -km -mi -cc
# KHR_meshopt_compression (vertex codec version 1, the COLOR filter).
pack -i $OUT/torus.glb -o $OUT/torus_pack_khr_cz.glb -kn -km -kv -cz -ce khr -vc 12 -vn 12
pack -i $OUT/instances.glb -o $OUT/instances_pack_khr_mi.glb -km -mi -cc -ce khr
pack -i $OUT/patch.glb -o $OUT/patch_pack_khr_cf.gltf -kn -km -kv -c -ce khr -cf

# glTF Transform.
transform meshopt $OUT/patch.glb $OUT/patch_gt_meshopt_medium.glb --level medium
transform meshopt $OUT/torus.glb $OUT/torus_gt_meshopt_high.glb --level high
transform quantize $OUT/torus.glb $OUT/torus_gt_quantised.glb
transform quantize $OUT/patch.glb $OUT/patch_gt_quantised.glb --quantize-position 10
transform draco $OUT/torus.glb $OUT/torus_gt_draco.glb --method edgebreaker
transform draco $OUT/mixed.glb $OUT/mixed_gt_draco.glb --method sequential --quantize-position 11
transform draco $OUT/patch.glb $OUT/patch_gt_draco.glb
