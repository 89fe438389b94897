"""A controller behind its door."""

import math

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Goal, Path
from simscen.model.stack_base import ControllerSpec
from simscen.stack.installed.guarded_calls import Watched
from simscen.stack.protocols import Controller, CostmapView
from simscen.stack.setting import Setting


class InstalledController(Watched):
    """Asks the controller, and looks at its commands before anybody obeys them."""

    def __init__(self, spec: ControllerSpec, setting: Setting) -> None:
        super().__init__("controller", spec, setting, Controller)

    def set_path(self, path: Path) -> None:
        """Follow this path from now on."""
        self.ask(self.inner.set_path, path)

    @property
    def full_speed(self) -> float:
        """What it drives at in m/s where nothing limits it."""
        speed = self.ask(lambda: self.inner.full_speed)
        if not isinstance(speed, float | int) or not math.isfinite(speed) or speed < 0:
            self.broke(f"says that its full speed is {speed!r}")
        return float(speed)

    def set_speed_limit(self, limit: float | None) -> None:
        """Drive no faster than this in m/s from now on; None lifts the limit."""
        self.ask(self.inner.set_speed_limit, limit)

    def command(self, pose: Pose2, twist: Twist, costmap: CostmapView, goal: Goal) -> Twist:
        """The controller's command. Raises RunError when it is none."""
        return self.checked_twist(self.ask(self.inner.command, pose, twist, costmap, goal))

    @property
    def local_plan(self) -> Path | None:
        """The arc it expects to drive, for the log."""
        plan = self.ask(lambda: self.inner.local_plan)
        return None if plan is None else self.checked_path(plan, "expects to drive")
