"""A wooden mannequin that walks on the spot and breathes: skin, 17 bones, one shape key, 48 frames at 24 fps."""

from math import cos, pi, radians, sin

import bpy
from mathutils import Quaternion, Vector

from blend import add, camera, export_gltf, light, material, mesh, new_scene, place
from files import folder
from shapes import Shape, grid, sphere

out = folder("figure")
scene = new_scene(720, 960)
scene.frame_start, scene.frame_end = 1, 48

# Bones: name → (parent, head, tail). The figure looks towards −Y; its left is +X.
BONES = {
    "hips": (None, (0, 0, 0.95), (0, 0, 1.08)),
    "spine": ("hips", (0, 0, 1.08), (0, 0, 1.25)),
    "chest": ("spine", (0, 0, 1.25), (0, 0, 1.48)),
    "neck": ("chest", (0, 0, 1.48), (0, 0, 1.58)),
    "head": ("neck", (0, 0, 1.58), (0, 0, 1.82)),
}
for side, x in (("L", 1), ("R", -1)):
    BONES |= {
        f"upper_arm.{side}": ("chest", (0.2 * x, 0, 1.43), (0.27 * x, 0, 1.15)),
        f"forearm.{side}": (f"upper_arm.{side}", (0.27 * x, 0, 1.15), (0.31 * x, -0.02, 0.89)),
        f"hand.{side}": (f"forearm.{side}", (0.31 * x, -0.02, 0.89), (0.325 * x, -0.03, 0.72)),
        f"thigh.{side}": ("hips", (0.1 * x, 0, 0.92), (0.1 * x, -0.01, 0.5)),
        f"shin.{side}": (f"thigh.{side}", (0.1 * x, -0.01, 0.5), (0.1 * x, 0.02, 0.09)),
        f"foot.{side}": (f"shin.{side}", (0.1 * x, 0.02, 0.09), (0.1 * x, -0.15, 0.03)),
    }

data = bpy.data.armatures.new("Armature")
rig = place("Armature", data)
bpy.context.view_layer.objects.active = rig
bpy.ops.object.mode_set(mode="EDIT")
for name, (parent, head, tail) in BONES.items():
    bone = data.edit_bones.new(name)
    bone.head, bone.tail = head, tail
    bone.roll = 0
    if parent:
        bone.parent = data.edit_bones[parent]
        bone.use_connect = (Vector(data.edit_bones[parent].tail) - Vector(head)).length < 1e-6
bpy.ops.object.mode_set(mode="OBJECT")


# The skin: tubes along chains of bones. Each ring near a joint is shared smoothly by the two bones.
def tube(chain, radii, n=20, flat=1.0, rings=9):
    """(Shape, weights) of a limb through the bones of a chain; radii at each joint and the end."""
    joints = [Vector(BONES[chain[0]][1])] + [Vector(BONES[b][2]) for b in chain]
    verts, weights = [], []
    for k, bone in enumerate(chain):
        for i in range(rings + (k == len(chain) - 1)):
            t = i / rings
            centre = joints[k].lerp(joints[k + 1], t)
            r = radii[k] + (radii[k + 1] - radii[k]) * t + 0.012 * sin(pi * t)
            before = max(0, 0.5 - t / 0.5) if k else 0  # first half: the bone before
            after = max(0, 0.5 - (1 - t) / 0.5) if k < len(chain) - 1 else 0  # second half: the bone after
            share = {bone: 1 - before - after}
            if before:
                share[chain[k - 1]] = before
            if after:
                share[chain[k + 1]] = after
            along = (joints[k + 1] - joints[k]).normalized()
            across = Vector((1, 0, 0)) if abs(along.x) < 0.9 else Vector((0, 0, 1))
            v = along.cross(across).normalized()
            u = v.cross(along)
            for j in range(n):
                a = 2 * pi * j / n
                verts.append(tuple(centre + u * (r * cos(a)) + v * (r * flat * sin(a))))
                weights.append(share)
    count = len(verts) // n
    faces = [
        (i * n + j, i * n + (j + 1) % n, (i + 1) * n + (j + 1) % n, (i + 1) * n + j)
        for i in range(count - 1)
        for j in range(n)
    ]
    # Rounded ends: three shrinking rings and a tip.
    for first, sign, r, bone, tip in (
        (0, -1, radii[0], chain[0], joints[0]),
        ((count - 1) * n, 1, radii[-1], chain[-1], joints[-1]),
    ):
        ends = (joints[1] - joints[0]) if sign < 0 else (joints[-1] - joints[-2])
        step = ends.normalized() * sign
        loop = list(range(first, first + n))
        centre = tip
        for q in (30, 60, 80):
            new = []
            for index in loop[:n]:
                rim = Vector(verts[first + len(new)]) - tip
                new.append(len(verts))
                verts.append(tuple(tip + rim * cos(radians(q)) + step * (r * 0.8 * sin(radians(q)))))
                weights.append({bone: 1})
            for j in range(n):
                quad = (loop[j], loop[(j + 1) % n], new[(j + 1) % n], new[j])
                faces.append(quad if sign > 0 else tuple(reversed(quad)))
            loop = new
        faces.append(tuple(loop) if sign > 0 else tuple(reversed(loop)))
    return verts, faces, weights


