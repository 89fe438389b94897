"""An imported world in our own language: as it is where the language can say it, as prisms where it cannot.

Upright boxes, cylinders and prisms are the same afterwards; what of them is below the ground is cut off. Every other
solid becomes prisms over its cut at one height, as tall as it is: what a level lidar at that height saw of it stays.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from simscen.core.geometry import Array, wrap
from simscen.core.shapes import Body, MotionPath, Solid
from simscen.core.world import World
from simscen.model.world import Movable, Obstacle, Travel, WorldSpec
from simscen.worlds.forms import DIGITS, Form, forms_of

LONGEST_NAME = 120


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
    """The solids and bodies of a world; what cannot be said exactly is cut at `height` metres or left out, and told."""
    done = Conversion()
    for solid in world.solids:
        for form in forms_of(solid, height, done.changes):
            done.obstacles.append(Obstacle.model_validate({"name": _name(solid.name), **form.fields}))
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
    """The scripted motion, where it is along straight lines at one speed, beginning where the body stands."""
    assert body.path is not None
    path = body.path
    points = np.array([(pose.x, pose.y) for pose in path.poses])
    ways = np.diff(points, axis=0)
    lengths, times = np.hypot(*ways.T), np.diff(path.times)
    speed = float(lengths.sum() / times.sum()) if len(lengths) else 0.0
    steady = bool((lengths > 0).all()) and np.allclose(lengths, speed * times)
    begins = math.dist(points[0], form.pose[:2]) < 10**-DIGITS if len(points) else False
    ahead = form.radius is not None or _faces_ahead(path, ways)
    closed = path.mode != "loop" or bool(np.allclose(points[0], points[-1]))
    if not (speed and steady and begins and ahead and closed and path.mode in ("once", "loop", "back_and_forth")):
        changes.append(f"{body.name}: it moves, but not along straight lines at one speed; it stands still")
        return None
    through = points[1:-1] if path.mode == "loop" else points[1:]
    fields = {"through": through.round(DIGITS).tolist(), "speed": speed, "repeat": path.mode, "start": path.start}
    return Travel.model_validate(fields)


def _faces_ahead(path: MotionPath, ways: Array) -> bool:
    headings = np.arctan2(ways[:, 1], ways[:, 0]).tolist()
    return all(abs(wrap(pose.yaw - heading)) < 1e-3 for pose, heading in zip(path.poses, headings, strict=False))


def _name(name: str) -> str:
    return name[:LONGEST_NAME] or "obstacle"
