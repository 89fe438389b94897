"""`friction`: something is spilled on the floor, or mopped up."""

from __future__ import annotations

import math

from pydantic import Field, model_validator

from simscen.actions.base import Action
from simscen.core.environment.world_model import Patch, disc_outline
from simscen.core.stage import Effect, Stage
from simscen.spec.base import Spec
from simscen.spec.named_places import PlaceOrPoint
from simscen.spec.places import PlaceName
from simscen.spec.quantities import Friction, PositiveDuration, PositiveLength
from simscen.spec.references import RegionName


class FrictionPatch(Spec, Action):
    """Make a piece of floor slippery, or dry again: a region, or a disc about a point.

    Imitates oil (0.1), a wet or soapy floor (0.3), swarf and dust (0.5). Wheels there hold with no more than this times
    their load (Coulomb): none accelerates or brakes faster than friction x 9.81 m/s², and odometry counts what they
    spin. What is laid later lies on top; the same region or name again replaces it, and `value: 1` mops up.

    Example: `do: {friction: {at: [3, 1], radius: 0.8 m, value: 0.1, for: 10 s}}`
    """

    region: RegionName | None = None
    """A region of the world."""
    at: PlaceOrPoint | None = None
    """Instead: the middle of a disc, [x, y] or a place."""
    radius: PositiveLength | None = None
    """Of that disc."""
    name: PlaceName = "patch"
    """Of a disc: what it is called, so that another action can replace it."""
    value: Friction
    """The coefficient of friction between the floor and rubber wheels; 1 is dry concrete."""
    for_: PositiveDuration | None = Field(default=None, alias="for")
    """How long it is there; default: for good."""

    @model_validator(mode="after")
    def _where(self) -> FrictionPatch:
        if (self.region is None) == (self.at is None):
            raise ValueError("expected either region or at")
        if (self.at is None) != (self.radius is None):
            raise ValueError("a disc needs both `at` and `radius`")
        return self

    @property
    def of_a_robot(self) -> bool:
        """The floor is the same for all."""
        return False

    def perform(self, stage: Stage) -> Effect:
        """Lay it down; whoever drives there will notice."""
        if self.region is not None:
            name, outline, where = self.region, stage.region(self.region), f"in {self.region}"
        else:
            assert self.at is not None and self.radius is not None  # the validator promises it
            x, y = self.at
            name, outline, where = self.name, disc_outline((x, y), self.radius), f"around ({x:g}, {y:g})"
        until = math.inf if self.for_ is None else stage.tick + stage.clock.ticks(self.for_)
        stage.lay(name, Patch(outline, self.value, until))
        return Effect(True, f"made the friction of the floor {where} {self.value:g}")
