"""How near a robot came to a pose that it was to pass on its way."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from simscen.criteria.trace_signals.ground_truth import truth

if TYPE_CHECKING:
    from collections.abc import Sequence

    from simscen.core.trace import Trace
    from simscen.criteria.timeline import GoalOutcome


def closest_approach(trace: Trace, story: GoalOutcome, told: Sequence[GoalOutcome]) -> tuple[int, float]:
    """The tick at which the robot was truly nearest to the pose, and how near (m), in the drive that it belongs to.

    It says that it has passed a pose when it comes near enough, and comes nearer still: what counts is the drive as a
    whole, from when it began with this pose to the end of the goal that it stops at.
    """
    later = told[told.index(story) :]
    stop = next((each for each in later if not each.goal.via), None)
    last = trace.end if stop is None or stop.end is None else stop.end.tick
    poses = truth(trace)
    first = 0 if story.accepted is None else story.accepted
    inside = (poses.ticks >= first) & (poses.ticks <= last)
    if not inside.any():
        inside = np.ones(len(poses.ticks), dtype=bool)
    x, y = story.goal.pose.x, story.goal.pose.y
    apart = np.hypot(poses.values[inside, 0] - x, poses.values[inside, 1] - y)
    k = int(np.argmin(apart))
    return int(poses.ticks[inside][k]), float(apart[k])
