"""An imported world in our own language: as it is where the language can say it, as prisms where it cannot.

Upright boxes, cylinders and prisms are the same afterwards; what of them is below the ground is cut off. Every other
solid becomes prisms over its cut at one height, as tall as it is: what a level lidar at that height saw of it stays.
"""

import math
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from pydantic import ValidationError

from simscen.core.environment.world_model import World
from simscen.core.geometry import wrap
from simscen.core.geometry.motion_paths import pose_at
from simscen.core.geometry.shapes import Body, MotionPath, Solid
from simscen.model.world import Movable, Obstacle, Travel, WorldSpec
from simscen.worlds.export.solid_forms import DIGITS, Form, forms_of

LONGEST_NAME = 120
ALIGNED = 1e-6
"""Radians within which a way goes straight on."""


@dataclass
class Conversion:
    """A world in our own language, and a sentence for everything that is not as it was."""

    obstacles: list[Obstacle] = field(default_factory=list)
    objects: list[Movable] = field(default_factory=list)
    changes: list[str] = field(default_factory=list)

    def onto(self, spec: WorldSpec) -> WorldSpec:
        """The specification with this before what it adds itself. Raises pydantic's error for too much."""
        return WorldSpec.model_validate(
            {
                **spec.model_dump(exclude_unset=True),
                "sdf": None,
                "obstacles": [*self.obstacles, *spec.obstacles],
                "objects": [*self.objects, *spec.objects],
            }
        )


def convert(world: World, height: float) -> Conversion:
    """The solids and bodies of a world; what cannot be said exactly is cut at `height` meters or left out, and told."""
    done = Conversion()
    for solid in world.solids:
        for form in forms_of(solid, height, done.changes):
            slippery = {"friction": solid.friction} if solid.friction != 1.0 else {}
            done.obstacles.append(Obstacle.model_validate({"name": _name(solid.name), **form.fields, **slippery}))
    for body in world.bodies:
        _add_body(body, height, done)
    return done


def _add_body(body: Body, height: float, done: Conversion) -> None:
    placed = [Solid(s.shape, body.pose.compose(s.pose), body.name) for s in body.solids]
    forms = [form for solid in placed for form in forms_of(solid, height, done.changes)]
    if not forms:  # which has been told
        return
    if len(forms) > 1:
        moves = "moved" if body.path else "could be pushed" if body.mass else "could be moved"
        done.changes.append(f"{body.name}: it {moves} and has {len(forms)} shapes, an object has one; it stands still")
        done.obstacles += [Obstacle.model_validate({"name": _name(body.name), **form.fields}) for form in forms]
        return
    travel = _travel(body, forms[0], done.changes) if body.path else None
    fields = {"name": _name(body.name), "mass": body.mass, "move": travel, **forms[0].fields}
    done.objects.append(Movable.model_validate(fields))


def _travel(body: Body, form: Form, changes: list[str]) -> Travel | None:
    """The scripted motion: through waypoints where it is straight at one speed, else along keyframes."""
    assert body.path is not None
    path, start, turned = body.path, form.pose, form.radius is not None
    if through := _straight(path):
        speed = sum(a.distance(b) for a, b in pairwise(path.poses)) / path.times[-1]
        way = {"through": through, "speed": speed, "repeat": path.mode, "start": path.start}
        if _same(Travel.model_validate(way).path(start, path.start), path, turned):
            return Travel.model_validate(way)
    here = pose_at(path, 0.0)
    if start.distance(here) > 10**-DIGITS or not (turned or abs(wrap(start.yaw - here.yaw)) < 10**-DIGITS):
        changes.append(f"{body.name}: it moves, and its shape is beside its own origin; it stands still")
        return None
    frames = [[time, *np.round(pose, DIGITS).tolist()] for time, pose in zip(path.times, path.poses, strict=True)]
    timed = {"keyframes": frames, "repeat": path.mode, "ease": path.ease, "phase": path.phase, "start": path.start}
    try:
        return Travel.model_validate(timed)
    except ValidationError as error:
        changes.append(f"{body.name}: it moves as no keyframes say ({error.errors()[0]['msg']}); it stands still")
        return None


def _straight(path: MotionPath) -> list[list[float]]:
    """The corners after the first of a path that is even; those of a loop without the way back."""
    points = [(round(pose.x, DIGITS), round(pose.y, DIGITS)) for pose in path.poses]
    turns = [b for a, b, c in zip(points, points[1:], points[2:], strict=False) if not _in_line(a, b, c)]
    corners = [*turns, *(points[-1:] if path.mode != "loop" else [])]
    return [list(corner) for corner in corners] if path.ease == "linear" and path.times[-1] > 0 else []


def _in_line(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> bool:
    (ux, uy), (vx, vy) = (b[0] - a[0], b[1] - a[1]), (c[0] - b[0], c[1] - b[1])
    return ux * vx + uy * vy >= 0 and abs(ux * vy - uy * vx) <= ALIGNED * math.hypot(ux, uy) * math.hypot(vx, vy)


def _same(written: MotionPath, path: MotionPath, turned: bool) -> bool:
    """Whether two paths are one, at every stop of either; headings do not matter of what is round."""
    times = sorted({*written.times, *path.times})
    apart = [(pose_at(written, t + path.start), pose_at(path, t + path.start)) for t in times]
    return math.isclose(written.times[-1], path.times[-1], rel_tol=1e-6) and all(
        a.distance(b) < 10**-DIGITS and (turned or abs(wrap(a.yaw - b.yaw)) < 10**-DIGITS) for a, b in apart
    )


def _name(name: str) -> str:
    return name[:LONGEST_NAME] or "obstacle"
