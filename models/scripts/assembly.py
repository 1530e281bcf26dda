"""A planetary gear with its housing cut open: few meshes, many instances, a node tree, mirrored halves.

The shafts lie along X. Both ends are one set of meshes: the left end hangs
below an empty scaled by −1 in X. Bolts, washers, nuts, pins, planets and balls
are linked duplicates, so glTF stores each mesh once.
"""

from math import atan2, cos, hypot, pi, radians, sin

from blend import add, bevelled, camera, export_gltf, light, material, mesh, new_scene, place
from files import folder
from shapes import Shape, box, cylinder, gear_outline, grid, hexagon, join, lathe, prism_with_bore, ring, sphere

out = folder("assembly")
new_scene(1280, 720)

steel = material("Steel", (0.8, 0.8, 0.82), 0.45, 1.0)
dark = material("Dark steel", (0.5, 0.51, 0.54), 0.5, 1.0)
brass = material("Brass", (0.92, 0.7, 0.32), 0.45, 1.0)
chrome = material("Ball steel", (0.92, 0.92, 0.94), 0.3, 1.0)
green = material("Green paint", "#2f7a60", 0.4)
red = material("Red paint", "#b03a2e", 0.4)
cut = dict(start=radians(215), sweep=radians(225))  # what is left of the housing; the opening looks up and front

SUN, PLANET, RING, MODULE = 16, 14, 44, 0.05  # teeth: 16 + 2·14 = 44, and (16 + 44)/3 is whole
REACH = MODULE * (SUN + PLANET) / 2


def along_x(shape):
    """From standing on z = 0 to lying along +X; the angle 0 becomes +Y, 90° becomes +Z."""
    return shape.map(lambda x, y, z: (z, x, y))


def ring_gear(outer, h):
    """Returns the part of an internal gear that remains after the cut."""
    turned = [(hypot(x, y), (atan2(y, x) + pi / RING) % (2 * pi)) for x, y in gear_outline(RING, MODULE)]
    start, sweep = cut["start"], cut["sweep"]
    inner = sorted(((a - start) % (2 * pi), r) for r, a in turned if (a - start) % (2 * pi) <= sweep)
    rows = [(a + start, r, outer) for a, r in inner]
    verts = [
        (r * cos(a), r * sin(a), z)
        for a, r_in, r_out in rows
        for r, z in ((r_in, 0), (r_out, 0), (r_out, h), (r_in, h))
    ]
    faces = [
        (4 * i + k, 4 * i + 4 + k, 4 * i + 4 + (k + 1) % 4, 4 * i + (k + 1) % 4)
        for i in range(len(rows) - 1)
        for k in range(4)
    ]
    last = 4 * (len(rows) - 1)
    return Shape(verts, faces + [(0, 1, 2, 3), (last + 3, last + 2, last + 1, last)])


