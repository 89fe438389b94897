"""An imported world in our own language: as it is where the language can say it, as prisms where it cannot.

Upright boxes, cylinders and prisms are the same afterwards; what of them is below the ground is cut off. Every other
solid becomes prisms over its cut at one height, as tall as it is: what a level lidar at that height saw of it stays.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from simscen.core.geometry import Array, Pose2, wrap
from simscen.core.shapes import Body, Box, Cylinder, Extrusion, MotionPath, Solid
from simscen.core.world import World
from simscen.model.world import Movable, Obstacle, Travel, WorldSpec
from simscen.spec.places import PoseSpec
from simscen.worlds.meshing import fuse
from simscen.worlds.rings import MOST_CORNERS, OpenCut, area, pieces_of, rings_of
from simscen.worlds.section import outlines

UPRIGHT = 1 - 1e-8
"""Cosine of the tilt up to which something counts as upright: 0.1 mm on a metre."""
DIGITS = 6
LONGEST_NAME = 120


@dataclass(frozen=True)
class Form:
    """One shape of our language: the fields of an obstacle but for its name."""

    pose: Pose2
    bottom: float
    height: float
    box: tuple[float, float] | None = None
    radius: float | None = None
    polygon: tuple[tuple[float, float], ...] = ()


@dataclass
class Conversion:
    """A world in our own language, and a sentence for everything that is not as it was."""

    obstacles: list[Obstacle] = field(default_factory=list)
    objects: list[Movable] = field(default_factory=list)
    changes: list[str] = field(default_factory=list)

    def onto(self, spec: WorldSpec) -> WorldSpec:
        """The specification with this before what it adds itself. Raises ValueError when it holds too much."""
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
        for form in _forms(solid, height, done.changes):
            done.obstacles.append(Obstacle.model_validate({"name": _name(solid.name), **_fields(form)}))
    for body in world.bodies:
        _add_body(body, height, done)
    return done


def _add_body(body: Body, height: float, done: Conversion) -> None:
    placed = [Solid(s.shape, body.pose.compose(s.pose), body.name) for s in body.solids]
    forms = [form for solid in placed for form in _forms(solid, height, done.changes)]
    if len(forms) != 1:
        moves = "moved" if body.path else "could be pushed" if body.mass else "could be moved"
        done.changes.append(f"{body.name}: it {moves} and has {len(forms)} shapes, an object has one; it stands still")
        done.obstacles += [Obstacle.model_validate({"name": _name(body.name), **_fields(form)}) for form in forms]
        return
    travel = _travel(body, forms[0], done.changes) if body.path else None
    fields = {"name": _name(body.name), "mass": body.mass, "move": travel, **_fields(forms[0])}
    done.objects.append(Movable.model_validate(fields))


def _forms(solid: Solid, height: float, changes: list[str]) -> list[Form]:
    exact = _exact(solid)
    found = [exact] if exact else list(_prisms(solid, height, changes))
    standing = [_cut_off(form) for form in found if form.bottom + form.height > 10**-DIGITS]
    if found and not standing:
        changes.append(f"{solid.name}: it lies below the ground; it is left out")
    return standing


def _exact(solid: Solid) -> Form | None:
    """The same solid in our language, if it is upright."""
    turn, pose = solid.pose.rotation(), solid.pose
    up = int(np.argmax(np.abs(turn[2])))
    if abs(turn[2, up]) < UPRIGHT:
        return None
    along, across = ((1, 2), (0, 2), (0, 1))[up]
    place = Pose2(pose.x, pose.y, math.atan2(turn[1, along], turn[0, along]))
    match solid.shape:
        case Box(size):
            return Form(place, pose.z - size[up] / 2, size[up], box=(size[along], size[across]))
        case Cylinder(radius, length) if up == 2:
            return Form(Pose2(pose.x, pose.y), pose.z - length / 2, length, radius=radius)
        case Extrusion(polygon, tall) if up == 2 and turn[2, 2] > 0 and len(polygon) <= MOST_CORNERS:
            return Form(place, pose.z, tall, polygon=polygon)
        case _:
            return None


def _prisms(solid: Solid, height: float, changes: list[str]) -> Iterator[Form]:
    mesh = fuse([solid])
    kind = type(solid.shape).__name__.lower()
    kind = f"an {kind}" if kind[0] in "aeiou" else f"a {kind}"
    low, high = float(mesh.vertices[:, 2].min()), float(mesh.vertices[:, 2].max())
    at = height if low < height <= high else (low + high) / 2
    try:
        pieces = pieces_of(rings_of(outlines(mesh, at)))
    except OpenCut:
        changes.append(f"{solid.name}: {kind} whose cut at {at:g} m is not closed; it is left out")
        return
    if not pieces:
        changes.append(f"{solid.name}: {kind} that is flat; it is left out")
        return
    if not _is_prism(solid, sum(map(area, pieces)) * (high - low)):
        changes.append(f"{solid.name}: {kind}; it became {_prism_count(len(pieces))} over its cut at {at:.3g} m")
    for piece in pieces:
        middle = np.mean(piece, axis=0)
        x, y = round(float(middle[0]), DIGITS), round(float(middle[1]), DIGITS)
        yield Form(Pose2(x, y), low, high - low, polygon=tuple((px - x, py - y) for px, py in piece))


def _is_prism(solid: Solid, volume: float) -> bool:
    """Whether every face is level or upright, and the volume that of the prisms: then nothing has changed."""
    mesh = fuse([solid])
    a, b, c = mesh.vertices[mesh.faces].swapaxes(0, 1)
    normals = np.cross(b - a, c - a)
    sizes = np.linalg.norm(normals, axis=1)
    tilted = np.minimum(np.abs(normals[:, 2]), np.linalg.norm(normals[:, :2], axis=1)) > 1e-6 * sizes + 1e-12
    own = float(np.sum(a * np.cross(b, c)) / 6)
    return not tilted.any() and math.isclose(own, volume, rel_tol=1e-6)


def _cut_off(form: Form) -> Form:
    """Without what is below the ground."""
    if form.bottom >= 0:
        return form
    return Form(form.pose, 0.0, form.height + form.bottom, form.box, form.radius, form.polygon)


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


def _fields(form: Form) -> dict[str, object]:
    """The fields of an obstacle, rounded to the micrometre."""
    x, y, yaw = (round(value, DIGITS) + 0.0 for value in form.pose)
    fields: dict[str, object] = {"pose": PoseSpec(x=x, y=y, yaw=yaw)}
    height = round(form.height, DIGITS)
    if form.box is not None:
        fields["box"] = [*_rounded(form.box), height]
    elif form.radius is not None:
        fields["cylinder"] = [round(form.radius, DIGITS), height]
    else:
        fields |= {"polygon": [_rounded(point) for point in form.polygon], "height": height}
    return {**fields, "z": round(form.bottom, DIGITS)} if round(form.bottom, DIGITS) > 0 else fields


def _rounded(values: Sequence[float]) -> list[float]:
    return [round(value, DIGITS) + 0.0 for value in values]


def _prism_count(number: int) -> str:
    return "an upright prism" if number == 1 else f"{number} upright prisms"


def _name(name: str) -> str:
    return name[:LONGEST_NAME] or "obstacle"
