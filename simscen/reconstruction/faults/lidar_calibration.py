"""Estimates systematic errors of a lidar: a wrong mounting pose, and a bias, wrong scale, or drift of the ranges."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.reconstruction.compared_scans import ComparedScans
from simscen.reconstruction.reasons import FoundFault, Reason
from simscen.reconstruction.static_world import StaticWorld, offset_poses

TARGET_SCANS = 40
"""Minimum number of scans that are used from a long drive. At most twice as many scans are used."""
STEP_M, STEP_RAD = 0.01, math.radians(0.25)
"""Changes of the mount for the numerical derivatives of the ranges."""
TRIED_YAWS_RAD = tuple(math.radians(yaw) for yaw in range(-24, 25, 3))
"""Yaw errors of the mount to try as initial values of the estimate."""
MAX_MISFIT_RATIO = 0.7
"""Maximum ratio of the median range difference at a tried yaw error to the median range difference at the nominal
mount. At a larger ratio, the estimate starts at the nominal mount."""
ITERATIONS = 6
"""Number of Gauss-Newton steps."""
OUTLIER_M, MIN_OUTLIER_M = 0.5, 0.1
"""Difference between measured and expected range above which a beam is ignored, and minimum of this limit. While the
mount is estimated, the limit is halved after each Gauss-Newton step."""
MAX_SLOPE = 20.0
"""Maximum derivative of a range, in m per m or rad. At edges of objects, derivatives are larger."""
MIN_BEAMS = 200
"""Minimum number of beams for estimating the mount."""
MIN_OFFSET_M, MIN_OFFSET_RAD = 0.03, math.radians(1.0)
"""Minimum error of the mount that is reported."""
MIN_BIAS_M, MIN_SCALE_ERROR, MIN_DRIFT_M_S = 0.03, 0.015, 0.003
"""Minimum bias of the ranges, minimum deviation of their scale from 1, and minimum drift that are reported."""


def mount_error(compared: ComparedScans, world: StaticWorld) -> Pose2:
    """Return the true pose of the lidar relative to the nominal mount, by Gauss-Newton steps on the range differences.

    The poses of the drive must be a ground truth. Return the identity if too few beams hit the static world.
    """
    step = max(1, len(compared.scans) // TARGET_SCANS)
    rows = np.flatnonzero(~compared.scans.is_malformed)[::step]
    error = Pose2(0.0, 0.0, 0.0)
    if not len(rows):
        return error
    ranges, angles, range_max = compared.scans.ranges[rows], compared.scans.angles, compared.scans.range_max
    is_hit = compared.is_hit[rows]
    if int(is_hit.sum()) < MIN_BEAMS:
        return error

    def differences(offset: Pose2) -> Array:
        return ranges - world.ranges_from(offset_poses(compared.poses[rows], offset), angles, range_max)

    def misfit(yaw: float) -> float:
        clipped = np.minimum(np.abs(differences(Pose2(0.0, 0.0, yaw))), 1.0)
        return float(np.nanmedian(np.where(is_hit, clipped, np.nan)))

    with np.errstate(invalid="ignore"):
        misfits = {yaw: misfit(yaw) for yaw in TRIED_YAWS_RAD}
    best_yaw = min(TRIED_YAWS_RAD, key=lambda yaw: (misfits[yaw], abs(yaw)))
    error = Pose2(0.0, 0.0, best_yaw if misfits[best_yaw] < MAX_MISFIT_RATIO * misfits[0.0] else 0.0)
    outlier_limit = OUTLIER_M
    for _ in range(ITERATIONS):
        with np.errstate(invalid="ignore"):
            current = differences(error)
            slopes = [
                (differences(error.compose(change)) - current) / size
                for change, size in (
                    (Pose2(STEP_M, 0.0), STEP_M),
                    (Pose2(0.0, STEP_M), STEP_M),
                    (Pose2(0.0, 0.0, STEP_RAD), STEP_RAD),
                )
            ]
            jacobian = np.stack(slopes, axis=-1)
            is_used = is_hit & (np.abs(current) < outlier_limit) & (np.abs(jacobian).max(axis=-1) < MAX_SLOPE)
        if int(is_used.sum()) < MIN_BEAMS:
            return Pose2(0.0, 0.0, 0.0)
        # The last column is a constant error of all ranges, which must not look like a shift of the mount.
        matrix = np.column_stack((jacobian[is_used], -np.ones(int(is_used.sum()))))
        solution = np.linalg.lstsq(matrix, -current[is_used], rcond=None)[0]
        error = error.compose(Pose2(float(solution[0]), float(solution[1]), float(solution[2])))
        outlier_limit = max(MIN_OUTLIER_M, outlier_limit / 2)
    return error


def mount_fault(error: Pose2) -> FoundFault | None:
    """Return the fault of a wrong mount of the lidar. `error` is the `mount_error`. Return None if it is small."""
    shift = math.hypot(error.x, error.y)
    if shift < MIN_OFFSET_M and abs(error.yaw) < MIN_OFFSET_RAD:
        return None
    values: dict[str, object] = {}
    if shift >= MIN_OFFSET_M / 3:
        values |= {"x": f"{100 * error.x:.1f} cm", "y": f"{100 * error.y:.1f} cm"}
    if abs(error.yaw) >= MIN_OFFSET_RAD / 3:
        values["yaw"] = f"{math.degrees(error.yaw):.1f} deg"
    angle = math.degrees(error.yaw)
    text = f"the scans fit the walls if the lidar is turned by {angle:.1f} deg and shifted by {shift:.2f} m"
    return FoundFault("lidar", "extrinsic", values, reason=Reason(text, None, None, "medium"))


def with_corrected_mount(compared: ComparedScans, world: StaticWorld, error: Pose2) -> ComparedScans:
    """Return the comparison of the scans for the corrected mount of the lidar. `error` is the `mount_error`."""
    poses = offset_poses(compared.poses, error)
    expected = world.ranges_from(poses, compared.scans.angles, compared.scans.range_max)
    return replace(compared, poses=poses, expected=expected)


def range_error_faults(compared: ComparedScans) -> Iterator[FoundFault]:
    """Yield at most one fault: a drift, a wrong scale, or a constant error (bias) of all ranges."""
    residuals = np.where(np.abs(np.nan_to_num(compared.residuals, nan=9.0)) < OUTLIER_M, compared.residuals, np.nan)
    has_residuals = np.isfinite(residuals).sum(axis=1) >= 20
    if int(has_residuals.sum()) < 10:
        return
    medians, times = np.nanmedian(residuals[has_residuals], axis=1), compared.scans.times[has_residuals]
    slope, start = np.polyfit(times - times[0], medians, 1).tolist()
    change = slope * float(times[-1] - times[0])
    if abs(slope) > MIN_DRIFT_M_S and abs(change) > 2 * MIN_BIAS_M and abs(change) > 2 * abs(start):
        text = f"the ranges drift by {100 * change:.1f} cm during the drive"
        values = {"range": f"{100 * slope:.2f} cm/s"}
        yield FoundFault("lidar", "drift", values, reason=Reason(text, float(times[0]), float(times[-1]), "medium"))
        return
    is_finite = np.isfinite(residuals)
    expected, errors = compared.expected[is_finite], residuals[is_finite]
    scale_error, bias = np.polyfit(expected, errors, 1).tolist()
    if abs(scale_error) > MIN_SCALE_ERROR and abs(scale_error * float(np.mean(expected))) > abs(bias):
        text = f"ranges are {100 * (1 + scale_error):.1f} % of the distances"
        yield FoundFault("lidar", "scale", {"factor": f"{100 * (1 + scale_error):.1f} %"}, reason=Reason(text))
    elif abs(float(np.median(errors))) > MIN_BIAS_M:
        bias = float(np.median(errors))
        text = f"ranges differ from the distances by {100 * bias:.1f} cm"
        yield FoundFault("lidar", "bias", {"range": f"{100 * bias:.1f} cm"}, reason=Reason(text))
