"""A surface in the terms of a Principled BSDF: numbers, colours, and sockets of images."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import bpy

from .principled import WHITE

BLACK = (0.0, 0.0, 0.0)
# Rec. 709.
LUMINANCE = (0.2126, 0.7152, 0.0722)
# Specular reflectance of surfaces that are no metal, at the specular level 1.
DIELECTRIC = 0.08
# Of an image that is not read.
MEAN = 0.5

# Inputs of a Principled BSDF, and the values of a surface that has nothing of them.
PLAIN: dict[str, Any] = {
    "Base Color": BLACK,
    "Metallic": 0.0,
    "Roughness": 1.0,
    "IOR": 1.5,
    "Alpha": 1.0,
    "Normal": None,
    "Specular IOR Level": 0.0,
    "Specular Tint": WHITE,
    "Anisotropic": 0.0,
    "Transmission Weight": 0.0,
    "Subsurface Weight": 0.0,
    "Coat Weight": 0.0,
    "Sheen Weight": 0.0,
    "Sheen Tint": WHITE,
    "Sheen Roughness": 0.5,
    "Emission Color": WHITE,
    "Emission Strength": 0.0,
}
# Light that is a colour times a number.
PRODUCTS = (("Emission Color", "Emission Strength"), ("Sheen Tint", "Sheen Weight"))

# A number, a colour, an output socket, a product, or None for a normal that nothing changes.
Value = Any


class CannotHold(Exception):
    """A surface that one Principled BSDF cannot hold."""


class Scaled(NamedTuple):
    """An output socket times a number or a colour."""

    socket: bpy.types.NodeSocket
    factor: Any


class Mask(NamedTuple):
    """The linear numbers of an image that an output belongs to, or 1 less these."""

    socket: bpy.types.NodeSocket
    is_inverted: bool


@dataclass(frozen=True)
class Surface:
    """Values of a Principled BSDF by the names of its inputs, and what it has no input for."""

    values: dict[str, Value]
    # A Principled BSDF that has all other values.
    base: bpy.types.Node | None = None
    # Part of the diffuse light that passes, and its colour.
    passing: float = 0.0
    passing_color: Value = WHITE
    # Light passes straight.
    is_thin: bool = False
    # Parts of a sentence.
    losses: tuple[str, ...] = field(default=())
    # An image holds it better.
    is_rough: bool = False

    def with_values(self, **values: Value) -> Surface:
        """Returns the surface with other values, named with _ for blanks."""
        named = {name.replace("_", " "): value for name, value in values.items()}
        return replace(self, values={**self.values, **named})


def plain(**values: Value) -> Surface:
    """Returns a surface that has nothing but some values."""
    return Surface(PLAIN).with_values(**values)


def is_constant(value: Value) -> bool:
    """Returns True for a number or a colour."""
    return type(value) in {int, float, tuple}


def product(value: Value, factor: Value) -> Value:
    """Returns a product of which one part is a number at least, or both are the same."""
    for a, b in ((value, factor), (factor, value)):
        if a == 1.0:
            return b
        if a == 0.0:
            return 0.0
    if is_constant(value) and is_constant(factor):
        return scaled(value, factor)
    if is_constant(value):
        value, factor = factor, value
    if isinstance(value, Scaled) and is_constant(factor):
        return Scaled(value.socket, scaled(value.factor, factor))
    if is_constant(factor) and not isinstance(value, Mask):
        return Scaled(value, factor)
    if value == factor:
        # The same image twice is a mistake that shows at its edges only.
        return value
    raise CannotHold("a product of two images")


def scaled(value: Any, factor: Any) -> Any:
    """Returns the product of numbers or colours."""
    if not isinstance(value, tuple) and not isinstance(factor, tuple):
        return value * factor
    values = value if isinstance(value, tuple) else (value,) * 3
    factors = factor if isinstance(factor, tuple) else (factor,) * 3
    return tuple(a * b for a, b in zip(values, factors))


def covered(surface: Surface, coverage: Value) -> Surface:
    """Returns a surface that is seen in part, before what is behind it."""
    return surface.with_values(Alpha=product(surface.values["Alpha"], coverage))


def sum_of(surface: Surface, light: Surface) -> Surface:
    """Returns a surface that also emits the light of another one, which reflects nothing."""
    found = dict(surface.values)
    found.update(sum_of_products(*PRODUCTS[0], surface, light, 1.0, 1.0))
    return replace(surface, values=found, losses=surface.losses + light.losses)


def mix_of(first: Surface, second: Surface, share: float) -> Surface:
    """Returns the mix of two surfaces by a number.

    A Mix Shader adds light. So a value counts by the light that it concerns: metallic by the base colour, roughness by
    the specular reflectance.
    """
    by_color = skewed(share, luminance(first), luminance(second))
    by_gloss = skewed(share, reflectance(first), reflectance(second))
    shares = {"Metallic": by_color, "Normal": by_color}
    shares |= dict.fromkeys(("Roughness", "IOR", "Anisotropic", "Specular Tint"), by_gloss)
    shares["Sheen Roughness"] = float(first.values["Sheen Weight"] == 0.0)
    found = {}
    for name in PLAIN:
        found[name] = mixed(name, first.values[name], second.values[name], shares.get(name, share))
    for color, factor in PRODUCTS:
        found.update(sum_of_products(color, factor, first, second, 1.0 - share, share))
    heavier, lighter = (second, first) if share > 0.5 else (first, second)
    passing = (1.0 - share) * first.passing + share * second.passing
    has_two_normals = first.values["Normal"] != second.values["Normal"] and 0.0 < by_color < 1.0
    return Surface(
        found,
        heavier.base or lighter.base,
        passing,
        second.passing_color if second.passing > first.passing else first.passing_color,
        heavier.is_thin,
        first.losses + second.losses + (("one of two normals",) if has_two_normals else ()),
        has_two_normals or first.is_rough or second.is_rough,
    )


def passing_mix(first: Surface, second: Surface, share: float) -> Surface:
    """Returns the mix of a surface with one that lets all diffuse light pass."""
    if second.passing != 1.0:
        first, second, share = second, first, 1.0 - share
    return replace(first, passing=share, passing_color=second.passing_color)


def mixed(name: str, a: Value, b: Value, share: float) -> Value:
    """Returns the mix of two values."""
    if a == b or share == 0.0:
        return a
    if share == 1.0:
        return b
    if is_constant(a) and is_constant(b):
        if isinstance(a, tuple):
            return tuple((1.0 - share) * x + share * y for x, y in zip(a, b))
        return (1.0 - share) * a + share * b
    if name == "Normal" and (a is None or b is None):
        return b if a is None else a
    for value, zero, part in ((a, b, 1.0 - share), (b, a, share)):
        if zero in (0.0, BLACK):
            return product(value, part)
    if name in {color for color, _ in PRODUCTS}:
        # Written by sum_of_products.
        return a
    raise CannotHold(f"a mix of images in {name}")


def sum_of_products(
    color: str, factor: str, first: Surface, second: Surface, part: float, other_part: float
) -> dict[str, Value]:
    """Returns the sum of two lights, each a colour times a number."""
    a, b = (product(s.values[factor], p) for s, p in ((first, part), (second, other_part)))
    if b == 0.0:
        return {color: first.values[color], factor: a}
    if a == 0.0:
        return {color: second.values[color], factor: b}
    colors = first.values[color], second.values[color]
    if colors[0] == colors[1] and is_constant(a) and is_constant(b):
        return {color: colors[0], factor: a + b}
    if not all(is_constant(value) for value in (a, b, *colors)):
        raise CannotHold(f"a sum of images in {color}")
    light = tuple(a * x + b * y for x, y in zip(*colors))
    peak = max(light)
    return {color: scaled(light, 1.0 / peak) if peak > 0.0 else WHITE, factor: peak}


def luminance(surface: Surface) -> float:
    """Returns the luminance of the base colour."""
    return luminance_of(surface.values["Base Color"])


def luminance_of(value: Value) -> float:
    """Returns the luminance of a colour, that of an image by its mean."""
    if isinstance(value, Scaled):
        return MEAN * luminance_of(value.factor)
    if not is_constant(value):
        return MEAN
    return sum(a * b for a, b in zip(LUMINANCE, value)) if isinstance(value, tuple) else value


def reflectance(surface: Surface) -> float:
    """Returns what is reflected and refracted without diffusion, as seen from the front."""
    metallic, clear, level = (
        value if is_constant(value) else MEAN
        for value in (surface.values[name] for name in ("Metallic", "Transmission Weight", "Specular IOR Level"))
    )
    dielectric = DIELECTRIC * level
    return dielectric + max(metallic, clear) * (luminance(surface) - dielectric)


def skewed(share: float, first: float, second: float) -> float:
    """Returns the share of the second part of a mix if the parts count by weights."""
    weight = share * second
    total = (1.0 - share) * first + weight
    return weight / total if total > 0.0 else share
