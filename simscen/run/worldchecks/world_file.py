"""What the built world tells about the places and regions that its file names."""

from collections.abc import Iterator
from dataclasses import replace

from simscen.core.problems import Problem
from simscen.core.world import World
from simscen.loading.loaded import LoadedWorld
from simscen.loading.schema.messages import quoted
from simscen.loading.yaml.tree import key_position, value_position
from simscen.run.worldchecks.placement import motion_stops
from simscen.worlds.contain import blocking_solid

INSIDE = 1e-6
HEIGHTS = 0.02, 0.4
"""Metres between which something is in the way of most robots."""
WHEEL, SLOPE, STEP = 0.1, 0.35, 0.03
"""Wheel radius in m, slope in rad and step in m of a robot that ramps are made for."""


def check_world_places(world: World, source: LoadedWorld) -> Iterator[Problem]:
    """Warnings about places and ways in obstacles and regions where nothing is, without the text of their lines."""
    if source.spec is None or source.tree is None:
        return
    standing = _without_platforms(world) if source.spec.ramps else world
    for name, place in source.spec.places.items():
        solid = blocking_solid(standing, (place.x, place.y), INSIDE, HEIGHTS)
        if solid is not None:
            message = f'place {quoted(name)} is inside obstacle "{solid}"'
            yield Problem(*key_position(source.tree, ("places", name)), "SC314", message, severity="warning")
    for index, thing in enumerate(source.spec.objects):
        for keys, what, (x, y) in motion_stops(thing.move) if thing.move is not None else ():
            if solid := blocking_solid(world, (x, y), INSIDE, HEIGHTS):
                told = f'{what} of {quoted(thing.name)} ({x:g}, {y:g}) is inside obstacle "{solid}"'
                at = value_position(source.tree, ("objects", index, "move", *keys))
                yield Problem(*at, "SC304", told, severity="warning")
    left, low, right, high = world.bounds
    for name, corners in source.spec.regions.items():
        xs, ys = [x for x, _ in corners], [y for _, y in corners]
        if max(xs) < left or min(xs) > right or max(ys) < low or min(ys) > high:
            message = f"region {quoted(name)} is outside the world ({left:g} … {right:g}, {low:g} … {high:g})"
            yield Problem(*key_position(source.tree, ("regions", name)), "SC315", message, severity="warning")


def _without_platforms(world: World) -> World:
    """The world as robots meet it that climb its ramps: places may be up there."""
    from simscen.worlds.obstacles import obstacles_of

    return replace(world, solids=obstacles_of(world.solids, WHEEL, SLOPE, STEP))
