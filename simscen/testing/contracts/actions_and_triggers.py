"""Contracts of actions and triggers: checks that each of them must pass."""

from __future__ import annotations

from typing import Any

from simscen.core.geometry import Pose2
from simscen.core.stage import Effect
from simscen.testing.contracts.base import Contract, call_component, promise, require
from simscen.testing.fakes import FakeStage


class ActionContract(Contract):
    """Contract of an action, on a fake stage (interface to the running simulation) that records calls."""

    role = "action"

    def perform(self) -> tuple[Effect, list[Any]]:
        """Return the effect of the action, and the recorded calls of the stage's methods."""
        stage = FakeStage()
        effect = call_component("is performed", self.spec.perform, stage)
        return effect, stage.calls

    @promise
    def it_returns_an_effect(self) -> None:
        """Given a stage then the action returns an Effect with a description. Without calls, `happened` is False."""
        effect, done = self.perform()
        require(isinstance(effect, Effect), f"returns {effect!r}, not an Effect")
        require(isinstance(effect.happened, bool), f"happened is {effect.happened!r}")
        require(isinstance(effect.what, str) and effect.what, "has an effect without a description")
        require(done or not effect.happened, f"reports an effect ({effect.what}) but did nothing")

    @promise
    def the_same_stage_gives_the_same_calls(self) -> None:
        """Given the same stage then the action makes the same calls, independent of clocks and earlier calls."""
        require(self.perform() == self.perform(), "makes different calls the second time")


SITUATIONS = (
    {"tick": 0},
    {"tick": 240, "robot": Pose2(1.0, 0.0, 0.0), "travelled": 1.0},
    {"tick": 2400, "robot": Pose2(5.0, -3.0, 2.0), "travelled": 12.0},
    {"tick": 240_000, "robot": Pose2(0.1, 0.1, -1.0), "travelled": 500.0},
)
"""Values of FakeStage's fields in four situations of a run."""


class TriggerContract(Contract):
    """Contract of a trigger, evaluated in all SITUATIONS in different orders."""

    role = "trigger"

    def answers(self, order: list[int]) -> dict[int, bool]:
        """Evaluate the trigger in the order of these indices of SITUATIONS, and return the answers by index."""
        answers = {k: call_component("is evaluated", self.spec.holds, FakeStage(**SITUATIONS[k])) for k in order}
        for answer in answers.values():
            require(answer is True or answer is False, f"answers {answer!r}")
        return answers

    @promise
    def it_returns_true_or_false_at_every_moment(self) -> None:
        """Given any situation then the answer is True or False, also without belief, goal, and plan."""
        self.answers([0, 1, 2, 3])

    @promise
    def the_same_situation_gives_the_same_answer(self) -> None:
        """Given the same situation then the answer is the same, independent of earlier calls."""
        ascending, descending, mixed = (
            self.answers([0, 1, 2, 3]),
            self.answers([3, 2, 1, 0]),
            self.answers([1, 3, 0, 2]),
        )
        require(ascending == descending == mixed, "answers depend on earlier calls")

    @promise
    def it_changes_nothing(self) -> None:
        """Given a situation then the trigger does not change the world."""
        stage = FakeStage(**SITUATIONS[1])  # type: ignore[arg-type]
        call_component("is evaluated", self.spec.holds, stage)
        require(not stage.calls, f"changes the world: {stage.calls}")
