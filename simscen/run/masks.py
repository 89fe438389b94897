"""The filter masks of a scenario's stack, read."""

from dataclasses import replace

from simscen.core.errors import InvalidInput
from simscen.core.filtermasks import FilterMasks, SpeedLimits
from simscen.core.grid import OccupancyGrid
from simscen.loading.loaded import LoadedMap, LoadedScenario
from simscen.loading.tree import Key
from simscen.run.worldsource import load_map

KEEPOUT: tuple[Key, ...] = ("stack", "keepout_mask")
SPEED: tuple[Key, ...] = ("stack", "speed_mask", "file")


def load_masks(loaded: LoadedScenario) -> FilterMasks:
    """The masks that the stack gets. Raises InvalidInput, at the line that names it, for one that cannot be read."""
    keepout = _grid(loaded, KEEPOUT, loaded.keepout_mask)
    grid, spec = _grid(loaded, SPEED, loaded.speed_mask), loaded.spec.stack.speed_mask
    if grid is None or spec is None:
        return FilterMasks(keepout)
    return FilterMasks(keepout, SpeedLimits(grid, spec.type == "percent", spec.base, spec.multiplier))


def _grid(loaded: LoadedScenario, keys: tuple[Key, ...], source: LoadedMap | None) -> OccupancyGrid | None:
    if source is None:
        return None
    try:
        return load_map(source)
    except InvalidInput as error:
        place, image = loaded.place_of(*keys), source.image.name
        told = [replace(problem, path=place.path, line=place.line, col=place.col) for problem in error.problems]
        raise InvalidInput(
            [loaded.sourced(replace(problem, message=f"mask image {image}: {problem.message}")) for problem in told]
        ) from error
