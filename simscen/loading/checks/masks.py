"""Checks for keepout zones and filter masks that forbid the start or a goal, or have no effect."""

from collections.abc import Callable, Iterator, Mapping

import numpy as np

from simscen.core.environment.costmap_filters import FilterMasks, MaskBlocks, in_keepout_mask
from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from simscen.core.geometry import Polygon, Pose2
from simscen.core.geometry.polygon_separation import separation_from_boxes
from simscen.core.geometry.polygons import depth_inside_polygon
from simscen.loading.builders import load_criterion_masks, load_masks
from simscen.loading.checks.registry import WORLD, CheckProblem
from simscen.loading.checks.scene import Scene, expected_failure_hint, required_failure_hint
from simscen.loading.goals import expects_start_failure
from simscen.loading.loaded import KEEPOUT_MASK_KEYS, SPEED_MASK_KEYS
from simscen.loading.schema.messages import quoted
from simscen.loading.yaml.tree import Keys

ZoneTest = Callable[[Pose2, float], bool]
"""Function of a pose and a margin in m that returns whether all positions within the margin are in a zone."""

MIN_DEPTH_M = 0.1
"""Depth inside a zone at which a goal is certainly forbidden, although costmaps round zones to cells."""
ESTIMATE_ERROR_M = 0.5
"""Possible error of the initial estimate. A start is reported only if it is at least this deep inside a zone."""
NO_LIMIT_REASON = "no cell of the mask limits the speed with this `base` and `multiplier`"


def stack_masks(scene: Scene) -> FilterMasks:
    """Load the filter masks of the stack. Raises InvalidInput for an unusable mask."""
    return load_masks(scene.loaded)


def criterion_masks(scene: Scene) -> Mapping[str, MaskBlocks]:
    """Load the filter masks of criteria, by path as in the scenario. Raises InvalidInput for an unusable mask."""
    return load_criterion_masks(scene.loaded.criterion_masks, scene.loaded.tree, scene.loaded.sources)


@WORLD.check("SC302")
def forbidden_goals_and_starts(scene: Scene) -> Iterator[CheckProblem]:
    """Find goals and starts in keepout zones of the stack. For a start, the problem is only a warning."""
    regions = scene.world.regions
    zones: list[tuple[Keys, str, ZoneTest]] = [
        (("stack", "keepout", index), f"in `{region}`", _region_test(regions[region]))
        for index, region in enumerate(scene.loaded.spec.stack.keepout)
    ]
    keepout = scene.cached(stack_masks).keepout
    if keepout is not None:
        zones.append((KEEPOUT_MASK_KEYS, "in a cell that the keepout mask forbids", _mask_test(keepout)))
    for keys, where, forbids in zones:
        for goal_keys, goal in scene.expected_goals:
            if forbids(goal.pose, MIN_DEPTH_M):
                message = f"goal `{goal.name}` cannot be reached: it is {where}, which the stack keeps out of"
                hint = f"move one of them, or {expected_failure_hint(goal_keys, 'GOAL_OCCUPIED')}"
                yield CheckProblem(keys, message, hint)
        if forbids(scene.start, ESTIMATE_ERROR_M) and not expects_start_failure(scene.loaded.spec):
            message = f"the robot starts {where}, which the stack keeps out of"
            hint = f"move one of them, or {required_failure_hint('START_OCCUPIED')}"
            yield CheckProblem(keys, message, hint, is_warning=True)


def _region_test(corners: Polygon) -> ZoneTest:
    return lambda pose, margin: depth_inside_polygon(pose, corners) > margin


def _mask_test(mask: OccupancyGrid) -> ZoneTest:
    """Return the test for the area that a keepout mask forbids.

    The test samples a square around the pose, in steps of at most one cell.
    """

    def forbids(pose: Pose2, margin: float) -> bool:
        steps = np.linspace(-margin, margin, 2 * int(np.ceil(margin / min(mask.resolution, MIN_DEPTH_M))) + 1)
        offsets = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
        return bool(in_keepout_mask(mask, offsets + np.array((pose.x, pose.y))).all())

    return forbids


@WORLD.check("SC055", severity="warning")
def masks_without_effect(scene: Scene) -> Iterator[CheckProblem]:
    """Find keepout masks of the stack that forbid nothing, and speed masks that limit nothing."""
    masks = scene.cached(stack_masks)
    if masks.keepout is not None and not (masks.keepout.cells == OCCUPIED).any():
        yield CheckProblem(KEEPOUT_MASK_KEYS, "the keepout mask forbids nothing: none of its cells is occupied")
    if masks.speed is not None and not masks.speed.has_limits:
        yield CheckProblem(SPEED_MASK_KEYS, f"the speed mask has no effect: {NO_LIMIT_REASON}")


@WORLD.check("SC311", severity="warning")
def partly_occupied_mask_cells(scene: Scene) -> Iterator[CheckProblem]:
    """Find keepout masks with cells that are neither free nor occupied. Such cells have no effect."""
    keepout = scene.cached(stack_masks).keepout
    if keepout is not None and (keepout.cells == OCCUPIED).any():
        count = np.count_nonzero((keepout.cells > FREE) & (keepout.cells < OCCUPIED))
        if count:
            message = f"{count} cells of the keepout mask are neither free nor occupied: they forbid nothing"
            yield CheckProblem(KEEPOUT_MASK_KEYS, message)


@WORLD.check("SC055", severity="warning")
def criterion_masks_without_effect(scene: Scene) -> Iterator[CheckProblem]:
    """Find keepout masks of criteria that forbid nothing, and speed masks that limit nothing."""
    masks = scene.cached(criterion_masks)
    for index, entry in enumerate(scene.loaded.spec.pass_):
        spec = entry.chosen.mask if entry.kind in ("keepout", "speed") else None
        if spec is None:
            continue
        if entry.kind == "keepout" and not len(masks[spec].occupied_boxes):
            message = "the criterion judges nothing: no cell of the mask is occupied"
            yield CheckProblem(("pass", index, "keepout", "mask"), message)
        if entry.kind == "speed" and not spec.speed_limits(masks[spec.file].grid).has_limits:
            message = f"the criterion judges nothing: {NO_LIMIT_REASON}"
            yield CheckProblem(("pass", index, "speed", "mask", "file"), message)


@WORLD.check("SC051")
def keepout_masks_on_goals(scene: Scene) -> Iterator[CheckProblem]:
    """Find keepout criteria that apply to the whole run, and whose mask forbids the start or a goal."""
    masks = scene.cached(criterion_masks)
    for index, entry in enumerate(scene.loaded.spec.pass_):
        if entry.kind != "keepout" or entry.chosen.mask is None or entry.chosen.while_on:
            continue
        name, keys = entry.chosen.mask, ("pass", index, "keepout", "mask")
        mask = masks[name]
        if not len(mask.occupied_boxes):
            continue
        start = mask.to_mask_frame(np.array([scene.start]))
        if separation_from_boxes(start, scene.size.footprint, mask.occupied_boxes)[0] < 0:
            yield CheckProblem(keys, f"keepout can never hold: the robot starts in an area that {quoted(name)} forbids")
            continue
        forbids = _mask_test(mask.grid)
        inside = [goal.name for _, goal in scene.expected_goals if forbids(goal.pose, goal.xy_tolerance)]
        if inside:
            message = f"keepout cannot hold if goal `{inside[0]}` is reached: {quoted(name)} forbids its position"
            yield CheckProblem(keys, message)
