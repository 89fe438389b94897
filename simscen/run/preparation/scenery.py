"""Collect the visible parts of a prepared world for logs and pictures."""

from collections.abc import Iterator

import numpy as np

from simscen.core.environment.costmap_filters import mask_blocks
from simscen.core.environment.drivable_surfaces import drivable_solids, face_normals, upward_faces
from simscen.core.environment.scenery import (
    CompressedGrid,
    DrivableSurface,
    FilterZone,
    FrictionRegion,
    MovableObject,
    Scenery,
)
from simscen.core.environment.world_model import World
from simscen.core.geometry.shapes import Body, TriangleMesh
from simscen.run.preparation.scenario import PreparedScenario
from simscen.sim.outline import convex_hull, footprint, parts
from simscen.worlds.routes.shortest_paths import Z_RANGE

MILLIMETERS = 3
"""Decimals of coordinates in m."""


def world_scenery(prepared: PreparedScenario) -> Scenery:
    """Return objects, ground, regions, and the zones of all robots."""
    world, each = prepared.built.world, prepared.each
    reach = max((2 * wheel.radius for part in each.values() for wheel in part.body.wheels), default=0.0)
    same = all(part.map is prepared.built.map for part in each.values())
    return Scenery(
        places=dict(world.places),
        things=tuple(_thing(body, world) for body in world.bodies),
        ground=tuple(_ground(prepared.built.mesh, reach)),
        floors=tuple(FrictionRegion(name, world.regions[name], friction) for name, friction in world.friction.items()),
        zones=tuple(zone for name, part in each.items() for zone in _zones(part, name)),
        map=None if same else CompressedGrid.of(prepared.built.map),
    )


def _thing(body: Body, world: World) -> MovableObject:
    outlines = parts(body.solids, Z_RANGE) or ([footprint(body.solids)] if body.solids else [])
    rounded = tuple(tuple((round(x, MILLIMETERS), round(y, MILLIMETERS)) for x, y in outline) for outline in outlines)
    closed, opened = world.doors.get(body.name, (None, None))
    return MovableObject(body.name, body.pose.plane, rounded, closed, opened, body.mass)


def _ground(mesh: TriangleMesh, reach: float) -> Iterator[DrivableSurface]:
    """Yield the parts of the static world on which wheels with a diameter of up to `reach` m can roll."""
    owners = sorted(drivable_solids(mesh, reach))
    if not owners:
        return  # as most worlds: normals of many thousand faces take a while
    up, slopes = upward_faces(mesh), face_normals(mesh)
    for owner in owners:
        own = mesh.owners == owner
        corners = mesh.vertices[mesh.faces[own]].reshape(-1, 3)
        normal = max(slopes[own & up].tolist(), key=lambda one: -one[2])  # its steepest part
        uphill = (round(-normal[0] / normal[2], MILLIMETERS) + 0.0, round(-normal[1] / normal[2], MILLIMETERS) + 0.0)
        outline = convex_hull(np.round(corners[:, :2], MILLIMETERS))
        yield DrivableSurface(mesh.names[owner], outline, round(float(corners[:, 2].max()), MILLIMETERS), uphill)


def _zones(part: PreparedScenario, robot: str) -> Iterator[FilterZone]:
    """Yield the zones of a robot's stack at the start of the run."""
    regions, masks = part.built.world.regions, part.masks
    for region in part.stack.keepout:
        yield FilterZone("keepout", region, regions[region], robot=robot)
    for zone in part.stack.speed_zones:
        yield FilterZone("speed", zone.region, regions[zone.region], zone.speed_limit, robot=robot)
    if masks.keepout is not None:
        yield FilterZone("keepout", cells=mask_blocks(masks.keepout), robot=robot)
    if masks.speed is not None:
        yield FilterZone("speed", cells=mask_blocks(masks.speed.grid), robot=robot)
