"""`push`: a blow, or a force for a while, on the robot or on an object."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field, model_validator

from simscen.actions.base import Action
from simscen.core.stage import Effect, Stage
from simscen.spec.base import Spec
from simscen.spec.quantities import Force, Impulse, PositiveDuration
from simscen.spec.references import MovableName


class Push(Spec, Action):
    """Push the robot, or an object that has a mass, at its center: an impulse at once, or a force for a while.

    Imitates somebody who bumps into the robot (`impulse`), and somebody who leans on it, a slope or a gust of wind
    (`force`). A force of F newtons for t seconds gives a mass that nothing holds an impulse of F t.

    Example: `do: {push: {force: [0, 20], for: 1.5 s}}`
    """

    name: MovableName | None = None
    """An object that has a mass; default: the robot."""
    impulse: Annotated[list[Impulse], Field(min_length=2, max_length=2)] | None = None
    """N s along x and y of the world frame, within one tick of the physics."""
    force: Annotated[list[Force], Field(min_length=2, max_length=2)] | None = None
    """Instead: N along x and y of the world frame, for as long as `for` says."""
    for_: PositiveDuration | None = Field(default=None, alias="for")
    """How long the force lasts."""

    @model_validator(mode="after")
    def _how(self) -> Push:
        if (self.impulse is None) == (self.force is None):
            raise ValueError("expected either impulse or force")
        if (self.force is None) != (self.for_ is None):
            raise ValueError("a force needs `for`: how long it lasts" if self.force else "an impulse lasts no time")
        return self

    @property
    def of_a_robot(self) -> bool:
        """It is, unless it is an object that is pushed."""
        return self.name is None

    def perform(self, stage: Stage) -> Effect:
        """Push; nothing comes of a push of zero, or of one on what is not there or has no mass."""
        what, lasts = self.name or "the robot", self.for_ or 0.0
        x, y = self.impulse or self.force or (0.0, 0.0)
        if not math.hypot(x, y):
            return Effect(False, "a push of zero moves nothing")
        if self.name is not None:
            if stage.object(self.name) is None:
                return Effect(False, f"there is nothing called {self.name}")
            if not stage.mass(self.name):
                return Effect(False, f"{self.name} has no mass, or a script moves it: no push does")
        stage.push((x * lasts, y * lasts) if lasts else (x, y), self.name, lasts)
        said = f"{math.hypot(x, y):.1f} N for {lasts:g} s" if lasts else f"{math.hypot(x, y):.1f} N s"
        return Effect(True, f"pushed {what} with {said}")
