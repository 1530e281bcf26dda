"""A POV-Ray scene of an OBJ, which POV-Ray does not read; not part of what is timed: `obj_to_pov.py OBJ POV`."""

import sys

points, normals, faces = [], [], []
for line in open(sys.argv[1]):
    words = line.split()
    if not words:
        continue
    if words[0] == "v":
        points.append("<%s,%s,%s>" % tuple(words[1:4]))
    elif words[0] == "vn":
        normals.append("<%s,%s,%s>" % tuple(words[1:4]))
    elif words[0] == "f":
        faces.append("<%d,%d,%d>" % tuple(int(w.split("/")[0]) - 1 for w in words[1:4]))
with open(sys.argv[2], "w") as out:
    out.write("""#version 3.7;
global_settings { assumed_gamma 1.0 }
camera { perspective location <0.62,0.42,1.75> right -x*image_width/image_height up y angle 68.5 look_at 0 }
light_source { <3,4,2> rgb 1 }
mesh2 {
""")
    for name, rows in (("vertex_vectors", points), ("normal_vectors", normals), ("face_indices", faces)):
        out.write("%s { %d,\n%s }\n" % (name, len(rows), ",\n".join(rows)))
    out.write("pigment { rgb <0.72,0.62,0.5> } }\n")
