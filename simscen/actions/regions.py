"""Actions on regions of the floor: `friction`, `keepout`, and `speed_zone`."""

from __future__ import annotations

import math

from pydantic import Field, model_validator

from simscen.actions.base import Action, WorldAction
from simscen.core.environment.costmap_filters import ZoneSwitch
from simscen.core.environment.world_model import FloorPatch, disc_outline
from simscen.core.stage import Effect, Stage
from simscen.spec.base import Spec
from simscen.spec.places import PlaceName, PlaceOrPoint, RegionName
from simscen.spec.quantities import Friction, PositiveDuration, PositiveLength, PositiveSpeed


class FrictionPatch(Spec, WorldAction):
    """Change the friction of a region or disc of the floor, for example to make it slippery or dry again.

    Typical values: oil 0.1, a wet or soapy floor 0.3, chips and dust 0.5. The friction force of a wheel is at most
    `value` times its load (Coulomb). The robot therefore accelerates and brakes by at most `value` x 9.81 m/s², and
    odometry is wrong while wheels spin. Where patches overlap, the latest counts. An action for the same region or name
    replaces the earlier patch; `value: 1` restores a dry floor.

    Example: `do: {friction: {at: [3, 1], radius: 0.8 m, value: 0.1, for: 10 s}}`
    """

    region: RegionName | None = None
    """A region of the world."""
    at: PlaceOrPoint | None = None
    """Alternatively: the center of a disc, [x, y] in the world frame or a place by name."""
    radius: PositiveLength | None = None
    """Radius of the disc."""
    name: PlaceName = "patch"
    """Name of the disc. A disc replaces an earlier disc of the same name, so discs that exist together need different
    names."""
    value: Friction
    """Coefficient of friction between the floor and rubber wheels; 1 is dry concrete."""
    for_: PositiveDuration | None = Field(default=None, alias="for")
    """Duration of the patch; default: until the end of the run."""

    @model_validator(mode="after")
    def _check_area(self) -> FrictionPatch:
        if (self.region is None) == (self.at is None):
            raise ValueError("expected either region or at")
        if (self.at is None) != (self.radius is None):
            raise ValueError("a disc needs both `at` and `radius`")
        if self.region is not None and "name" in self.model_fields_set:
            raise ValueError("`name` is only for a disc; a patch in a region has the name of the region")
        return self

    def perform(self, stage: Stage) -> Effect:
        if self.region is not None:
            name, outline, where = self.region, stage.region(self.region), f"in {self.region}"
        else:
            assert self.at is not None and self.radius is not None  # _check_area ensures it
            x, y = self.at
            name, outline, where = self.name, disc_outline((x, y), self.radius), f"around ({x:g}, {y:g})"
        until = math.inf if self.for_ is None else stage.tick + stage.clock.ticks(self.for_)
        stage.add_friction_patch(name, FloorPatch(outline, self.value, until))
        return Effect(True, f"set the friction of the floor {where} to {self.value:g}")


class SwitchKeepout(Spec, Action):
    """Enable or disable a keepout zone of the stack.

    The stack receives the command as through Nav2's `keepout_filter/toggle_filter`, and applies it at the next costmap
    update. The stack replans if its path leads through a new zone. If a zone is to be disabled at first, omit it from
    `stack.keepout`. Use the action, for example, for a fleet manager that closes an aisle.

    Example: `do: {keepout: {region: wet floor, enabled: true}}`
    """

    region: RegionName | None = None
    """A region of the world, which need not be in `stack.keepout`; default: the whole filter with its mask."""
    enabled: bool = True
    """Whether the robot must keep out of the zone after this action."""

    def perform(self, stage: Stage) -> Effect:
        """Send the command; has no effect if nothing changes or the stack cannot receive it."""
        command = ZoneSwitch("keepout", self.enabled, self.region)
        return _switch_zone(stage, command, f"keepout of {self.region}" if self.region else "the keepout filter")


class SwitchSpeedZone(Spec, Action):
    """Set or lift a speed limit of the stack in a region.

    The stack receives the command as through Nav2's `speed_filter/toggle_filter`. If a zone is to be disabled at first,
    omit it from `stack.speed_zones`. Use the action, for example, for people who enter an aisle.

    Example: `do: {speed_zone: {region: crossing, speed_limit: 0.2 m/s}}`
    """

    region: RegionName | None = None
    """A region of the world, which need not be in `stack.speed_zones`; default: the whole filter with its mask."""
    speed_limit: PositiveSpeed | None = None
    """Limit while the estimated pose is in the region; default: the limit of the region in `stack.speed_zones`."""
    enabled: bool = True
    """Whether the limit applies after this action."""

    @model_validator(mode="after")
    def _check_limit(self) -> SwitchSpeedZone:
        if self.speed_limit is not None and (self.region is None or not self.enabled):
            raise ValueError("speed_limit needs a region and `enabled: true`")
        return self

    def perform(self, stage: Stage) -> Effect:
        """Send the command; has no effect if nothing changes or the stack cannot receive it."""
        command = ZoneSwitch("speed", self.enabled, self.region, self.speed_limit)
        return _switch_zone(stage, command, f"the speed limit in {self.region}" if self.region else "the speed filter")


def _switch_zone(stage: Stage, command: ZoneSwitch, zone: str) -> Effect:
    """Send a command to the stack and return the effect. `zone` describes the zone in the message."""
    refusal = stage.switch_zone(command)
    return Effect(not refusal, refusal or f"switched {zone} {'on' if command.enabled else 'off'}")