# Every mesh that is used more than once.
head = lathe([(0, 0), (0.1, 0), (0.112, 0.012), (0.112, 0.07), (0.1, 0.085), (0, 0.085)], 6)
thread = [(0.064 if k % 2 else 0.056, -0.26 + 0.015 * k) for k in range(12)]
bolt = mesh("Bolt", join(head, lathe([(0, -0.28), (0.045, -0.28), *thread, (0.064, -0.08), (0.064, 0)], 18)), dark, 35)
washer = mesh("Washer", ring(0.068, 0.15, 0.025, 27, 0.005), steel, 35)
nut = mesh("Nut", prism_with_bore(hexagon(0.2), 0.066, 0.1, 0.01), brass, 35)
ball = mesh("Ball", sphere(0.085, 28, 14), chrome, 180)
groove = [(0.085 * cos(radians(a)), 0.085 * sin(radians(a))) for a in (-40, -20, 0, 20, 40)]
inner_race = mesh(
    "Inner race",
    along_x(
        lathe(
            [(0.22, -0.13), (0.31, -0.13), *[(0.382 - c, s) for c, s in groove], (0.31, 0.13), (0.22, 0.13)],
            48,
            closed=True,
        )
    ),
    steel,
    35,
)
outer_race = mesh(
    "Outer race",
    along_x(
        lathe(
            [
                (0.54, -0.13),
                (0.54, 0.13),
                (0.455, 0.13),
                *[(0.382 + c, s) for c, s in reversed(groove)],
                (0.455, -0.13),
            ],
            48,
            closed=True,
        )
    ),
    steel,
    35,
)
cage = mesh("Cage", along_x(ring(0.36, 0.405, 0.02, 40).moved(0, 0, 0.095)), brass, 35)
flange = mesh(
    "Flange",
    along_x(
        lathe(
            [(0.54, 0), (1.3, 0), (1.32, 0.02), (1.32, 0.1), (1.3, 0.12), (0.70, 0.12), (0.66, 0.34), (0.54, 0.34)],
            56,
            closed=True,
            **cut,
        )
    ),
    red,
    35,
)
planet = mesh("Planet", along_x(prism_with_bore(gear_outline(PLANET, MODULE, play=0.012), 0.1, 0.5, 0.012)), brass, 30)
lobes = [
    ((0.60 + 0.3 * cos(3 * a)) * cos(a), (0.60 + 0.3 * cos(3 * a)) * sin(a))
    for a in (2 * pi * k / 72 for k in range(72))
]
carrier = mesh("Carrier", along_x(prism_with_bore(lobes, 0.24, 0.08, 0.01).moved(0, 0, 0.29)), dark, 30)
pin = mesh("Pin", along_x(cylinder(0.064, 1.0, 20, 0.01).moved(0, 0, -0.5)), steel, 35)
rib = mesh(
    "Rib", along_x(lathe([(1.32, -0.05), (1.42, -0.04), (1.42, 0.04), (1.32, 0.05)], 56, closed=True, **cut)), green, 35
)
saddle = bevelled("Foot", box(0.32, 1.5, 0.3), green, 0.02).data

root = place("Assembly", None)


def fasten(name, parent, at, rotation, with_nut=None):
    """Adds a washer and a bolt on a seat whose +Z points out of the surface, and a nut at the given depth below it."""
    seat = place(name, None, at, rotation, parent=parent)
    place(name + " washer", washer, parent=seat)
    place(name + " bolt", bolt, (0, 0, 0.025), parent=seat)
    if with_nut:
        place(name + " nut", nut, (0, 0, -with_nut - 0.1), parent=seat)


def end_group(name, mirrored):
    """Flange with its bolts and the ball bearing."""
    group = place(name, None, scale=(-1 if mirrored else 1, 1, 1), parent=root)
    cover = place(name + " flange", flange, (1.0, 0, 0), parent=group)
    for k in range(7):
        a = radians(226 + 34 * k)
        fasten(f"{name} bolt seat {k + 1}", cover, (0.12, cos(a), sin(a)), (0, 90, 0), with_nut=0.12)
    bearing = place(name + " bearing", None, (1.2, 0, 0), parent=group)
    place(name + " inner race", inner_race, parent=bearing)
    place(name + " outer race", outer_race, parent=bearing)
    place(name + " cage A", cage, parent=bearing)
    place(name + " cage B", cage, scale=(-1, 1, 1), parent=bearing)
    for k in range(12):
        a = 2 * pi * k / 12
        place(f"{name} ball {k + 1}", ball, (0, 0.382 * cos(a), 0.382 * sin(a)), (30 * k, 15, 0), parent=bearing)


end_group("Right end", mirrored=False)
end_group("Left end", mirrored=True)

housing = place("Housing", None, parent=root)
add(
    "Shell",
    along_x(lathe([(1.2, -1), (1.32, -1), (1.32, 1), (1.2, 1)], 56, closed=True, **cut)),
    green,
    parent=housing,
    smooth=35,
)
add("Ring gear", along_x(ring_gear(1.2, 0.36).moved(0, 0, -0.18)), steel, parent=housing, smooth=30)
for k, x in enumerate((-0.85, 0, 0.85)):
    place(f"Rib {k + 1}", rib, (x, 0, 0), parent=housing)

