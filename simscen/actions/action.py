"""The list of actions: a new one is one file and one line here."""

from simscen.actions.base import Action
from simscen.actions.doors import CloseDoor, OpenDoor
from simscen.actions.goals import CancelGoal, NewGoal
from simscen.actions.move import Move
from simscen.actions.remove import Remove
from simscen.actions.robot import Kidnap, Push
from simscen.actions.spawn import Spawn
from simscen.core.stage import Stage
from simscen.spec.base import Choice


class AnyAction(Choice):
    """One thing to do."""

    spawn: Spawn | None = None
    remove: Remove | None = None
    move: Move | None = None
    open: OpenDoor | None = None
    close: CloseDoor | None = None
    kidnap: Kidnap | None = None
    push: Push | None = None
    new_goal: NewGoal | None = None
    cancel_goal: CancelGoal | None = None

    def perform(self, stage: Stage) -> None:
        """Do it now."""
        action = self.chosen
        assert isinstance(action, Action)
        action.perform(stage)
