"""The promises of an action."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from simscen.core.geometry import Pose2
from simscen.core.stage import Effect
from simscen.testing.contracts.base import Contract, call_component, promise, require
from simscen.testing.fakes import FakeStage


@dataclass(frozen=True, eq=False)
class ActionContract(Contract):
    """Tried on a stage that writes down what is done to it."""

    role = "action"
    spec: Any
    subject: str = ""

    def performed(self) -> tuple[Effect, list[Any]]:
        """What came of it, and what it did."""
        stage = FakeStage()
        effect = call_component("is performed", self.spec.perform, stage)
        return effect, stage.done

    @promise
    def it_says_what_came_of_it(self) -> None:
        """Given a stage then it answers with an Effect in words, and with happened only where it did something."""
        effect, done = self.performed()
        require(isinstance(effect, Effect), f"answers {effect!r}, not an Effect")
        require(isinstance(effect.happened, bool), f"happened is {effect.happened!r}")
        require(isinstance(effect.what, str) and effect.what, "does not say what came of it")
        require(done or not effect.happened, f"says that something happened ({effect.what}) and did nothing")

    @promise
    def the_same_stage_gives_the_same_doing(self) -> None:
        """Given the same stage then it does the same: no clock, no chance, nothing remembered."""
        require(self.performed() == self.performed(), "does something else the second time")


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
        said = {k: call_component("is asked", self.spec.holds, FakeStage(**MOMENTS[k])) for k in order}
        for answer in said.values():
            require(answer is True or answer is False, f"answers {answer!r}")
        return said

    @promise
    def it_says_yes_or_no_at_every_moment(self) -> None:
        """Given any situation, also one without belief, goal, plan or objects, then it says True or False."""
        self.answers([0, 1, 2, 3])

    @promise
    def the_same_situation_gives_the_same_answer(self) -> None:
        """Given the same situation then the same answer, whatever was asked before: no state, no chance."""
        forth, back, again = self.answers([0, 1, 2, 3]), self.answers([3, 2, 1, 0]), self.answers([1, 3, 0, 2])
        require(forth == back == again, "answers depend on what was asked before")

    @promise
    def it_only_looks(self) -> None:
        """Given a situation then nothing is done to it: what changes the world is an action."""
        stage = FakeStage(**MOMENTS[1])  # type: ignore[arg-type]
        call_component("is asked", self.spec.holds, stage)
        require(not stage.done, f"does something: {stage.done}")
