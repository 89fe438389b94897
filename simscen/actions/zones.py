"""`keepout`, `speed_zone`: zones of the stack's costmap filters are switched on and off."""

from __future__ import annotations

from pydantic import model_validator

from simscen.actions.base import Action
from simscen.core.environment.costmap_filters import ZoneSwitch
from simscen.core.stage import Effect, Stage
from simscen.spec.base import Spec
from simscen.spec.quantities import PositiveSpeed
from simscen.spec.references import RegionName


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
