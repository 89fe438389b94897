"""Registry of the action types, and checks on the effects of actions from plugins."""

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, cast

from simscen.actions.base import Action
from simscen.core.errors import BROKEN_COMPONENT, RunError
from simscen.core.stage import Effect, Situation, Stage
from simscen.spec.choice import Choice
from simscen.spec.lazy import LazySpec
from simscen.spec.places import RobotName

if TYPE_CHECKING:
    from simscen.core.stage import Effect, Stage


class AnyAction(Choice):
    """One thing to do."""

    group: ClassVar[str] = "action"
    modifiers: ClassVar[frozenset[str]] = frozenset({"robot"})

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

        return perform_checked(action, stage, self.added_by)


_TELLING = frozenset({*dir(Situation), "room", "chance", "door", "motion", "mass"})
"""What of a stage only tells how it stands; everything else changes a run."""


def perform_checked(action: Action, stage: Stage, whose: str) -> Effect:
    """Do it, and say what came of it. `whose` ends a message. Raises RunError where that is not so."""
    watched = _Watched(stage)
    effect: object = action.perform(cast(Stage, watched))
    if not isinstance(effect, Effect) or not isinstance(effect.happened, bool) or not isinstance(effect.what, str):
        raise RunError(BROKEN_COMPONENT, f"an action says {effect!r}, which is no Effect{whose}")
    if effect.happened and not watched.done:
        raise RunError(BROKEN_COMPONENT, f"an action says `{effect.what}`, but did nothing{whose}")
    return effect


class _Watched:
    """The stage, and whether anything was done on it."""

    def __init__(self, stage: Stage) -> None:
        self._stage, self.done = stage, False

    def __getattr__(self, name: str) -> Any:
        self.done = self.done or name not in _TELLING
        return getattr(self._stage, name)
