"""The promises of a trigger."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from simscen.core.geometry import Pose2
from simscen.testing.contracts.component import heard
from simscen.testing.promise import Contract, demand, promise
from simscen.testing.puppetstage import PuppetStage

MOMENTS = (
    {"tick": 0},
    {"tick": 240, "robot": Pose2(1.0, 0.0, 0.0), "travelled": 1.0},
    {"tick": 2400, "robot": Pose2(5.0, -3.0, 2.0), "travelled": 12.0},
    {"tick": 240_000, "robot": Pose2(0.1, 0.1, -1.0), "travelled": 500.0},
)


@dataclass(frozen=True, eq=False)
class TriggerContract(Contract):
    """Tried in four moments of a run, in every order."""

    role = "trigger"
    spec: Any
    subject: str = ""

    def answers(self, order: list[int]) -> dict[int, bool]:
        """What it says in each moment."""
        said = {k: heard("is asked", self.spec.holds, PuppetStage(**MOMENTS[k])) for k in order}
        for answer in said.values():
            demand(answer is True or answer is False, f"answers {answer!r}")
        return said

    @promise
    def it_says_yes_or_no_at_every_moment(self) -> None:
        """Given any situation, also one without belief, goal, plan or objects, then it says True or False."""
        self.answers([0, 1, 2, 3])

    @promise
    def the_same_situation_gives_the_same_answer(self) -> None:
        """Given the same situation then the same answer, whatever was asked before: no state, no chance."""
        forth, back, again = self.answers([0, 1, 2, 3]), self.answers([3, 2, 1, 0]), self.answers([1, 3, 0, 2])
        demand(forth == back == again, "answers depend on what was asked before")

    @promise
    def it_only_looks(self) -> None:
        """Given a situation then nothing is done to it: what changes the world is an action."""
        stage = PuppetStage(**MOMENTS[1])  # type: ignore[arg-type]
        heard("is asked", self.spec.holds, stage)
        demand(not stage.done, f"does something: {stage.done}")
