#!/usr/bin/env python3
"""Draws the pictures of docs/reference/conventions.md: docs/images/conventions-*.svg.

Run from the repository's root; needs nothing but Python.
"""

import math
import os

FOLDER = "docs/images"
INK, FAINT, RED, GREEN, BLUE, FILL = "#24292f", "#8c959f", "#cf222e", "#1a7f37", "#0969da", "#ddf4ff"


class Picture:
    """An SVG on white, so that it shows on dark pages, too."""

    def __init__(self, width, height):
        self.size = (width, height)
        self.parts = []

    def add(self, text):
        self.parts.append(text)

    def line(self, a, b, color=INK, width=1.5, dash=None):
        dashes = f' stroke-dasharray="{dash}"' if dash else ""
        self.add(
            f'<line x1="{a[0]:.1f}" y1="{a[1]:.1f}" x2="{b[0]:.1f}" y2="{b[1]:.1f}" stroke="{color}" '
            f'stroke-width="{width}"{dashes}/>'
        )

    def arrow(self, a, b, color):
        self.line(a, b, color, 2.5)
        length = math.dist(a, b)
        dx, dy = (b[0] - a[0]) / length, (b[1] - a[1]) / length
        left = (b[0] - 10 * dx + 4.5 * dy, b[1] - 10 * dy - 4.5 * dx)
        right = (b[0] - 10 * dx - 4.5 * dy, b[1] - 10 * dy + 4.5 * dx)
        tip = (b[0] + 2 * dx, b[1] + 2 * dy)
        self.polygon([tip, left, right], color, color)

    def polygon(self, points, fill, stroke=INK, opacity=1.0):
        text = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        self.add(f'<polygon points="{text}" fill="{fill}" fill-opacity="{opacity}" stroke="{stroke}" stroke-width="1.5"/>')

    def dot(self, p, color=INK, radius=3):
        self.add(f'<circle cx="{p[0]:.1f}" cy="{p[1]:.1f}" r="{radius}" fill="{color}"/>')

    def text(self, p, text, color=INK, anchor="middle", size=15):
        self.add(
            f'<text x="{p[0]:.1f}" y="{p[1]:.1f}" fill="{color}" font-size="{size}" text-anchor="{anchor}">{text}</text>'
        )

    def save(self, name):
        width, height = self.size
        head = (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" '
            'font-family="sans-serif">\n<rect width="100%" height="100%" fill="#ffffff"/>\n'
        )
        with open(os.path.join(FOLDER, f"conventions-{name}.svg"), "w", encoding="utf-8") as file:
            file.write(head + "\n".join(self.parts) + "\n</svg>\n")


def oblique(origin, scale):
    """Projects (right, up, towards the viewer) to the page."""
    return lambda p: (
        origin[0] + scale * (p[0] - 0.5 * p[2]),
        origin[1] - scale * (p[1] - 0.4 * p[2]),
    )


def axes(picture, at, labels, length=1.0):
    for axis, (label, direction) in enumerate(labels):
        color = (RED, GREEN, BLUE)[axis]
        end = at(tuple(length * d for d in direction))
        picture.arrow(at((0, 0, 0)), end, color)
        beyond = at(tuple((length + 0.17) * d for d in direction))
        picture.text((beyond[0], beyond[1] + 5), label, color)


def worlds():
    picture = Picture(640, 250)
    for x, title, note, labels in [
        (160, "blinn, glTF, OBJ", "right-handed, Y up, front +Z", [("+X", (1, 0, 0)), ("+Y", (0, 1, 0)), ("+Z", (0, 0, 1))]),
        (480, "Blender, nerfstudio", "right-handed, Z up, front −Y", [("+X", (1, 0, 0)), ("+Y", (0, 0, -1)), ("+Z", (0, 1, 0))]),
    ]:
        at = oblique((x - 5, 160), 85)
        picture.polygon([at((a, 0, b)) for a, b in [(-1, -1), (1, -1), (1, 1), (-1, 1)]], FILL, FAINT, 0.6)
        axes(picture, at, labels)
        picture.text((x, 24), title, size=16)
        picture.text((x, 240), note, FAINT, size=13)
    picture.save("worlds")


