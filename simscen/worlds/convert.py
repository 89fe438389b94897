"""From any world to the text of a `*.world.yaml`, to be edited by hand."""

import json
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from simscen.core.geometry import Pose2, Pose3
from simscen.core.shapes import Body, Box, Cylinder, Extrusion, Solid
from simscen.core.world import World
from simscen.worlds.loops import loops
from simscen.worlds.meshing import fuse
from simscen.worlds.rosmap import decimal
from simscen.worlds.section import outlines

SHEET = 0.004
"""Thickness in metres of the walls that stand for the outline of a mesh: half of it is outside, 2 mm."""
MOST_POINTS = 10_000
"""Of one wall in the language."""


def world_yaml(world: World, height: float) -> tuple[str, tuple[str, ...]]:
    """The world in simscen's own language, and what could not be said exactly in it.

    Upright boxes, cylinders and prisms are kept as they are, from the ground up. Other solids become thin walls along
    their outline at `height`, as tall as the solid. Bodies keep their mass if they are one such upright shape.
    """
    notes: list[str] = []
    sections = {
        "walls": [wall for solid in world.solids if _shape(solid) is None for wall in _sheets(solid, height, notes)],
        "obstacles": [_obstacle(solid) for solid in world.solids if _shape(solid) is not None],
        "objects": [text for body in world.bodies if body.name not in world.doors for text in _object(body, notes)],
        "doors": [_door(body, world.doors[body.name]) for body in world.bodies if body.name in world.doors],
    }
    lines = ["simscen: 1", f"name: {json.dumps(world.name)}"]
    for key, entries in sections.items():
        lines += [f"{key}:", *(f"  - {{{entry}}}" for entry in entries)] if entries else []
    lines += _mapping("places", {name: f"{{{_pose(place)}}}" for name, place in world.places.items()})
    lines += _mapping("regions", {name: _points(corners) for name, corners in world.regions.items()})
    return "\n".join(lines) + "\n", tuple(notes)


def _shape(solid: Solid) -> str | None:
    """The shape as a user would write it, standing on the ground or above it; None if the language has no word."""
    shape, pose = solid.shape, solid.pose
    if pose.rotation()[2, 2] < 1 - 1e-9:
        return None
    match shape:
        case Box((x, y, z)):
            base, text, height = pose.z - z / 2, f"box: [{_metres(x)}, {_metres(y)}, {{}}]", z
        case Cylinder(radius, z):
            base, text, height = pose.z - z / 2, f"cylinder: [{_metres(radius)}, {{}}]", z
        case Extrusion(polygon, z) if len(polygon) <= 200:
            base, text, height = pose.z, f"polygon: {_points(polygon)}, height: {{}}", z
        case _:
            return None
    top = base + height
    if top <= 0:
        return None
    above = f", z: {_metres(base)}" if base > 1e-9 else ""
    return text.format(_metres(top - max(base, 0.0))) + above


def _obstacle(solid: Solid) -> str:
    return f"name: {json.dumps(solid.name or 'obstacle')}, {_shape(solid)}, pose: {{{_pose(solid.pose.plane)}}}"


def _sheets(solid: Solid, height: float, notes: list[str]) -> Iterator[str]:
    mesh = fuse([solid])
    top = float(mesh.vertices[:, 2].max()) if len(mesh.vertices) else 0.0
    chains = [chain for chain in loops(outlines(mesh, height)) if len(chain) <= MOST_POINTS]
    kind = type(solid.shape).__name__.lower()
    if not chains:
        notes.append(f"{solid.name}: left out, as this {kind} is not there at {height:g} m")
        return
    notes.append(f"{solid.name}: a {kind}, written as walls along its outline at {height:g} m")
    for chain in chains:
        yield (
            f"name: {json.dumps(solid.name or 'wall')}, points: {_points(chain)}, "
            f"thickness: {SHEET}, height: {_metres(top)}"
        )


def _object(body: Body, notes: list[str]) -> Iterator[str]:
    placed = [replace(solid, pose=body.pose.compose(solid.pose)) for solid in body.solids]
    shape = _shape(placed[0]) if len(placed) == 1 else None
    if shape is None:
        notes.append(f"{body.name}: left out, as it is not one upright box, cylinder or prism")
        return
    if body.path is not None:
        notes.append(f"{body.name}: its motion is left out; write `move: {{through: …, speed: …}}`")
    pose = _pose(placed[0].pose.plane)
    yield f"name: {json.dumps(body.name)}, {shape}, pose: {{{pose}}}, mass: {_metres(body.mass)}"


def _door(body: Body, swing: tuple[Pose2, Pose2]) -> str:
    (panel,) = body.solids
    assert isinstance(panel.shape, Box), "a door of the language is a box"
    width, thickness, height = panel.shape.size
    closed, _ = swing
    hinge, post = closed.apply(np.array([[0.0, 0.0], [width, 0.0]])).tolist()
    shut = "true" if body.pose == Pose3.planar(closed) else "false"
    sizes = f"thickness: {_metres(thickness)}, height: {_metres(height)}"
    return f"name: {json.dumps(body.name)}, points: {_points((hinge, post))}, closed: {shut}, {sizes}"


def _mapping(key: str, entries: dict[str, str]) -> list[str]:
    return [f"{key}:", *(f"  {json.dumps(name)}: {entry}" for name, entry in entries.items())] if entries else []


def _pose(pose: Pose2) -> str:
    return f"x: {_metres(pose.x)}, y: {_metres(pose.y)}, yaw: {_metres(pose.yaw)}"


def _points(points: "tuple[tuple[float, float], ...] | list[tuple[float, float]]") -> str:
    return "[" + ", ".join(f"[{_metres(x)}, {_metres(y)}]" for x, y in points) + "]"


def _metres(value: float) -> str:
    """To the micrometre, which is more than any world is made to; also for radians and kilograms."""
    return decimal(round(float(value), 6) + 0.0)
