"""Actions on regions of the floor: `friction`, `keepout`, and `speed_zone`."""

from __future__ import annotations

import math

from pydantic import Field, model_validator

from simscen.actions.base import Action
from simscen.core.environment.costmap_filters import ZoneSwitch
from simscen.core.environment.world_model import Patch, disc_outline
from simscen.core.stage import Effect, Stage
from simscen.spec.base import Spec
from simscen.spec.named_places import PlaceOrPoint
from simscen.spec.places import PlaceName
from simscen.spec.quantities import Friction, PositiveDuration, PositiveLength, PositiveSpeed
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


class SwitchKeepout(Spec, Action):
    """Tell the stack to keep out of a region from now on, or that it may enter it again.

    The stack is told, as by Nav2's `keepout_filter/toggle_filter`, and honors it at the next update of its costmap: a
    plan that leads through is made anew, and one that was made around is looked over. A zone that begins switched off
    is simply not in `stack.keepout`. Imitates a fleet manager that closes an aisle, or an area scanner that opens one.

    Example: `do: {keepout: {region: wet floor, enabled: true}}`
    """

    region: RegionName | None = None
    """A region of the world, whether `stack.keepout` has it or not; default: the whole filter, with its mask."""
    enabled: bool = True
    """Whether it is to be kept out of from now on."""

    def perform(self, stage: Stage) -> Effect:
        """Switch it; nothing comes of it when it is so already, or when the stack cannot be told."""
        order = ZoneSwitch("keepout", self.enabled, self.region)
        return _switched(stage, order, f"keepout of {self.region}" if self.region else "the keepout filter")


class SwitchSpeedZone(Spec, Action):
    """Give the stack a speed limit in a region from now on, or lift it.

    The stack is told, as by Nav2's `speed_filter/toggle_filter`. A zone that begins switched off is simply not in
    `stack.speed_zones`. Imitates a shift that begins, people who enter an aisle, a crossing that is freed at night.

    Example: `do: {speed_zone: {region: crossing, speed_limit: 0.2 m/s}}`
    """

    region: RegionName | None = None
    """A region of the world, whether `stack.speed_zones` has it or not; default: the whole filter, with its mask."""
    speed_limit: PositiveSpeed | None = None
    """While the robot believes itself inside; default: what `stack.speed_zones` says."""
    enabled: bool = True
    """Whether the limit holds from now on."""

    @model_validator(mode="after")
    def _limit_of_what(self) -> SwitchSpeedZone:
        if self.speed_limit is not None and (self.region is None or not self.enabled):
            raise ValueError("speed_limit is for a region that is switched on")
        return self

    def perform(self, stage: Stage) -> Effect:
        """Switch it; nothing comes of it when it is so already, or when the stack cannot be told."""
        order = ZoneSwitch("speed", self.enabled, self.region, self.speed_limit)
        return _switched(stage, order, f"the speed limit in {self.region}" if self.region else "the speed filter")


def _switched(stage: Stage, order: ZoneSwitch, what: str) -> Effect:
    refused = stage.switch_zone(order)
    return Effect(not refused, refused or f"switched {what} {'on' if order.enabled else 'off'}")
