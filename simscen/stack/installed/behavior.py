"""A recovery behavior behind its door."""

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.model.recovery import BehaviorSpec
from simscen.stack.installed.guarded_calls import Watched
from simscen.stack.protocols import Behavior, CostmapView
from simscen.stack.setting import Setting


class InstalledBehavior(Watched):
    """Asks the behavior, and looks at its commands before anybody obeys them. Its name is that of its type."""

    def __init__(self, spec: BehaviorSpec, setting: Setting) -> None:
        super().__init__("behavior", spec, setting, Behavior)
        self.name: str = spec.type or self.inner.name

    def start(self, pose: Pose2) -> None:
        """Begin from this pose."""
        self.ask(self.inner.start, pose)

    def step(self, pose: Pose2, costmap: CostmapView, seconds: float) -> Twist | None:
        """The behavior's command; None when it is done. Raises RunError when it is none of them."""
        command = self.ask(self.inner.step, pose, costmap, seconds)
        return None if command is None else self.checked_twist(command)
