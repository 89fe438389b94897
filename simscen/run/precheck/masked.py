"""What zones and filter masks forbid although the scenario asks for it, and masks that say nothing."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from simscen.core.filtermasks import FilterMasks, kept_out
from simscen.core.geometry import Pose2
from simscen.core.grid import FREE, OCCUPIED, OccupancyGrid
from simscen.core.polygons import deep_inside
from simscen.core.problems import Problem
from simscen.core.world import Polygon
from simscen.run.masks import KEEPOUT, SPEED
from simscen.run.precheck.expectation import expects_bad_start
from simscen.run.precheck.scene import Keys, Scene

Forbids = Callable[[Pose2, float], bool]
"""Whether a zone holds a place and all around it within some metres."""

CELL = 0.1
"""m inside a zone beyond which no rounding to cells lets a goal be free."""
ESTIMATE = 0.5
"""m by which a robot may err about where it starts, and which it may drive to get out."""


def masked(scene: Scene, masks: FilterMasks) -> Iterator[Problem]:
    """Errors for goals and starts that the stack keeps out of, warnings for masks without any effect."""
    regions = scene.world.regions
    zones: list[tuple[Keys, str, Forbids]] = [
        (("stack", "keepout", index), f"in `{region}`", _of_region(regions[region]))
        for index, region in enumerate(scene.loaded.spec.stack.keepout)
    ]
    if masks.keepout is not None:
        zones.append((KEEPOUT, "in a cell that the keepout mask forbids", holds_around(masks.keepout)))
    for keys, where, forbids in zones:
        yield from _forbidden(scene, keys, where, forbids)
    yield from _without_effect(scene, masks)


def _forbidden(scene: Scene, keys: Keys, where: str, forbids: Forbids) -> Iterator[Problem]:
    for name in [goal.name for _, goal in scene.targets if forbids(goal.pose, CELL)]:
        message = f"goal `{name}` cannot be reached: it lies {where}, which the stack keeps out of"
        hint = "move one of them, or expect the failure with `result: {status: FAILED, error_code: GOAL_OCCUPIED}`"
        yield scene.loaded.problem(keys, "SC302", message, hint)
    if forbids(scene.start, ESTIMATE) and not expects_bad_start(scene.loaded.spec):
        message = f"the robot starts {where}, which the stack keeps out of"
        hint = "move one of them, or expect the failure with `result: {status: FAILED, error_code: START_OCCUPIED}`"
        yield replace(scene.loaded.problem(keys, "SC302", message, hint), severity="warning")


def _of_region(corners: Polygon) -> Forbids:
    return lambda pose, within: deep_inside(pose, corners) > within


def holds_around(mask: OccupancyGrid) -> Forbids:
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