def cameras():
    picture = Picture(640, 250)
    for x, title, note, labels in [
        (160, "OpenGL: glTF, Blender, NeRF", "looks along −Z, +Y up", [("+X", (1, 0, 0)), ("+Y", (0, 1, 0)), ("+Z", (0, 0, 1))]),
        (480, "OpenCV: COLMAP, BOP", "looks along +Z, +Y down", [("+X", (1, 0, 0)), ("+Y", (0, -1, 0)), ("+Z", (0, 0, -1))]),
    ]:
        at = oblique((x - 55, 150), 75)
        corners = [(-0.6, -0.4, -2.2), (0.6, -0.4, -2.2), (0.6, 0.4, -2.2), (-0.6, 0.4, -2.2)]
        picture.polygon([at(c) for c in corners], FILL, FAINT, 0.7)
        for corner in corners:
            picture.line(at((0, 0, 0)), at(corner), FAINT, 1)
        axes(picture, at, labels, 0.8)
        picture.dot(at((0, 0, 0)))
        picture.text((x, 24), title, size=16)
        picture.text((x, 240), note, FAINT, size=13)
    picture.save("cameras")


def pixels():
    picture = Picture(640, 285)
    cell, left, top = 50, 90, 50
    for j in range(4):
        for i in range(6):
            x, y = left + cell * i, top + cell * j
            fill = FILL if (i, j) == (0, 0) else "#ffffff"
            picture.polygon([(x, y), (x + cell, y), (x + cell, y + cell), (x, y + cell)], fill, FAINT)
            picture.dot((x + cell / 2, y + cell / 2), FAINT if (i, j) != (0, 0) else INK, 2.5)
    picture.arrow((left, top - 14), (left + 120, top - 14), RED)
    picture.text((left + 136, top - 9), "x", RED)
    picture.arrow((left - 14, top), (left - 14, top + 120), GREEN)
    picture.text((left - 14, top + 140), "y", GREEN)
    picture.text((left - 8, top - 20), "(0, 0)", size=13, anchor="end")
    picture.text((left + 6 * cell + 8, top + 4 * cell + 16), "(width, height)", size=13, anchor="start")
    c = (left + 3.4 * cell, top + 1.7 * cell)
    picture.line((c[0] - 7, c[1]), (c[0] + 7, c[1]), BLUE, 2)
    picture.line((c[0], c[1] - 7), (c[0], c[1] + 7), BLUE, 2)
    x = left + 6 * cell + 24
    picture.line((left + cell / 2, top + cell / 2), (x - 4, top + 20), FAINT, 1, "4 3")
    picture.text((x, top + 25), "centre of the first pixel:", size=13, anchor="start")
    picture.text((x, top + 43), "(0.5, 0.5)", size=13, anchor="start")
    picture.line(c, (x - 4, top + 96), BLUE, 1, "4 3")
    picture.text((x, top + 101), "principal point (c_x, c_y)", BLUE, size=13, anchor="start")
    picture.save("pixels")


def view_rect():
    picture = Picture(640, 300)
    at = oblique((150, 170), 85)
    l, r, b, t, d = -0.5, 1.3, -0.6, 1.1, 3.2
    # Looks to the right of the page: along −w.
    point = lambda u, v, depth: at((depth, v, u))
    corners = [(l, b), (r, b), (r, t), (l, t)]
    e = point(0, 0, 0)
    picture.polygon([point(u, v, d) for u, v in corners], FILL, INK, 0.7)
    for u, v in corners:
        picture.line(e, point(u, v, d), FAINT, 1)
    picture.line(e, point(0, 0, d), INK, 1.5, "6 4")
    foot = point(0, 0, d)
    picture.line(point(l, 0, d), point(r, 0, d), FAINT, 1, "4 3")
    picture.line(point(0, b, d), point(0, t, d), FAINT, 1, "4 3")
    picture.dot(foot)
    for u, v, label, dx, dy in [
        (l, (b + t) / 2, "l", 14, 0),
        (r, (b + t) / 2, "r", -14, 6),
        ((l + r) / 2, b, "b", 0, 18),
        ((l + r) / 2, t, "t", 0, -8),
    ]:
        p = point(u, v, d)
        picture.text((p[0] + dx, p[1] + dy), label, RED, size=17)
    middle = point(0, 0, d / 2)
    picture.text((middle[0], middle[1] + 20), "d", size=17)
    axes(picture, at, [("u", (0, 0, 1)), ("v", (0, 1, 0)), ("w", (-1, 0, 0))], 0.8)
    picture.dot(e)
    picture.text((e[0] + 14, e[1] + 22), "e", size=17)
    picture.text((foot[0] + 10, foot[1] + 20), "0, 0", FAINT, size=13, anchor="start")
    picture.save("view-rect")


worlds()
cameras()
pixels()
view_rect()
