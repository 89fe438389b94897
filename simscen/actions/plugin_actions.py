"""An action of an installed package: what it says came of it is compared with what it did."""

from typing import Any, cast

from simscen.actions.base import Action
from simscen.core.errors import BROKEN_COMPONENT, RunError
from simscen.core.stage import Effect, Situation, Stage

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
