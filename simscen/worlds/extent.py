"""Extents of solids and models, and a hint about the model that makes the map of a world too large."""

from collections.abc import Iterable, Sequence

from simscen.core.environment.world_model import World
from simscen.core.geometry.meshes import FLOOR_HEIGHT_M
from simscen.core.geometry.shapes import Body, Solid
from simscen.worlds.geometry.prisms import bounding_rectangle, upright_prism
from simscen.worlds.maps.map_size import Bounds, map_size_error


def placed_solids(solids: Sequence[Solid], bodies: Sequence[Body]) -> list[Solid]:
    """Return all solids of a world in the world frame: the static `solids`, then the solids of the `bodies`.

    Bodies are at their initial poses. Their solids get the name of the body.
    """
    moved = (Solid(solid.shape, body.pose.compose(solid.pose), body.name) for body in bodies for solid in body.solids)
    return [*solids, *moved]


def model_name(solid: Solid) -> str:
    """Return the name of the outermost model that a solid belongs to: "shelf" for a solid "shelf::link::collision"."""
    return solid.name.partition("::")[0]


def union(rectangles: Iterable[Bounds]) -> Bounds:
    """Return the smallest rectangle that contains all `rectangles`; zeros if there are none."""
    sides = list(zip(*rectangles, strict=True))
    if not sides:
        return 0.0, 0.0, 0.0, 0.0
    left, bottom, right, top = sides
    return min(left), min(bottom), max(right), max(top)


def top_height(solid: Solid) -> float:
    """Return the height in m of the highest point of a solid."""
    prism = upright_prism(solid)
    if prism is not None:
        return prism.top
    from simscen.worlds.geometry.triangulation import triangulate

    return float(solid.pose.apply(triangulate(solid.shape).vertices)[:, 2].max())


def oversize_hint(world: World) -> str:
    """Return a hint for a world whose map is too large: move or remove the model that enlarges the world most.

    If all models fit on a map, the hint is to move the start and the goals. Floors do not count as models.
    """
    rectangles: dict[str, list[Bounds]] = {}
    for solid in placed_solids(world.solids, world.bodies):
        if top_height(solid) > FLOOR_HEIGHT_M:
            rectangles.setdefault(model_name(solid), []).append(bounding_rectangle(solid))
    extents = {name: union(parts) for name, parts in rectangles.items()}
    if map_size_error(union(extents.values())) is None:
        return "move the start and the goals closer together"

    def area_without(name: str) -> float:
        left, bottom, right, top = union(extent for other, extent in extents.items() if other != name)
        return (right - left) * (top - bottom)

    # Only a model at an edge of the world can make the world larger.
    edges = [choose(extents, key=lambda name: extents[name][side]) for side, choose in enumerate((min, min, max, max))]
    return f'"{min(edges, key=area_without)}" makes the map large; move or remove this model'
