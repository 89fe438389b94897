"""`no_false_success`: the robot does not claim what is not so."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from simscen.core.events import EventKind
from simscen.core.geometry import Pose2
from simscen.core.verdict import Finding
from simscen.criteria.base import Criterion
from simscen.criteria.bounds import at_most, held, missed, undecided
from simscen.criteria.moments import stories
from simscen.criteria.signals import truth
from simscen.spec.base import Spec
from simscen.spec.quantities import PositiveLength

if TYPE_CHECKING:
    from simscen.core.case import Case
    from simscen.core.trace import Trace


class NoFalseSuccess(Spec, Criterion):
    """The robot never says that it is at a goal when it is not; that it fails honestly is fine.

    What is measured: the true distance to the goal whenever the robot reports it reached; and whether navigation was
        reported SUCCEEDED with every goal reached.
    When it fails: a goal was reported reached from further away than `tolerance`, or SUCCEEDED with a goal missing.
    Why this: a failed delivery is retried; one that was reported done is not even noticed. Arena's result says
        GOAL_REACHED without ever checking the goal.
    Source: BARN challenge, run.py, for the metre.

    Example: `no_false_success: {tolerance: 0.5 m}`
    """

    tolerance: PositiveLength = 1.0
    """From here on a success is false; larger than the goal's own tolerance, which goals_reached judges."""

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """One finding for each goal reported reached, one for the end of navigation."""
        told = stories(trace, case)
        ended = trace.of_kind(EventKind.NAVIGATION_ENDED)
        if not ended and all(story.end is None for story in told):
            return [undecided("no_false_success", "the robot reported nothing that could be false")]
        findings = []
        poses = truth(trace)
        for story in told:
            if story.reached is not None:
                pose = Pose2(*poses.at(np.array([story.reached]))[0].tolist())
                away = pose.distance(story.goal.pose)
                what, at = f"goal {story.goal.name}", (trace, story.reached)
                context = "from the goal when the robot said it was there"
                findings.append(at_most(what, away, self.tolerance, "m", at=at, context=context))
        missing = [story.goal.name for story in told if story.reached is None]
        if ended and ended[-1].name == "SUCCEEDED" and missing:
            what, expected = "result", "SUCCEEDED only with every goal reached"
            findings.append(
                missed(what, "SUCCEEDED", expected, (trace, ended[-1].tick), [f"not reached: {', '.join(missing)}"])
            )
        return findings or [held("no_false_success", "no success was claimed", "no false success")]
