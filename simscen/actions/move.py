"""`move`: let an object follow waypoints or timed keyframes."""

from simscen.actions.base import Action
from simscen.core.stage import Effect, Stage
from simscen.spec.motions import Motion
from simscen.spec.references import MovableName


class Move(Motion, Action):
    """Let an object drive through waypoints at a speed, or be where it is said when, along timed keyframes.

    It does not stop for the robot, and nothing can push it from then on. Imitates a cart, a forklift or a person on
    a fixed course, and worlds of moving obstacles like those of DynaBARN (Nair et al., 2022), which are given by
    where each obstacle is when.

    Example: `do: {move: {name: cart, keyframes: [[0, 4, 1, 0], [3, 4, 5, 90 deg], [6, 4, 1, 0]], repeat: loop}}`
    """

    name: MovableName
    """The object to move."""

    @property
    def of_a_robot(self) -> bool:
        """It is about the world."""
        return False

    def perform(self, stage: Stage) -> Effect:
        """Set it going; nothing comes of it when it is not there, or stands at its only waypoint."""
        here = stage.object(self.name)
        if here is None:
            return Effect(False, f"there is nothing called {self.name}")
        path = self.path(here)
        if len(path.poses) == 1 and self.keyframes is None:
            return Effect(False, f"{self.name} stands at its waypoint already")
        stage.move(self.name, path)
        return Effect(True, f"moved {self.name}")
