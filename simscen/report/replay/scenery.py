"""What there was to see besides what moved: outlines of the world's things, its ground, zones and places."""

from collections.abc import Iterable
from typing import Any

from simscen.core.environment.scenery import Scenery
from simscen.record.replay import Log
from simscen.record.sceneryfile import scenery_of
from simscen.report.replay.columns import Columns
from simscen.report.replay.sensed import grid_of
from simscen.report.text import one_line

_MASKED = 2000
"""Blocks of a filter mask that are drawn; the largest come first."""


def scenery_data(log: Log, columns: Columns) -> dict[str, Any]:
    """The scenery of a log; of one that has none, nothing."""
    scenery = scenery_of(log.about)
    return {
        "things": {
            one_line(thing.name): {
                "pose": [round(part, 4) for part in thing.pose],
                "parts": [points(outline) for outline in thing.outlines],
            }
            for thing in scenery.things
        },
        "places": {one_line(name): [round(pose.x, 3), round(pose.y, 3)] for name, pose in scenery.places.items()},
        "ground": [{"outline": points(one.outline), "height": one.height} for one in scenery.ground],
        "floors": [{"outline": points(one.outline), "friction": one.friction} for one in scenery.floors],
        "zones": _zones(scenery),
        "map": None if scenery.map is None else grid_of(scenery.map.grid, columns),
    }


def _zones(scenery: Scenery) -> list[dict[str, Any]]:
    """Zones by region, and those of masks as boxes."""
    told = []
    for zone in scenery.zones:
        data: dict[str, Any] = {"filter": zone.filter, "region": one_line(zone.region), "limit": zone.speed_limit}
        if zone.cells is not None:
            blocks = sorted(zone.cells.blocks, key=lambda block: -block[2] * block[3])[:_MASKED]
            data["mask"] = {
                "origin": [round(part, 4) for part in zone.cells.origin],
                "resolution": zone.cells.resolution,
                "blocks": [list(block) for block in blocks],
            }
        told.append(data)
    return told


def points(polygon: Iterable[Iterable[float]]) -> list[list[float]]:
    """Corners to the millimeter."""
    return [[round(float(axis), 3) for axis in corner] for corner in polygon]
