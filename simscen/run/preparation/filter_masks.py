"""Load the filter masks of a scenario: those of its stack and those of its criteria."""

from collections.abc import Callable, Mapping
from dataclasses import replace

from simscen.core.environment.costmap_filters import FilterMasks, MaskBlocks, mask_blocks
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.errors import InvalidInput, Problem
from simscen.loading.loaded import JudgedMask, LoadedMap, LoadedScenario
from simscen.loading.yaml.tree import Key, MappingNode, value_position
from simscen.run.preparation.loaders import load_map

KEEPOUT_KEYS: tuple[Key, ...] = ("stack", "keepout_mask")
SPEED_KEYS: tuple[Key, ...] = ("stack", "speed_mask", "file")

MAX_BLOCKS = 100_000
"""Largest number of rectangles of equal cells in a mask of a criterion. Each log contains them."""

AddSource = Callable[[Problem], Problem]
"""Adds the source line to a problem."""


def load_masks(loaded: LoadedScenario) -> FilterMasks:
    """Load the masks of the stack. Raises InvalidInput at the line that names an unreadable mask."""
    keepout = _of_stack(loaded, KEEPOUT_KEYS, loaded.keepout_mask)
    grid, spec = _of_stack(loaded, SPEED_KEYS, loaded.speed_mask), loaded.spec.stack.speed_mask
    if grid is None or spec is None:
        return FilterMasks(keepout)
    return FilterMasks(keepout, spec.over(grid))


def load_criterion_masks(
    masks: Mapping[str, JudgedMask], tree: MappingNode, sourced: AddSource
) -> dict[str, MaskBlocks]:
    """Load the masks of criteria. Raises InvalidInput at the line that names an unusable mask."""
    return {name: _judged(mask, tree, sourced) for name, mask in masks.items()}


def _judged(mask: JudgedMask, tree: MappingNode, sourced: AddSource) -> MaskBlocks:
    cells = mask_blocks(_grid(mask.map, mask.keys, tree, sourced))
    if len(cells.blocks) > MAX_BLOCKS:
        message = f"mask image {mask.map.image.name} falls into {len(cells.blocks)} rectangles of equal cells"
        hint = f"criteria judge by masks of {MAX_BLOCKS} at most; is it a photograph, or a map with noise?"
        raise InvalidInput([sourced(Problem(*value_position(tree, mask.keys), "SC320", message, hint))])
    return cells


def _of_stack(loaded: LoadedScenario, keys: tuple[Key, ...], source: LoadedMap | None) -> OccupancyGrid | None:
    return None if source is None else _grid(source, keys, loaded.tree, loaded.sourced)


def _grid(source: LoadedMap, keys: tuple[Key, ...], tree: MappingNode, sourced: AddSource) -> OccupancyGrid:
    try:
        return load_map(source)
    except InvalidInput as error:
        place, image = value_position(tree, keys), source.image.name
        told = [replace(problem, path=place.path, line=place.line, col=place.col) for problem in error.problems]
        raise InvalidInput(
            [sourced(replace(problem, message=f"mask image {image}: {problem.message}")) for problem in told]
        ) from error
