"""Model predictive path integral control (Williams et al. 2017) with the critics of nav2_mppi_controller.

A thousand noisy versions of the last control sequence are rolled out, each is scored, and the new sequence is their
average weighted by exp(-score / temperature).
"""

import math

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Pose2
from simscen.core.motion import Twist
from simscen.core.navigation import ErrorCode, Goal, Path
from simscen.model.stack import Mppi as MppiSpec
from simscen.stack.controllers.goal_pose import GoalPose
from simscen.stack.controllers.mppi_critics import Rollouts, score
from simscen.stack.controllers.tracking import PathTracker
from simscen.stack.lookahead import time_free
from simscen.stack.protocols import CostmapView, NavigationFailure
from simscen.stack.setting import Setting

Floats = npt.NDArray[np.float32]
SURE = 0.5
"""Seconds that the command must be free of collisions for."""


class MppiController:
    """Keeps a control sequence and improves it at each call.

    The noise is drawn once (nav2's regenerate_noises: false), so that a call costs no random numbers.
    """

    def __init__(self, spec: MppiSpec, setting: Setting) -> None:
        robot, chance, period = setting.robot, setting.chance, setting.control_period
        self._spec, self._robot, self._footprint = spec, robot, setting.footprint
        self._fastest = min(spec.vx_max or robot.max_linear, robot.max_linear)
        self._slowest = max(spec.vx_min, -robot.max_reverse)
        self._turn = min(spec.wz_max, robot.max_angular)
        shape = (spec.batch_size, spec.time_steps)
        self._noise_vx = (chance.standard_normal(shape) * spec.vx_std).astype(np.float32)
        self._noise_wz = (chance.standard_normal(shape) * spec.wz_std).astype(np.float32)
        self._vx, self._wz = (np.zeros(spec.time_steps, dtype=np.float32) for _ in range(2))
        self._shift = period / spec.model_dt
        self._goal_pose = GoalPose(robot, spec.wz_max, robot.angular_acceleration, period)
        self._limit = math.inf
        self._track: PathTracker | None = None
        self._pose: Pose2 | None = None

    def set_path(self, path: Path) -> None:
        """Follow this path from now on; the control sequence is kept as a start."""
        if not len(path.points):
            raise NavigationFailure(ErrorCode.INVALID_PATH, "the path has no points")
        self._track = PathTracker(path)
        self._goal_pose.reset()

    @property
    def full_speed(self) -> float:
        """What it drives at in m/s where nothing limits it."""
        return self._fastest

    def set_speed_limit(self, limit: float | None) -> None:
        """Drive no faster than this in m/s; None lifts the limit."""
        self._limit = math.inf if limit is None else limit

    @property
    def local_plan(self) -> Path | None:
        """What the control sequence would do."""
        if self._pose is None:
            return None
        rolled = self._roll(
            self._pose, Twist(float(self._vx[0]), 0.0, float(self._wz[0])), self._vx[None], self._wz[None]
        )
        return Path(np.column_stack((rolled.x[0], rolled.y[0], rolled.yaw[0])).astype(np.float64))

    def command(self, pose: Pose2, twist: Twist, costmap: CostmapView, goal: Goal) -> Twist:
        """The velocity to drive now. Raises NO_VALID_CONTROL when every rollout, or the average, hits something."""
        if self._track is None:
            raise NavigationFailure(ErrorCode.INVALID_PATH, "there is no path to follow")
        track, self._pose = self._track, pose
        track.locate(pose)
        if self._goal_pose.reached(pose, twist, goal, track.remaining()):
            self._forget()
            command = self._goal_pose.turn_to_goal(pose, goal, twist)
        else:
            self._improve(pose, twist, costmap, goal)
            command = Twist(float(self._vx[1]), 0.0, float(self._wz[1]))
        if time_free(self._footprint, costmap, pose, command, SURE) < SURE:
            self._forget()
            raise NavigationFailure(ErrorCode.NO_VALID_CONTROL, "the best control found hits something")
        return command

    def _improve(self, pose: Pose2, twist: Twist, costmap: CostmapView, goal: Goal) -> None:
        assert self._track is not None
        self._advance()
        # The rollouts obey the limits but the average is over what was asked: else it would shy away from the limits.
        vx, wz = self._vx + self._noise_vx, self._wz + self._noise_wz
        rolled = self._roll(pose, twist, *self._limited(vx, wz))
        cost, hit = score(rolled, self._track, pose, costmap, goal, self._footprint, self._fastest)
        if hit.all():
            self._forget()
            raise NavigationFailure(ErrorCode.NO_VALID_CONTROL, "every rollout hits something")
        spec = self._spec
        cost += spec.gamma / spec.vx_std**2 * ((vx - self._vx) @ self._vx)
        cost += spec.gamma / spec.wz_std**2 * ((wz - self._wz) @ self._wz)
        weight = np.exp(-(cost - cost.min()) / spec.temperature)
        weight /= weight.sum()
        self._vx, self._wz = self._limited(weight @ vx, weight @ wz)

    def _advance(self) -> None:
        """Shift the sequence by one period: it was made for then, and this is now."""
        steps = np.arange(len(self._vx)) + self._shift
        here = np.arange(len(self._vx))
        self._vx = np.interp(steps, here, self._vx).astype(np.float32)
        self._wz = np.interp(steps, here, self._wz).astype(np.float32)

    def _limited(self, vx: Floats, wz: Floats) -> tuple[Floats, Floats]:
        vx = np.clip(vx, self._slowest, min(self._fastest, self._limit)).astype(np.float32)
        turn = np.full_like(vx, self._turn)
        if self._robot.turning_radius > 0.0:
            turn = np.minimum(turn, np.abs(vx) / self._robot.turning_radius)
        return vx, np.clip(wz, -turn, turn).astype(np.float32)

    def _roll(self, pose: Pose2, twist: Twist, vx: Floats, wz: Floats) -> Rollouts:
        """Poses that follow from controls (n, steps): a control holds from its step to the next."""
        dt = np.float32(self._spec.model_dt)
        first_v, first_w = np.full((len(vx), 1), twist.vx, np.float32), np.full((len(wz), 1), twist.wz, np.float32)
        v, w = np.concatenate((first_v, vx[:, :-1]), axis=1), np.concatenate((first_w, wz[:, :-1]), axis=1)
        yaw = np.float32(pose.yaw) + np.cumsum(w, axis=1) * dt
        middle = yaw - np.float32(0.5) * w * dt
        x = np.float32(pose.x) + np.cumsum(v * np.cos(middle), axis=1) * dt
        y = np.float32(pose.y) + np.cumsum(v * np.sin(middle), axis=1) * dt
        return Rollouts(x, y, yaw, v, w)

    def _forget(self) -> None:
        self._vx[:] = 0.0
        self._wz[:] = 0.0
