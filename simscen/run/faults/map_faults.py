"""Apply the faults that change a robot's map, before the run starts."""

from dataclasses import replace

import numpy as np

from simscen.core.clock import Clock
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.errors import BROKEN_COMPONENT, RunError
from simscen.core.random_streams import Streams
from simscen.core.records.disturbances import KIND_BY_TARGET_NAME, MAP
from simscen.faults.base import FaultSetting
from simscen.model.disturbances import FaultEntry
from simscen.run.preparation import PreparedScenario
from simscen.run.stream_names import stream_names


def apply_map_faults(prepared: PreparedScenario, seed: int) -> PreparedScenario:
    """Return the scenario with the robots' maps changed by faults. `seed` determines the faults' random numbers.

    The field `map_faults` of the result has the indices of the faults that changed the map. Raises RunError if a fault
    returns no map.
    """
    if not prepared.robots:
        return _apply_to_robot(prepared, Streams(seed))
    parts = {name: _apply_to_robot(part, Streams(seed, name)) for name, part in prepared.robots.items()}
    if all(parts[name] is part for name, part in prepared.robots.items()):
        return prepared  # the same object, for which results are cached
    first = next(iter(parts.values()))
    return replace(prepared, map=first.map, map_faults=first.map_faults, robots=parts)


def _apply_to_robot(prepared: PreparedScenario, streams: Streams) -> PreparedScenario:
    faults, grid = prepared.spec.faults, prepared.map
    changed: list[int] = []
    for index, (entry, name) in enumerate(zip(faults, stream_names(faults), strict=True)):
        if (
            grid is not None
            and KIND_BY_TARGET_NAME.get(entry.sensor) == MAP
            and entry.sensor not in prepared.robot.sensors
        ):
            disturbed = _disturb_map(grid, entry, streams.generator(f"fault{name}#1"), prepared)
            same_frame = (grid.resolution, grid.origin) == (disturbed.resolution, disturbed.origin)
            if not (same_frame and np.array_equal(grid.cells, disturbed.cells)):
                changed.append(index)
            grid = disturbed
    return replace(prepared, map=grid, map_faults=tuple(changed)) if changed else prepared


def _disturb_map(
    grid: OccupancyGrid, entry: FaultEntry, rng: np.random.Generator, prepared: PreparedScenario
) -> OccupancyGrid:
    clock = Clock(prepared.spec.physics.tick_rate)
    disturbed: object = entry.fault.begin(rng, FaultSetting(clock=clock, kind=MAP)).map(grid)
    if not isinstance(disturbed, OccupancyGrid):
        raise RunError(
            BROKEN_COMPONENT,
            f"fault `{entry.label}` returned an object of type {type(disturbed).__name__} for a map"
            f"{entry.plugin_suffix}",
        )
    return disturbed
