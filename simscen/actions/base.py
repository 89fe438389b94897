"""Base classes of actions, the choice of an action by its YAML key, and the check of actions from plugins.

A stage is the interface through which an action reads and changes the running simulation (simscen.core.stage).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import replace
from typing import Annotated, Any, ClassVar, cast

from simscen.core.errors import BROKEN_COMPONENT, RunError
from simscen.core.geometry import Pose2, wrap
from simscen.core.stage import Effect, Situation, Stage
from simscen.spec.base import LazySpec
from simscen.spec.choice import Choice
from simscen.spec.places import RobotName

POSE_TOLERANCE_M_RAD = 1e-3
"""Difference in position (m) and heading (rad) below which two poses count as equal."""
_QUERIES = frozenset({*dir(Situation), "has_room", "rng", "door", "motion", "mass"})
"""Members of a stage that only return information; all others change the run."""


class Action(ABC):
    """Change that an event of a scenario makes to the running simulation."""

    @property
    def is_robot_specific(self) -> bool:
        """Whether the effect depends on which of several robots the action is for."""
        return True

    @abstractmethod
    def perform(self, stage: Stage) -> Effect:
        """Perform the action and return its effect. Every change is made, and logged, through the stage."""


class WorldAction(Action):
    """Action on the world, whose effect is the same for all robots."""

    @property
    def is_robot_specific(self) -> bool:
        """Always False."""
        return False


class AnyAction(Choice):
    """One action, chosen by its YAML key."""

    group: ClassVar[str] = "action"
    modifiers: ClassVar[frozenset[str]] = frozenset({"robot"})

    spawn: Annotated[Action | None, LazySpec("simscen.actions.objects", "Spawn")] = None
    pedestrian: Annotated[Action | None, LazySpec("simscen.actions.pedestrian", "Pedestrian")] = None
    crowd: Annotated[Action | None, LazySpec("simscen.actions.pedestrian", "Crowd")] = None
    remove: Annotated[Action | None, LazySpec("simscen.actions.objects", "Remove")] = None
    move: Annotated[Action | None, LazySpec("simscen.actions.objects", "Move")] = None
    teleport: Annotated[Action | None, LazySpec("simscen.actions.objects", "Teleport")] = None
    stop: Annotated[Action | None, LazySpec("simscen.actions.objects", "Stop")] = None
    open: Annotated[Action | None, LazySpec("simscen.actions.objects", "OpenDoor")] = None
    close: Annotated[Action | None, LazySpec("simscen.actions.objects", "CloseDoor")] = None
    kidnap: Annotated[Action | None, LazySpec("simscen.actions.robot", "Kidnap")] = None
    push: Annotated[Action | None, LazySpec("simscen.actions.robot", "Push")] = None
    new_goal: Annotated[Action | None, LazySpec("simscen.actions.robot", "NewGoal")] = None
    cancel_goal: Annotated[Action | None, LazySpec("simscen.actions.robot", "CancelGoal")] = None
    friction: Annotated[Action | None, LazySpec("simscen.actions.regions", "FrictionPatch")] = None
    keepout: Annotated[Action | None, LazySpec("simscen.actions.regions", "SwitchKeepout")] = None
    speed_zone: Annotated[Action | None, LazySpec("simscen.actions.regions", "SwitchSpeedZone")] = None
    mark: Annotated[Action | None, LazySpec("simscen.actions.mark", "Mark")] = None

    robot: RobotName | None = None
    """The robot that the action is for, if there are several; default: the only one."""

    def may_do(self, *kinds: str) -> bool:
        """Return whether the action is of one of these `kinds` or from a plugin, which may do anything.

        Without `kinds`, returns whether the action is from a plugin.
        """
        return self.kind in kinds or self.original_class is not None

    def perform(self, stage: Stage) -> Effect:
        """Perform the action and return its effect, which starts with the name of the robot if one is given."""
        if self.robot is None:
            return self._perform_chosen(stage)
        effect = self._perform_chosen(stage.of(self.robot))
        return replace(effect, what=f"{self.robot}: {effect.what}")

    def _perform_chosen(self, stage: Stage) -> Effect:
        action = self.chosen
        assert isinstance(action, Action)
        if self.original_class is None:
            return action.perform(stage)
        return perform_checked(action, stage, self.plugin_suffix)


def is_same_pose(first: Pose2, second: Pose2) -> bool:
    """Return whether two poses are equal within POSE_TOLERANCE_M_RAD."""
    is_same_position = first.distance(second) < POSE_TOLERANCE_M_RAD
    return is_same_position and abs(wrap(first.yaw - second.yaw)) < POSE_TOLERANCE_M_RAD


def perform_checked(action: Action, stage: Stage, origin: str) -> Effect:
    """Perform an action of a plugin and return its effect.

    Raises RunError if the effect is not valid, or states a change although the action changed nothing. `origin` names
    the plugin at the end of the message.
    """
    observed = _ObservedStage(stage)
    effect: object = action.perform(cast(Stage, observed))
    if not isinstance(effect, Effect) or not isinstance(effect.happened, bool) or not isinstance(effect.what, str):
        raise RunError(BROKEN_COMPONENT, f"an action returned {effect!r}, which is not an Effect{origin}")
    if effect.happened and not observed.changed:
        raise RunError(BROKEN_COMPONENT, f"an action returned the effect `{effect.what}`, but changed nothing{origin}")
    return effect


class _ObservedStage:
    """A stage that records whether a member that changes the run was used."""

    def __init__(self, stage: Stage) -> None:
        self._stage, self.changed = stage, False

    def __getattr__(self, name: str) -> Any:
        self.changed = self.changed or name not in _QUERIES
        return getattr(self._stage, name)