# The foot made above is the first of two.
first = next(o for o in housing.users_scene[0].objects if o.data == saddle)
first.parent, first.location, first.name = housing, (-0.5, 0, -1.41), "Foot 1"
place("Foot 2", saddle, (0.5, 0, -1.41), parent=housing)
for k, (x, y) in enumerate((sx * 0.5, sy * 0.6) for sx in (-1, 1) for sy in (-1, 1)):
    fasten(f"Foot bolt seat {k + 1}", housing, (x, y, -1.26), (0, 0, 20 * k))
bevelled("Base plate", box(4.4, 2.6, 0.16), dark, 0.025, location=(0, 0, -1.64), parent=root)
for k, (x, y) in enumerate((sx * 1.95, sy * 1.05) for sx in (-1, 1) for sy in (-1, 1)):
    fasten(f"Base bolt seat {k + 1}", root, (x, y, -1.56), (0, 0, 25 * k))

shaft = place("Input shaft", None, parent=root)
add(
    "Input shaft body",
    along_x(
        lathe(
            [
                (0, -2.3),
                (0.15, -2.3),
                (0.17, -2.28),
                (0.17, -1.6),
                (0.22, -1.57),
                (0.22, -0.4),
                (0.16, -0.37),
                (0.16, 0.25),
                (0, 0.25),
            ],
            40,
        )
    ),
    steel,
    parent=shaft,
    smooth=30,
)
add(
    "Sun gear",
    along_x(prism_with_bore(gear_outline(SUN, MODULE, play=0.012), 0.16, 0.5, 0.012).moved(0, 0, -0.25)),
    steel,
    parent=shaft,
    smooth=30,
)

stage = place("Planet stage", None, parent=root)
place("Carrier A", carrier, parent=stage)
place("Carrier B", carrier, scale=(-1, 1, 1), parent=stage)
for k in range(3):
    a = 2 * pi * k / 3
    at = (0, REACH * cos(a), REACH * sin(a))
    turn = pi / PLANET + a * (1 + SUN / PLANET)  # the pose after rolling round the sun to the angle a
    place(f"Planet {k + 1}", planet, (-0.25, *at[1:]), (turn * 180 / pi, 0, 0), parent=stage)
    place(f"Pin {k + 1}", pin, at, parent=stage)
    for side, x in (("A", 0.37), ("B", -0.37)):
        outward = 90 if x > 0 else -90
        place(f"Pin {k + 1} nut {side}", nut, (x, *at[1:]), (0, outward, 0), parent=stage)

output = place("Output shaft", None, parent=root)
add(
    "Output shaft body",
    along_x(lathe([(0, 0.3), (0.22, 0.3), (0.22, 1.57), (0.17, 1.6), (0.17, 2.28), (0.15, 2.3), (0, 2.3)], 40)),
    steel,
    parent=output,
    smooth=30,
)
add("Coupling", along_x(ring(0.17, 0.55, 0.14, 56, 0.015).moved(0, 0, 1.86)), red, parent=output, smooth=30)
for k in range(6):
    a = pi * k / 3
    fasten(f"Coupling bolt seat {k + 1}", output, (2.0, 0.4 * cos(a), 0.4 * sin(a)), (0, 90, 0), with_nut=0.14)

add("Bench", grid(16, 12), material("Bench", "#a99c88", 0.8), (0, 0, -1.72))
light("Key", "SPOT", (-4.2, -4.4, 5.2), 2600, (0, 0, -0.3), "#fff0dc", cone=50, blend=0.3, radius=0.08)
light("Fill", "POINT", (4.5, -4, 2.5), 450, color="#dfe9ff", radius=0.1)
light("Sky", "SUN", (1, 2, 5), 0.6, (0, 0, 0))
camera("Camera", (-4.6, -7.0, 3.5), (-0.05, 0, -0.2), fov=39)

export_gltf(out / "assembly.glb")