def ball(bone, at, r, stretch=(1, 1, 1), n=28):
    """A sphere that follows one bone."""
    s = sphere(r, n, n // 2).scaled(*stretch).moved(*at)
    return s.verts, s.faces, [{bone: 1}] * len(s.verts)


WOOD, JOINT = 0, 1
parts = [
    (WOOD, tube(["hips", "spine", "chest"], [0.125, 0.105, 0.135, 0.13], 32, 0.68, 10)),
    (WOOD, tube(["neck"], [0.05, 0.045], 20)),
    (WOOD, ball("head", (0, -0.01, 1.71), 0.115, (0.88, 1, 1.22), 36)),
    (JOINT, ball("head", (0, -0.125, 1.70), 0.018)),
]
for side, x in (("L", 1), ("R", -1)):
    parts += [
        (WOOD, tube([f"upper_arm.{side}", f"forearm.{side}", f"hand.{side}"], [0.058, 0.047, 0.034, 0.03], 20)),
        (WOOD, tube([f"thigh.{side}", f"shin.{side}"], [0.088, 0.062, 0.042], 24)),
        (WOOD, tube([f"foot.{side}"], [0.05, 0.034], 20, 0.8)),
        (JOINT, ball(f"upper_arm.{side}", (0.205 * x, 0, 1.43), 0.068)),
        (JOINT, ball(f"shin.{side}", (0.1 * x, -0.01, 0.5), 0.071)),
    ]

verts, faces, weights, materials = [], [], [], []
for kind, (v, f, w) in parts:
    materials += [kind] * len(f)
    faces += [tuple(i + len(verts) for i in face) for face in f]
    verts += v
    weights += w

body_mesh = mesh("Body", Shape(verts, faces), material("Pale wood", "#d9a866", 0.38), 60)
body_mesh.materials.append(material("Dark joints", "#5a3320", 0.3))
body_mesh.polygons.foreach_set("material_index", materials)
body = place("Body", body_mesh, parent=rig)
for index, share in enumerate(weights):
    for bone, weight in share.items():
        group = body.vertex_groups.get(bone) or body.vertex_groups.new(name=bone)
        group.add([index], weight, "REPLACE")
body.modifiers.new("Armature", "ARMATURE").object = rig

# The shape key: the chest swells.
body.shape_key_add(name="Basis")
breath = body.shape_key_add(name="Breath")
for index, (x, y, z) in enumerate(verts):
    share = weights[index]
    if "hand" in str(share) or "arm" in str(share) or "head" in share or "neck" in share:
        continue
    swell = max(0, cos((z - 1.36) / 0.22 * pi / 2)) if abs(z - 1.36) < 0.22 else 0
    breath.data[index].co = (x * (1 + 0.12 * swell), y * (1 + 0.3 * swell), z + 0.01 * swell)

# The action: a walk on the spot, two steps in 48 frames; frame 49 would repeat frame 1.
rig.animation_data_create()
rig.animation_data.action = bpy.data.actions.new("Walk")
for bone in rig.pose.bones:
    bone.rotation_mode = "QUATERNION"


def turn(name, axis, degrees):
    """Rotates a bone about an axis of the armature (X: forward and back), whatever the bone's own axes."""
    bone = rig.pose.bones[name]
    local = bone.bone.matrix_local.to_quaternion().inverted() @ Vector(axis)
    return Quaternion(local, radians(degrees))


X, Y, Z = (1, 0, 0), (0, 1, 0), (0, 0, 1)
for frame in range(1, 50, 3):
    t = 2 * pi * (frame - 1) / 48
    pose = {
        "hips": turn("hips", Z, 6 * sin(t)),
        "spine": turn("spine", Z, -6 * sin(t)) @ turn("spine", X, 3),
        "chest": turn("chest", Z, -6 * sin(t)),
        "neck": turn("neck", Z, 4 * sin(t)),
        "head": turn("head", X, 3 * sin(2 * t)) @ turn("head", Z, 2 * sin(t)),
    }
    for side, phase, x in (("L", 0, 1), ("R", pi, -1)):
        swing = sin(t + phase)
        lift = max(0, cos(t + phase))
        pose |= {
            f"thigh.{side}": turn(f"thigh.{side}", X, -28 * swing - 14 * lift),
            f"shin.{side}": turn(f"shin.{side}", X, 8 + 46 * lift),
            f"foot.{side}": turn(f"foot.{side}", X, 14 * swing - 8 * lift),
            f"upper_arm.{side}": turn(f"upper_arm.{side}", X, 30 * swing) @ turn(f"upper_arm.{side}", Y, -6 * x),
            f"forearm.{side}": turn(f"forearm.{side}", X, -22 + 14 * swing),
            f"hand.{side}": turn(f"hand.{side}", X, -8 + 6 * swing),
        }
    for name, rotation in pose.items():
        bone = rig.pose.bones[name]
        bone.rotation_quaternion = rotation
        bone.keyframe_insert("rotation_quaternion", frame=frame)
    hips = rig.pose.bones["hips"]
    hips.location = (0, 0.022 * cos(2 * t) - 0.03, 0)  # a bone's own +Y is along it: up
    hips.keyframe_insert("location", frame=frame)

keys = body_mesh.shape_keys
keys.animation_data_create()
keys.animation_data.action = bpy.data.actions.new("Breathing")
for frame, value in ((1, 0), (13, 1), (25, 0), (37, 1), (49, 0)):
    breath.value = value
    breath.keyframe_insert("value", frame=frame)
scene.frame_set(1)

add("Floor", grid(6, 6), material("Floor", "#6d7f86", 0.8))
light("Key", "SPOT", (-1.8, -2.6, 3.2), 700, (0, 0, 1), "#ffe2bd", cone=50, blend=0.4, radius=0.05)
light("Fill", "POINT", (2.2, -1.8, 1.6), 70, color="#cfe0ff", radius=0.1)
light("Rim", "POINT", (0.8, 2.0, 2.4), 90, radius=0.05)
camera("Camera", (1.5, -3.4, 1.45), (0, 0, 0.93), fov=34)

# One range for both: frames 1 to 48.
export_gltf(out / "figure.glb", export_apply=False, export_frame_range=True)
