"""What zones and filter masks forbid although the scenario asks for it, and masks that say nothing."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from simscen.core.filtermasks import FilterMasks, kept_out
from simscen.core.geometry import Pose2
from simscen.core.grid import FREE, OCCUPIED, OccupancyGrid
from simscen.core.maskcells import MaskCells
from simscen.core.polygons import deep_inside
from simscen.core.problems import Problem
from simscen.core.separation import separation_of_boxes
from simscen.core.world import Polygon
from simscen.criteria.keepout import Keepout
from simscen.criteria.speed import Speed
from simscen.loading.schema.messages import quoted
from simscen.run.masks import KEEPOUT, SPEED, load_judged_masks
from simscen.run.worldchecks.expected_failures import expects_start_failure
from simscen.run.worldchecks.scene import Keys, Scene

Forbids = Callable[[Pose2, float], bool]
"""Whether a zone holds a place and all around it within some metres."""

CELL = 0.1
"""m inside a zone beyond which no rounding to cells lets a goal be free."""
ESTIMATE = 0.5
"""m by which a robot may err about where it starts, and which it may drive to get out."""


def check_stack_zones(scene: Scene, masks: FilterMasks) -> Iterator[Problem]:
    """Errors for goals and starts that the stack keeps out of, warnings for masks without any effect."""
    regions = scene.world.regions
    zones: list[tuple[Keys, str, Forbids]] = [
        (("stack", "keepout", index), f"in `{region}`", _of_region(regions[region]))
        for index, region in enumerate(scene.loaded.spec.stack.keepout)
    ]
    if masks.keepout is not None:
        zones.append((KEEPOUT, "in a cell that the keepout mask forbids", forbidden_test(masks.keepout)))
    for keys, where, forbids in zones:
        yield from _forbidden(scene, keys, where, forbids)
    yield from _without_effect(scene, masks)


def _forbidden(scene: Scene, keys: Keys, where: str, forbids: Forbids) -> Iterator[Problem]:
    for name in [goal.name for _, goal in scene.targets if forbids(goal.pose, CELL)]:
        message = f"goal `{name}` cannot be reached: it lies {where}, which the stack keeps out of"
        hint = "move one of them, or expect the failure with `result: {status: FAILED, error_code: GOAL_OCCUPIED}`"
        yield scene.loaded.problem(keys, "SC302", message, hint)
    if forbids(scene.start, ESTIMATE) and not expects_start_failure(scene.loaded.spec):
        message = f"the robot starts {where}, which the stack keeps out of"
        hint = "move one of them, or expect the failure with `result: {status: FAILED, error_code: START_OCCUPIED}`"
        yield replace(scene.loaded.problem(keys, "SC302", message, hint), severity="warning")


def _of_region(corners: Polygon) -> Forbids:
    return lambda pose, within: deep_inside(pose, corners) > within


def forbidden_test(mask: OccupancyGrid) -> Forbids:
    """What of the plane a keepout mask forbids."""

    def forbids(pose: Pose2, within: float) -> bool:
        steps = np.linspace(-within, within, 2 * int(np.ceil(within / min(mask.resolution, CELL))) + 1)
        around = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
        return bool(kept_out(mask, around + np.array((pose.x, pose.y))).all())

    return forbids


def _without_effect(scene: Scene, masks: FilterMasks) -> Iterator[Problem]:
    if masks.keepout is not None:
        shades = np.count_nonzero((masks.keepout.cells > FREE) & (masks.keepout.cells < OCCUPIED))
        if not (masks.keepout.cells == OCCUPIED).any():
            yield _warning(scene, KEEPOUT, "SC055", "no cell of the keepout mask is occupied: it forbids nothing")
        elif shades:
            message = f"{shades} cells of the keepout mask are neither free nor occupied: they forbid nothing"
            yield _warning(scene, KEEPOUT, "SC311", message)
    speed = masks.speed
    if speed is not None and not speed.limiting:
        yield _warning(scene, SPEED, "SC055", "no cell of the speed mask limits anything with this base and multiplier")


def _warning(scene: Scene, keys: Keys, code: str, message: str) -> Problem:
    return replace(scene.loaded.problem(keys, code, message), severity="warning")


# MERGED: Criteria that judge by a filter mask, and can never hold or never fail by it.
def check_judged_masks(scene: Scene) -> Iterator[Problem]:
    """Errors for keepout masks that hold the start or a goal, warnings for masks by which nothing is judged.

    Raises InvalidInput for a mask that cannot be read.
    """
    loaded = scene.loaded
    masks = load_judged_masks(loaded.judged_masks, loaded.tree, loaded.sourced)
    for index, entry in enumerate(loaded.spec.pass_):
        match entry.chosen:
            case Keepout(mask=str(name)):
                yield from _keepout(scene, ("pass", index, "keepout", "mask"), name, masks[name])
            case Speed(mask=spec) if spec is not None:
                if not spec.over(masks[spec.file].grid).limiting:
                    message = "no cell of the mask limits anything with this base and multiplier: nothing is judged"
                    yield _mask_warning(scene, ("pass", index, "speed", "mask", "file"), message)
            case _:
                pass


def _keepout(scene: Scene, keys: Keys, name: str, mask: MaskCells) -> Iterator[Problem]:
    if not len(mask.forbidden):
        yield _mask_warning(scene, keys, "no cell of the mask is occupied: it forbids nothing, and nothing is judged")
        return
    start = mask.seen_from(np.array([scene.start]))
    if separation_of_boxes(start, scene.outline, mask.forbidden)[0] < 0:
        message = f"keepout can never hold: the robot starts in what {quoted(name)} forbids"
        yield scene.loaded.problem(keys, "SC051", message)
        return
    forbids = forbidden_test(mask.grid)
    inside = [goal.name for _, goal in scene.targets if forbids(goal.pose, goal.xy_tolerance)]
    if inside:
        message = (
            f"keepout can never hold while goal `{inside[0]}` is reached, which lies in what {quoted(name)} forbids"
        )
        yield scene.loaded.problem(keys, "SC051", message)


def _mask_warning(scene: Scene, keys: Keys, message: str) -> Problem:
    return replace(scene.loaded.problem(keys, "SC055", message), severity="warning")
