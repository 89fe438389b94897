"""Convert `<geometry>` elements to solids."""

import math

import numpy as np

from simscen.core.geometry import Array, Pose3
from simscen.core.geometry.shapes import Box, Capsule, Cone, Cylinder, Ellipsoid, Extrusion, Shape, Solid, Sphere
from simscen.worlds.sdf.elements import MAX_COORDINATE_M, Element, read_numbers, read_size, read_sizes
from simscen.worlds.sdf.files import WorldFiles
from simscen.worlds.sdf.known_elements import SHAPES, report_unknown_children
from simscen.worlds.sdf.meshes import MeshReader, read_heightmap
from simscen.worlds.sdf.report import ImportReport

PLANE_THICKNESS_M = 0.02
"""Thickness of the slab that replaces a plane. The upper face of the slab is the plane."""
GROUND_TOLERANCE_M = 0.01
"""Maximum distance from z = 0 of a level plane that is the ground plane."""
MIN_LEVEL_NORMAL_Z = math.cos(math.radians(0.5))
"""Minimum vertical component of the unit normal of a level face, which is tilted by at most 0.5°."""
MAX_POLYLINE_POINTS = 1000
"""Maximum number of points of all polylines of a `<geometry>`."""
TOLERANCE_M = 1e-9
"""Distance up to which points, heights and crossings count as equal."""


class ShapeReader:
    """Reads `<geometry>` elements as solids; `has_ground` is True after a ground plane was read."""

    def __init__(self, files: WorldFiles, report: ImportReport) -> None:
        self._files, self._report = files, report
        self._meshes = MeshReader(files, report)
        self.has_ground = False

    def solids(self, geometry: Element, world_from_geometry: Pose3) -> tuple[Solid, ...]:
        """Return the solids of one `<geometry>` in its own frame; () for the ground plane and for `<empty>`.

        `world_from_geometry` is the pose of this frame in the world. Raises UnusableElement for an invalid shape.
        """
        shapes = [child for child in geometry.children if not child.tag.startswith("xacro:")]
        if not shapes:
            raise geometry.unusable("contains no shape")
        first = shapes[0]
        if any(shape.tag != first.tag for shape in shapes):
            raise geometry.unusable(
                "contains more than one shape: " + ", ".join(shape.tag[:60] for shape in shapes[:5])
            )
        for shape in shapes:
            if shape.tag in SHAPES:
                report_unknown_children(shape, shape.tag, self._report)
        if primitive := _read_primitive(first):
            return (Solid(primitive),)
        match first.tag:
            case "plane":
                slab = _read_plane(first, world_from_geometry, self._report)
                self.has_ground = self.has_ground or slab is None
                return (slab,) if slab else ()
            case "polyline":
                return _read_polylines(shapes)
            case "heightmap":
                return (read_heightmap(first, self._files),)
            case "mesh":
                return (Solid(self._meshes.read(first)),)
            case "empty":
                return ()
            case tag:
                raise first.unusable(f"<{tag[:60]}> is not a shape that is read", f"one of {', '.join(SHAPES)}")


def _read_primitive(element: Element) -> Shape | None:
    """Return the shape of an element, or None if the element is not a primitive."""
    match element.tag:
        case "box":
            x, y, z = read_sizes(element, "size", 3)
            return Box((x, y, z))
        case "cylinder":
            return Cylinder(read_size(element, "radius"), read_size(element, "length"))
        case "sphere":
            return Sphere(read_size(element, "radius"))
        case "capsule":
            return Capsule(read_size(element, "radius"), read_size(element, "length"))
        case "ellipsoid":
            x, y, z = read_sizes(element, "radii", 3)
            return Ellipsoid((x, y, z))
        case "cone":
            return Cone(read_size(element, "radius"), read_size(element, "length"))
        case _:
            return None


def _read_plane(plane: Element, world_from_plane: Pose3, report: ImportReport) -> Solid | None:
    """Return a thin slab whose upper face is the plane, or None for the ground plane."""
    normal = _read_normal(plane)
    x, y = read_sizes(plane, "size", 2, default=(1.0, 1.0), max_size=math.inf)
    x, y = min(x, MAX_COORDINATE_M), min(y, MAX_COORDINATE_M)
    world_normal = world_from_plane.rotation() @ normal
    if world_normal[2] >= MIN_LEVEL_NORMAL_Z:
        if abs(world_from_plane.z) <= GROUND_TOLERANCE_M:
            return None
        report.note(
            plane.location,
            f"level plane at z = {world_from_plane.z:g} m, the floor is at z = 0; it becomes a slab of {x:g} x {y:g} m",
        )
    return Solid(Box((x, y, PLANE_THICKNESS_M)), _rotation_from_z(normal).compose(Pose3(z=-PLANE_THICKNESS_M / 2)))


def _read_normal(plane: Element) -> Array:
    """Return the unit normal (3,) of a plane; z by default."""
    element = plane.child("normal")
    components = read_numbers(element, 3) if element else (0.0, 0.0, 1.0)
    if element and math.hypot(*components) < 1e-9:
        raise element.unusable("the normal has no length")
    if element and max(map(abs, components)) > 1 / TOLERANCE_M:
        raise element.unusable("the normal is too long")
    normal = np.array(components)
    unit_normal: Array = normal / float(np.linalg.norm(normal))
    return unit_normal


