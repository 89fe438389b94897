"""The promises of an action."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from simscen.core.stage import Effect
from simscen.testing.contracts.component import heard
from simscen.testing.promise import Contract, demand, promise
from simscen.testing.puppetstage import PuppetStage


@dataclass(frozen=True, eq=False)
class ActionContract(Contract):
    """Tried on a stage that writes down what is done to it."""

    role = "action"
    spec: Any
    subject: str = ""

    def performed(self) -> tuple[Effect, list[Any]]:
        """What came of it, and what it did."""
        stage = PuppetStage()
        effect = heard("is performed", self.spec.perform, stage)
        return effect, stage.done

    @promise
    def it_says_what_came_of_it(self) -> None:
        """Given a stage then it answers with an Effect in words, and with happened only where it did something."""
        effect, done = self.performed()
        demand(isinstance(effect, Effect), f"answers {effect!r}, not an Effect")
        demand(isinstance(effect.happened, bool), f"happened is {effect.happened!r}")
        demand(isinstance(effect.what, str) and effect.what, "does not say what came of it")
        demand(done or not effect.happened, f"says that something happened ({effect.what}) and did nothing")

    @promise
    def the_same_stage_gives_the_same_doing(self) -> None:
        """Given the same stage then it does the same: no clock, no chance, nothing remembered."""
        demand(self.performed() == self.performed(), "does something else the second time")
