"""Base classes of actions, and the choice of an action by its key.

A stage is the interface through which an action reads and changes the running simulation (simscen.core.stage).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import replace
from typing import Annotated, Any, ClassVar, cast

from simscen.core.errors import BROKEN_COMPONENT, RunError
from simscen.core.stage import Effect, Situation, Stage
from simscen.spec.base import LazySpec
from simscen.spec.choice import Choice
from simscen.spec.places import RobotName


class Action(ABC):
    """Change that an event of a scenario makes to the running world."""

    @property
    def is_robot_specific(self) -> bool:
        """Whether the effect depends on which of several robots the action is for."""
        return True

    @abstractmethod
    def perform(self, stage: Stage) -> Effect:
        """Perform the action and return its effect. Every change is made, and logged, through the stage."""


class WorldAction(Action):
    """Action that is the same for all robots."""

    @property
    def is_robot_specific(self) -> bool:
        """Always False."""
        return False


class AnyAction(Choice):
    """One action, chosen by its key."""

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
        """Return whether it can do what actions of these kinds do; an action of a plugin can do anything."""
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
        return action.perform(stage) if self.original_class is None else perform_checked(action, stage, self.added_by)


_QUERIES = frozenset({*dir(Situation), "has_room", "rng", "door", "motion", "mass"})
"""Members of a stage that only return information; all others change the run."""


def perform_checked(action: Action, stage: Stage, origin: str) -> Effect:
    """Perform an action of a plugin; raises RunError if its effect is invalid or contradicts what it did.

    `origin` names the plugin at the end of a message.
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
