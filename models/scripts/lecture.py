"""The lecture's two views of a small scene: lecture.obj/.mtl, lecture.glb, view-1.xml, view-2.xml.

Plain Python, no Blender. Both views are at (10, 4.2, 6) and look at the
origin; only the projection distance differs.
"""

from math import atan

from files import Gltf, folder, look_at, obj_object, write
from shapes import box, cylinder, grid, lathe, sphere

out = folder("lecture")
EYE, DIRECTION, WIDTH, HEIGHT = (10, 4.2, 6), (-5, -2.1, -3), 4, 2.25
VIEWS = {"view-1": 6, "view-2": 3}

for name, distance in VIEWS.items():
    write(
        out / f"{name}.xml",
        f"""<camera type="PerspectiveCamera">
  <viewPoint>10 4.2 6</viewPoint>
  <viewDir>-5 -2.1 -3</viewDir>
  <viewUp>0 1 0</viewUp>
  <projDistance>{distance}</projDistance>
  <viewWidth>4</viewWidth>
  <viewHeight>2.25</viewHeight>
</camera>
""",
    )

# name → (Shape with +Y up, material); the floor lies one unit under the origin.
PARTS = {
    "Floor": (grid(16, 16).y_up().moved(0, -1, 0), "Floor"),
    "Cube": (
        box(1.5, 1.5, 1.5)
        .map(lambda x, y, z: (0.8 * x - 0.6 * y, 0.6 * x + 0.8 * y, z))
        .y_up()
        .moved(1.1, -0.25, -1.35),
        "Red",
    ),
    "Sphere": (sphere(0.85, 48, 24).y_up().moved(0.2, -0.15, 0.35), "Blue"),
    "Cone": (lathe([(0, 0), (0.75, 0), (0, 1.9)], 48).y_up().moved(-1.3, -1, 1.9), "Green"),
    "Column": (cylinder(0.35, 2.6, 40).y_up().moved(-1.9, -1, -1.3), "Grey"),
    "Small sphere": (sphere(0.38, 32, 16).y_up().moved(2.0, -0.62, 1.1), "Gold"),
}
MATERIALS = {  # diffuse, specular, exponent
    "Floor": ((0.62, 0.6, 0.55), 0, 1),
    "Red": ((0.75, 0.14, 0.1), 0.2, 20),
    "Blue": ((0.12, 0.28, 0.7), 0.6, 100),
    "Green": ((0.16, 0.55, 0.22), 0.3, 30),
    "Grey": ((0.5, 0.5, 0.52), 0.1, 10),
    "Gold": ((0.8, 0.55, 0.12), 0.8, 300),
}

mtl = []
for name, (rgb, ks, exponent) in MATERIALS.items():
    mtl += [
        f"newmtl {name}",
        "Ka {} {} {}".format(*rgb),
        "Kd {} {} {}".format(*rgb),
        f"Ks {ks} {ks} {ks}",
        f"Ns {exponent}",
        f"illum {2 if ks else 1}",
        "",
    ]
write(out / "lecture.mtl", "\n".join(mtl))

obj, v, vt = ["mtllib lecture.mtl"], 1, 1
for name, (shape, material) in PARTS.items():
    shape.uvs = None
    obj.append(f"s {1 if 'phere' in name else 'off'}")
    v, vt = obj_object(obj, name.replace(" ", "_"), shape, material, v, vt)
write(out / "lecture.obj", "\n".join(obj) + "\n")

gltf = Gltf()
material = {
    name: gltf.material(name, rgb, 0, (2 / (exponent + 2)) ** 0.25 if ks else 1)
    for name, (rgb, ks, exponent) in MATERIALS.items()
}  # roughness from p = 2/roughness⁴ − 2
for name, (shape, mat) in PARTS.items():
    normals = None  # flat
    if "phere" in name:
        centre = [sum(axis) / len(axis) for axis in zip(*shape.verts)]
        radius = 0.85 if name == "Sphere" else 0.38
        normals = [[(p - c) / radius for p, c in zip(vert, centre)] for vert in shape.verts]
        normals = [[c / sum(d * d for d in n) ** 0.5 for c in n] for n in normals]
    gltf.node(name, mesh=gltf.mesh(name, shape, material[mat], normals))
for name, distance in VIEWS.items():
    camera = gltf.add(
        "cameras",
        {
            "type": "perspective",
            "name": name,
            "perspective": {"aspectRatio": WIDTH / HEIGHT, "yfov": 2 * atan(HEIGHT / 2 / distance), "znear": 0.1},
        },
    )
    gltf.node(name, camera=camera, **look_at(EYE, DIRECTION))
gltf.node(
    "Light", translation=[6, 8, 4.5], extensions=gltf.light(type="point", name="Light", color=[1, 1, 1], intensity=350)
)
gltf.node(
    "Fill light",
    translation=[7, 3, -6],
    extensions=gltf.light(type="point", name="Fill light", color=[0.8, 0.9, 1], intensity=60),
)
gltf.write_glb(out / "lecture.glb")
