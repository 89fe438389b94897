"""Build the header of a run's log: facts, map, robot description, sensors, and the scenery that viewers show."""

from collections.abc import Iterator
from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np

from simscen.core.environment.costmap_filters import mask_blocks
from simscen.core.environment.scenery import (
    CompressedGrid,
    DrivableSurface,
    FilterZone,
    FrictionRegion,
    MovableObject,
    Scenery,
)
from simscen.core.environment.world_model import World
from simscen.core.geometry.meshes import drivable_solids, face_normals, upward_faces
from simscen.core.geometry.shapes import Body, TriangleMesh
from simscen.loading.plugins import log_header_key, requirement_of
from simscen.loading.scenario_text import resolved_text
from simscen.record.log_header import (
    SCENERY_FILE,
    STACK_FACT,
    STACK_NAME_FACT,
    VARIATION_FACT,
    LogHeader,
    scenery_to_json,
)
from simscen.run.preparation import PreparedScenario
from simscen.run.robot_interface import sensor_kinds, sensor_mounts
from simscen.sim.body.outline import convex_hull, footprint, outlines_in_z_range
from simscen.sim.urdf.writer import to_urdf
from simscen.worlds.routes.shortest_paths import Z_RANGE_M

_HEADERS: WeakKeyDictionary[PreparedScenario, LogHeader] = WeakKeyDictionary()
"""Cache of headers without the seed."""


def log_header(prepared: PreparedScenario, seed: int) -> LogHeader:
    """Return the log header of a run. Builds it only once for all runs of a scenario."""
    header = _HEADERS.get(prepared)
    if header is None:
        header = _HEADERS[prepared] = replace(
            _robot_header(prepared),
            files={SCENERY_FILE: scenery_to_json(world_scenery(prepared))},
            robots={name: _robot_header(part) for name, part in prepared.robots.items()},
        )
    return replace(header, seed=seed, robots={name: replace(part, seed=seed) for name, part in header.robots.items()})


def _robot_header(prepared: PreparedScenario) -> LogHeader:
    loaded = prepared.loaded
    facts = {STACK_FACT: loaded.stack, STACK_NAME_FACT: loaded.stack_name, VARIATION_FACT: loaded.variation}
    return LogHeader(
        name=loaded.id,
        seed=prepared.spec.seed,
        case=prepared.case,
        scenario=resolved_text(loaded),
        map=prepared.map,
        robot_description=to_urdf(prepared.body),
        mounts=sensor_mounts(prepared.robot),
        sensors=sensor_kinds(prepared),
        facts={name: value for name, value in facts.items() if value}
        | {log_header_key(entry): requirement_of(entry) for entry in prepared.plugins},
    )


DECIMALS = 3
"""Number of decimals of coordinates (m) in the scenery."""


def world_scenery(prepared: PreparedScenario) -> Scenery:
    """Return the objects, regions, and zones that viewers show."""
    world, by_robot = prepared.built.world, prepared.by_robot
    diameter = max((2 * wheel.radius for part in by_robot.values() for wheel in part.body.wheels), default=0.0)
    all_use_world_map = all(part.map is prepared.built.map for part in by_robot.values())
    return Scenery(
        places=dict(world.places),
        things=tuple(_movable_object(body, world) for body in world.bodies),
        ground=tuple(_drivable_surfaces(prepared.built.mesh, diameter)),
        floors=tuple(FrictionRegion(name, world.regions[name], friction) for name, friction in world.friction.items()),
        zones=tuple(zone for name, part in by_robot.items() for zone in _zones(part, name)),
        map=None if all_use_world_map else CompressedGrid.of(prepared.built.map),
    )


def _movable_object(body: Body, world: World) -> MovableObject:
    outlines = outlines_in_z_range(body.solids, Z_RANGE_M) or ([footprint(body.solids)] if body.solids else [])
    rounded = tuple(tuple((round(x, DECIMALS), round(y, DECIMALS)) for x, y in outline) for outline in outlines)
    closed, opened = world.doors.get(body.name, (None, None))
    return MovableObject(body.name, body.pose.plane, rounded, closed, opened, body.mass)


def _drivable_surfaces(mesh: TriangleMesh, diameter: float) -> Iterator[DrivableSurface]:
    """Yield the parts of the static world on which wheels with a diameter of up to `diameter` m can roll."""
    owners = sorted(drivable_solids(mesh, diameter))
    if not owners:
        return  # most worlds have none, and computing the normals of many thousand faces is slow
    is_upward, normals = upward_faces(mesh), face_normals(mesh)
    for owner in owners:
        is_owned = mesh.owners == owner
        corners = mesh.vertices[mesh.faces[is_owned]].reshape(-1, 3)
        normal = min(normals[is_owned & is_upward].tolist(), key=lambda normal: normal[2])  # of the steepest face
        uphill = (round(-normal[0] / normal[2], DECIMALS) + 0.0, round(-normal[1] / normal[2], DECIMALS) + 0.0)
        outline = convex_hull(np.round(corners[:, :2], DECIMALS))
        yield DrivableSurface(mesh.names[owner], outline, round(float(corners[:, 2].max()), DECIMALS), uphill)


def _zones(part: PreparedScenario, robot: str) -> Iterator[FilterZone]:
    """Yield the keepout and speed zones of a robot's stack at the start of the run."""
    regions, masks = part.built.world.regions, part.masks
    for region in part.stack.keepout:
        yield FilterZone("keepout", region, regions[region], robot=robot)
    for zone in part.stack.speed_zones:
        yield FilterZone("speed", zone.region, regions[zone.region], zone.speed_limit, robot=robot)
    if masks.keepout is not None:
        yield FilterZone("keepout", cells=mask_blocks(masks.keepout), robot=robot)
    if masks.speed is not None:
        yield FilterZone("speed", cells=mask_blocks(masks.speed.grid), robot=robot)
