"""KHR_texture_basisu: a board with a base colour and a normal map in KTX2, its twin with PNGs, one with both, and one
with the images as files. Run after images.py and ktx2.mjs."""

import json

from glb import OUT, U16, Gltf
from shapes import flat, patch

shape, triangles = patch(4, 4, height=lambda u, v: 0.0)


def board(g, textures):
    """A patch with two UV-mapped textures; alpha is blended."""
    for kind, extension in (("VEC3", "POSITION"), ("VEC3", "NORMAL"), ("VEC2", "TEXCOORD_0")):
        shape_rows = shape[extension]
        g.json.setdefault("_a", {})[extension] = g.attribute(kind, shape_rows, bounds=extension == "POSITION")
    attributes = g.json.pop("_a")
    for i, (colour, normal, mode) in enumerate(textures):
        m = g.material(f"Board {i}", (1, 1, 1, 1))
        g.json["materials"][m]["pbrMetallicRoughness"]["baseColorTexture"] = {"index": colour}
        if normal is not None:
            g.json["materials"][m]["normalTexture"] = {"index": normal}
        g.json["materials"][m]["alphaMode"] = mode
        p = {"attributes": attributes, "indices": g.indices(flat(triangles), U16), "material": m}
        mesh = g.add("meshes", {"name": f"Board {i}", "primitives": [p]})
        g.node(f"Board {i}", mesh=mesh, translation=[2.2 * i, 0, 0])


def images(g, *names, linked=False):
    g.json.setdefault("samplers", [{"magFilter": 9729, "minFilter": 9987, "wrapS": 10497, "wrapT": 10497}])
    out = []
    for name in names:
        mime = "image/ktx2" if name.endswith(".ktx2") else "image/png"
        where = {"uri": f"ktx2/{name}"} if linked else {"bufferView": g.view((OUT / "ktx2" / name).read_bytes())}
        out.append(g.add("images", {"name": name, "mimeType": mime, **where}))
    return out


def texture(g, ktx=None, png=None):
    item = {"sampler": 0}
    if png is not None:
        item["source"] = png
    if ktx is not None:
        item["extensions"] = {"KHR_texture_basisu": {"source": ktx}}
    return g.add("textures", item)


KTX2 = ("colour_etc1s_mips.ktx2", "normal_uastc.ktx2", "busy_uastc_zstd.ktx2")
PNG = ("colour.png", "normal.png", "busy.png")

g = Gltf()
a, b, c = (texture(g, png=i) for i in images(g, *PNG))
board(g, [(a, b, "OPAQUE"), (c, None, "BLEND")])
g.write("basisu_twin.glb")

g = Gltf()
g.uses("KHR_texture_basisu", required=True)
a, b, c = (texture(g, ktx=i) for i in images(g, *KTX2))
board(g, [(a, b, "OPAQUE"), (c, None, "BLEND")])
g.write("basisu.glb")

g = Gltf()
g.uses("KHR_texture_basisu")
a, b = (texture(g, k, p) for k, p in zip(images(g, *KTX2[:2]), images(g, *PNG[:2])))
board(g, [(a, b, "OPAQUE"), (a, None, "OPAQUE")])
g.write("basisu_fallback.glb")

g = Gltf()
g.uses("KHR_texture_basisu", required=True)
linked = ("colour_uastc_zstd_mips.ktx2", "normal_etc1s.ktx2", "busy_etc1s_mips.ktx2")
a, b, c = (texture(g, ktx=i) for i in images(g, *linked, linked=True))
board(g, [(a, b, "OPAQUE"), (c, None, "BLEND")])
g.json["buffers"] = [{"uri": "basisu_linked.bin", "byteLength": len(g.buffer)}]
(OUT / "basisu_linked.bin").write_bytes(g.buffer)
(OUT / "basisu_linked.gltf").write_text(json.dumps(g.json, indent=1) + "\n")
