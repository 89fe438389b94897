"""Base classes of actions, and AnyAction, an entry of `do` in YAML.

A Stage (simscen.core.stage) is the interface through which an action reads and changes the running simulation.
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
_READ_ONLY_MEMBERS = frozenset({*dir(Situation), "has_room", "rng", "door", "motion", "mass"})
"""Names of the members of Stage that return information and change nothing."""


class Action(ABC):
    """Change that an event of a scenario makes to the running simulation."""

    @property
    def is_robot_specific(self) -> bool:
        """Whether this action concerns one robot: with several robots, the scenario must name it (key `robot`)."""
        return True

    @abstractmethod
    def perform(self, stage: Stage) -> Effect:
        """Perform the action through `stage`, and return its effect."""


class WorldAction(Action):
    """Action on the world instead of one robot."""

    @property
    def is_robot_specific(self) -> bool:
        return False


class AnyAction(Choice):
    """One action, chosen by its YAML key, such as `spawn`."""

    group: ClassVar[str] = "action"
    """Registry group in which installed packages can add actions."""
    modifiers: ClassVar[frozenset[str]] = frozenset({"robot"})
    """Keys that can be combined with any action."""

    spawn: Annotated[Action | None, LazySpec("simscen.actions.objects", "Spawn")] = None
    pedestrian: Annotated[Action | None, LazySpec("simscen.actions.pedestrian", "Pedestrian")] = None
    crowd: Annotated[Action | None, LazySpec("simscen.actions.pedestrian", "Crowd")] = None
    remove: Annotated[Action | None, LazySpec("simscen.actions.objects", "Remove")] = None
    move: Annotated[Action | None, LazySpec("simscen.actions.objects", "Move")] = None
    teleport: Annotated[Action | None, LazySpec("simscen.actions.objects", "Teleport")] = None
    stop: Annotated[Action | None, LazySpec("simscen.actions.objects", "Stop")] = None
    open: Annotated[Action | None, LazySpec("simscen.actions.doors", "OpenDoor")] = None
    close: Annotated[Action | None, LazySpec("simscen.actions.doors", "CloseDoor")] = None
    kidnap: Annotated[Action | None, LazySpec("simscen.actions.robot", "Kidnap")] = None
    push: Annotated[Action | None, LazySpec("simscen.actions.robot", "Push")] = None
    new_goal: Annotated[Action | None, LazySpec("simscen.actions.robot", "NewGoal")] = None
    cancel_goal: Annotated[Action | None, LazySpec("simscen.actions.robot", "CancelGoal")] = None
    friction: Annotated[Action | None, LazySpec("simscen.actions.regions", "FrictionPatch")] = None
    keepout: Annotated[Action | None, LazySpec("simscen.actions.regions", "SwitchKeepout")] = None
    speed_zone: Annotated[Action | None, LazySpec("simscen.actions.regions", "SwitchSpeedZone")] = None
    mark: Annotated[Action | None, LazySpec("simscen.actions.mark", "Mark")] = None

    robot: RobotName | None = None
    """The robot that the action concerns, if there are several robots; default: the only robot."""

    def may_do(self, *kinds: str) -> bool:
        """Return whether the action has one of the YAML keys `kinds`, or is from a plug-in, whose effect is unknown."""
        return self.kind in kinds or self.original_class is not None

    def perform(self, stage: Stage) -> Effect:
        """Perform the chosen action and return its effect. If `robot` is set, the text of the effect starts with it."""
        action, stage = self.chosen, stage if self.robot is None else stage.of(self.robot)
        assert isinstance(action, Action)
        is_from_plugin = self.original_class is not None
        effect = _perform_plugin_action(action, stage, self.plugin_suffix) if is_from_plugin else action.perform(stage)
        return effect if self.robot is None else replace(effect, what=f"{self.robot}: {effect.what}")


def is_same_pose(first: Pose2, second: Pose2) -> bool:
    """Return whether two poses are equal within POSE_TOLERANCE_M_RAD."""
    is_same_position = first.distance(second) < POSE_TOLERANCE_M_RAD
    return is_same_position and abs(wrap(first.yaw - second.yaw)) < POSE_TOLERANCE_M_RAD


def _perform_plugin_action(action: Action, stage: Stage, origin: str) -> Effect:
    """Perform an action of a plug-in and return its effect.

    Raises RunError if the effect is not valid, or if it states a change but the action changed nothing. The error
    message ends with `origin`, which names the plug-in.
    """
    observed = _ObservedStage(stage)
    effect: object = action.perform(cast(Stage, observed))
    if not isinstance(effect, Effect) or not isinstance(effect.happened, bool) or not isinstance(effect.what, str):
        raise RunError(BROKEN_COMPONENT, f"an action returned {effect!r}, which is not an Effect{origin}")
    if effect.happened and not observed.was_changed:
        raise RunError(BROKEN_COMPONENT, f"an action returned the effect `{effect.what}`, but changed nothing{origin}")
    return effect


class _ObservedStage:
    """Wrapper of a stage that records whether an action changes anything through it.

    The stages of other robots, which `of` returns, are wrapped as well.
    """

    def __init__(self, stage: Stage) -> None:
        self._stage, self._others, self._was_changed = stage, list[_ObservedStage](), False

    @property
    def was_changed(self) -> bool:
        """Whether a member that is not in _READ_ONLY_MEMBERS was used, of this stage or a stage of another robot."""
        return self._was_changed or any(other.was_changed for other in self._others)

    def of(self, robot: str) -> Stage:
        self._others.append(_ObservedStage(self._stage.of(robot)))
        return cast(Stage, self._others[-1])

    def __getattr__(self, name: str) -> Any:
        self._was_changed = self._was_changed or name not in _READ_ONLY_MEMBERS
        return getattr(self._stage, name)
