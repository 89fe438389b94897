"""The list of actions: a new one is one file and one line here."""

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, ClassVar

from simscen.actions.base import Action
from simscen.spec.choice import Choice
from simscen.spec.lazy import LazySpec
from simscen.spec.places import RobotName

if TYPE_CHECKING:
    from simscen.core.stage import Effect, Stage


class AnyAction(Choice):
    """One thing to do."""

    group: ClassVar[str] = "action"
    modifiers: ClassVar[frozenset[str]] = frozenset({"robot"})

    spawn: Annotated[Action | None, LazySpec("simscen.actions.spawn", "Spawn")] = None
    pedestrian: Annotated[Action | None, LazySpec("simscen.actions.pedestrian", "Pedestrian")] = None
    crowd: Annotated[Action | None, LazySpec("simscen.actions.pedestrian", "Crowd")] = None
    remove: Annotated[Action | None, LazySpec("simscen.actions.remove", "Remove")] = None
    move: Annotated[Action | None, LazySpec("simscen.actions.move", "Move")] = None
    teleport: Annotated[Action | None, LazySpec("simscen.actions.teleport", "Teleport")] = None
    stop: Annotated[Action | None, LazySpec("simscen.actions.stop", "Stop")] = None
    open: Annotated[Action | None, LazySpec("simscen.actions.doors", "OpenDoor")] = None
    close: Annotated[Action | None, LazySpec("simscen.actions.doors", "CloseDoor")] = None
    kidnap: Annotated[Action | None, LazySpec("simscen.actions.kidnap", "Kidnap")] = None
    push: Annotated[Action | None, LazySpec("simscen.actions.push", "Push")] = None
    new_goal: Annotated[Action | None, LazySpec("simscen.actions.goals", "NewGoal")] = None
    cancel_goal: Annotated[Action | None, LazySpec("simscen.actions.goals", "CancelGoal")] = None
    friction: Annotated[Action | None, LazySpec("simscen.actions.friction", "FrictionPatch")] = None
    keepout: Annotated[Action | None, LazySpec("simscen.actions.zones", "SwitchKeepout")] = None
    speed_zone: Annotated[Action | None, LazySpec("simscen.actions.zones", "SwitchSpeedZone")] = None
    mark: Annotated[Action | None, LazySpec("simscen.actions.mark", "Mark")] = None

    robot: RobotName | None = None
    """Which of several robots it is about; default: the only one."""

    def may(self, *kinds: str) -> bool:
        """Whether it does one of these; an action of an installed package may do anything."""
        return self.kind in kinds or self.narrow is not None

    def perform(self, stage: "Stage") -> "Effect":
        """Do it now, and say what came of it, and of which robot where it names one."""
        if self.robot is None:
            return self._done(stage)
        effect = self._done(stage.of(self.robot))
        return replace(effect, what=f"{self.robot}: {effect.what}")

    def _done(self, stage: "Stage") -> "Effect":
        action = self.chosen
        assert isinstance(action, Action)
        if self.narrow is None:
            return action.perform(stage)
        from simscen.actions.plugin_actions import perform_checked

        return perform_checked(action, stage, self.added_by)
