"""Criteria that judge by a filter mask, and can never hold or never fail by it."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from simscen.core.maskcells import MaskCells
from simscen.core.problems import Problem
from simscen.core.separation import separation_of_boxes
from simscen.criteria.keepout import Keepout
from simscen.criteria.speed import Speed
from simscen.loading.messages import quoted
from simscen.run.masks import load_judged_masks
from simscen.run.precheck.masked import holds_around
from simscen.run.precheck.scene import Keys, Scene


def judged_by_masks(scene: Scene) -> Iterator[Problem]:
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
                    yield _warning(scene, ("pass", index, "speed", "mask", "file"), message)
            case _:
                pass


def _keepout(scene: Scene, keys: Keys, name: str, mask: MaskCells) -> Iterator[Problem]:
    if not len(mask.forbidden):
        yield _warning(scene, keys, "no cell of the mask is occupied: it forbids nothing, and nothing is judged")
        return
    start = mask.seen_from(np.array([scene.start]))
    if separation_of_boxes(start, scene.outline, mask.forbidden)[0] < 0:
        message = f"keepout can never hold: the robot starts in what {quoted(name)} forbids"
        yield scene.loaded.problem(keys, "SC051", message)
        return
    forbids = holds_around(mask.grid)
    inside = [goal.name for _, goal in scene.targets if forbids(goal.pose, goal.xy_tolerance)]
    if inside:
        message = (
            f"keepout can never hold while goal `{inside[0]}` is reached, which lies in what {quoted(name)} forbids"
        )
        yield scene.loaded.problem(keys, "SC051", message)


def _warning(scene: Scene, keys: Keys, message: str) -> Problem:
    return replace(scene.loaded.problem(keys, "SC055", message), severity="warning")
