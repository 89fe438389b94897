"""What moves: where it is, how fast and how sure that is, at a moment."""

from dataclasses import dataclass, replace

import numpy as np

from simscen.core.geometry import Array, Pose2


@dataclass(frozen=True, eq=False)
class Moving:
    """Things that move, as upright cylinders, in one frame and at one moment.

    `centres` (n, 2) in m, `velocities` (n, 2) in m/s, `radii` (n,) in m, `covariances` (n, 4, 4) of x, y, vx, vy in
    that order. `acceleration` in m/s² is how fast velocities may change: what is not known of them grows with it.
    """

    centres: Array
    velocities: Array
    radii: Array
    covariances: Array
    acceleration: float

    def __len__(self) -> int:
        return len(self.centres)

    def at(self, times: Array) -> Array:
        """Where they will be (n, times, 2) after `times` (m,) seconds, at constant velocity."""
        moved: Array = self.centres[:, None, :] + self.velocities[:, None, :] * times[None, :, None]
        return moved

    def deviations(self, times: Array) -> Array:
        """Standard deviation (n, times) in m of that, along the axis in which it is greatest."""
        xx = np.maximum(self.covariances[:, 0, 0], self.covariances[:, 1, 1])
        vv = np.maximum(self.covariances[:, 2, 2], self.covariances[:, 3, 3])
        xv = np.maximum(self.covariances[:, 0, 2], self.covariances[:, 1, 3])
        turned = (0.5 * self.acceleration * times**2) ** 2
        grown: Array = np.sqrt(xx[:, None] + 2.0 * xv[:, None] * times + vv[:, None] * times**2 + turned)
        return grown

    def seen_from(self, frame: Pose2) -> "Moving":
        """The same in another frame, which is at `frame` in this one."""
        back = frame.inverse()
        c, s = np.cos(back.yaw), np.sin(back.yaw)
        turn = np.array([[c, -s], [s, c]])
        both = np.kron(np.eye(2), turn)
        return replace(
            self,
            centres=back.apply(self.centres),
            velocities=self.velocities @ turn.T,
            covariances=both @ self.covariances @ both.T,
        )

    def after(self, seconds: float) -> "Moving":
        """The same so many seconds later."""
        step = np.eye(4)
        step[0, 2] = step[1, 3] = seconds
        return replace(
            self, centres=self.centres + self.velocities * seconds, covariances=step @ self.covariances @ step.T
        )

    def chosen(self, which: "np.typing.NDArray[np.bool_]") -> "Moving":
        """Those of them."""
        return replace(
            self,
            centres=self.centres[which],
            velocities=self.velocities[which],
            radii=self.radii[which],
            covariances=self.covariances[which],
        )


def nothing(acceleration: float = 0.0) -> Moving:
    """Nothing moves."""
    return Moving(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0), np.zeros((0, 4, 4)), acceleration)
