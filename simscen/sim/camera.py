"""Pictures from PyBullet's own software renderer: slow, headless, deterministic."""

import math

import numpy as np
import numpy.typing as npt
import pybullet

from simscen.core.geometry import Pose3

NEAR = 0.02
"""m in front of the lens from which on something is seen."""


def picture(
    client: int, camera: Pose3, width: int, height: int, field_of_view: float, far: float
) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.float32]]:
    """Colors (h, w, 3) and depths (h, w) in meters along the optical axis, inf beyond `far`.

    The camera looks along the x axis of its pose, z is up; `field_of_view` is horizontal, in rad.
    """
    eye, ahead, up = camera.apply(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])).tolist()
    over = [a - b for a, b in zip(up, eye, strict=True)]
    vertical = 2 * math.atan(math.tan(field_of_view / 2) * height / width)
    _, _, rgba, depth, _ = pybullet.getCameraImage(
        width,
        height,
        pybullet.computeViewMatrix(eye, ahead, over),
        pybullet.computeProjectionMatrixFOV(math.degrees(vertical), width / height, NEAR, far),
        shadow=0,
        renderer=pybullet.ER_TINY_RENDERER,
        flags=pybullet.ER_NO_SEGMENTATION_MASK,
        physicsClientId=client,
    )
    buffer = np.reshape(np.asarray(depth, dtype=np.float64), (height, width))
    meters = far * NEAR / (far - (far - NEAR) * buffer)
    meters[buffer >= 1.0] = np.inf
    colors = np.reshape(np.asarray(rgba, dtype=np.uint8), (height, width, 4))[:, :, :3]
    return np.ascontiguousarray(colors), meters.astype(np.float32)