def _rotation_from_z(normal: Array) -> Pose3:
    """Return the shortest rotation from z to the unit vector `normal`; half a turn about x for -z."""
    x, y, z = (float(part) for part in normal)
    if z < -1 + 1e-12:
        return Pose3(0, 0, 0, 1.0, 0, 0, 0)
    qx, qy, qz, qw = -y, x, 0.0, 1 + z
    norm = math.hypot(qx, qy, qw)
    return Pose3(0, 0, 0, qx / norm, qy / norm, qz, qw / norm)


def _read_polylines(polylines: list[Element]) -> tuple[Solid, ...]:
    """Return the extrusions of all `<polyline>`s of one `<geometry>`. Raises UnusableElement for invalid outlines.

    Several outlines are filled by the even-odd rule, as in Gazebo. Nested outlines are therefore holes.
    """
    heights = [read_size(polyline, "height") for polyline in polylines]
    if max(heights) - min(heights) > TOLERANCE_M:
        raise polylines[0].unusable("its polylines have different heights")
    outlines = [_read_outline(polyline) for polyline in polylines]
    if sum(map(len, outlines)) > MAX_POLYLINE_POINTS:
        raise polylines[0].unusable(f"more than {MAX_POLYLINE_POINTS} points")
    polygons = outlines if len(outlines) == 1 and not _crossing_levels(outlines) else trapezoids(outlines)
    if not polygons:
        raise polylines[0].unusable("the outline has no area")
    return tuple(Solid(Extrusion(tuple((float(x), float(y)) for x, y in p), heights[0])) for p in polygons)


def _read_outline(polyline: Element) -> Array:
    """Return the corners (n, 2) of one outline, counterclockwise, without repeated points."""
    rows = [read_numbers(point, 2) for point in polyline.all("point")]
    if any(abs(coordinate) > MAX_COORDINATE_M for row in rows for coordinate in row):
        raise polyline.unusable(f"farther than {MAX_COORDINATE_M:g} m")
    points = np.array(rows).reshape(-1, 2)
    points = points[np.any(np.abs(points - np.roll(points, 1, axis=0)) > TOLERANCE_M, axis=1)]
    if len(points) < 3:
        raise polyline.unusable("fewer than three points")
    x, y = points.T
    signed_area = float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2
    return points if signed_area > 0 else points[::-1]


def trapezoids(outlines: list[Array]) -> list[Array]:
    """Divide the area that is inside an odd number of `outlines` (n, 2) into triangles and trapezoids.

    Returns the corners (3 or 4, 2) of each piece, counterclockwise. The area is cut along horizontal lines through all
    corners and crossings of edges.
    """
    starts, ends = _edges(outlines)
    levels = np.unique(np.concatenate([starts[:, 1], _crossing_levels(outlines)]))
    pieces = []
    for low, high in zip(levels[:-1].tolist(), levels[1:].tolist(), strict=True):
        if high - low > TOLERANCE_M:
            pieces += _trapezoids_between(starts, ends, low, high)
    return pieces


def _edges(outlines: list[Array]) -> tuple[Array, Array]:
    """Return the start points (n, 2) and end points (n, 2) of the edges of all outlines."""
    return np.vstack(outlines), np.vstack([np.roll(outline, -1, axis=0) for outline in outlines])


def _crossing_levels(outlines: list[Array]) -> list[float]:
    """Return the y coordinates at which two edges cross between their ends, in ascending order."""
    a, b = _edges(outlines)
    along = b - a
    between = a[None, :] - a[:, None]
    cross = along[:, None, 0] * along[None, :, 1] - along[:, None, 1] * along[None, :, 0]
    is_parallel = np.abs(cross) < 1e-15
    divisor = np.where(is_parallel, 1.0, cross)
    s = (between[..., 0] * along[None, :, 1] - between[..., 1] * along[None, :, 0]) / divisor
    t = (between[..., 0] * along[:, None, 1] - between[..., 1] * along[:, None, 0]) / divisor
    is_inner_s = (s > TOLERANCE_M) & (s < 1 - TOLERANCE_M)
    is_inner_t = (t > TOLERANCE_M) & (t < 1 - TOLERANCE_M)
    rows, columns = np.nonzero(~is_parallel & is_inner_s & is_inner_t)
    return sorted({float(a[i, 1] + s[i, j] * along[i, 1]) for i, j in zip(rows, columns, strict=True)})


def _trapezoids_between(starts: Array, ends: Array, low: float, high: float) -> list[Array]:
    """Return the pieces of `trapezoids` between y = `low` and y = `high`, where edges neither end nor cross.

    `starts` (n, 2) and `ends` (n, 2) are the ends of all edges.
    """
    middle = (low + high) / 2
    passes = (starts[:, 1] < middle) != (ends[:, 1] < middle)
    start, along = starts[passes], (ends - starts)[passes]

    def x_at(level: float) -> Array:
        x: Array = start[:, 0] + (level - start[:, 1]) / along[:, 1] * along[:, 0]
        return x

    order = np.argsort(x_at(middle), kind="stable")
    bottom, top = x_at(low)[order], x_at(high)[order]
    pieces = []
    for left, right in zip(range(0, len(order), 2), range(1, len(order), 2), strict=True):
        corners = [(bottom[left], low), (bottom[right], low), (top[right], high), (top[left], high)]
        distinct = [c for k, c in enumerate(corners) if np.hypot(*np.subtract(c, corners[k - 1])) > TOLERANCE_M]
        if len(distinct) >= 3:
            pieces.append(np.array(distinct))
    return pieces
