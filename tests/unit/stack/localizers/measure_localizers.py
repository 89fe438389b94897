"""Measure the accuracy of localizers for the tables of docs/reference/localizers.md.

Call it as `python tests/unit/stack/localizers/measure_localizers.py`. All drives are in the synthetic room.
"""

import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from hard_drives import kidnapped, with_people_and_slip

from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Estimate
from simscen.core.messages.sensor_data import Odometry
from simscen.model.localizers import Amcl, Ekf
from simscen.model.localizers import Localizer as Spec
from simscen.testing.synthetic_room import (
    DEFAULT_NOISE,
    Noise,
    RoomDrive,
    build_localizer,
    drive,
    nees,
    pose_errors,
    run_localizer,
    scan,
)

SUM = Amcl(laser_model_type="likelihood_field")
PROB = Amcl(laser_model_type="likelihood_field_prob")
BEAM = Amcl(laser_model_type="beam")
MANY = Amcl(laser_model_type="likelihood_field", max_particles=5000)
RECOVERING = Amcl(
    laser_model_type="likelihood_field",
    max_particles=5000,
    recovery_alpha_slow=0.001,
    recovery_alpha_fast=0.1,
)
RECOVERING_PROB = RECOVERING.model_copy(update={"laser_model_type": "likelihood_field_prob"})
EXACT_EKF = Ekf(type="ekf", translation_noise=0.01, rotation_noise=0.01, gyro_noise=0.002)
# Noise parameters of a well-tuned filter: the motion noise of the wheels, and the accuracy of the cells of the map.
TUNED = PROB.model_copy(update={"alpha1": 1e-3, "alpha2": 1e-3, "alpha3": 1e-3, "alpha4": 1e-3, "sigma_hit": 0.05})
FOUND_M, FOUND_RAD = 0.25, 0.25
"""Errors of position and heading below which a robot counts as found."""
START_STD = np.array([0.1, 0.1, 0.05])
"""Standard deviations of the initial estimate (m, m, rad)."""


@dataclass(frozen=True, eq=False)
class TrackingErrors:
    """Errors of n runs: RMSE of the position in m (n,) and of the heading in rad (n,).

    `anees` (25,) is the NEES averaged over the runs, at each of 25 times.
    """

    rmse: Array
    yaw: Array
    anees: Array


def tracking(
    spec: Spec, seeds: Iterable[int], seconds: float, noise: Noise = DEFAULT_NOISE, imu: bool = False
) -> TrackingErrors:
    """Run a localizer on a drive with a known start. The times of the NEES are in the last three quarters of the drive.

    The errors of the initial estimates have the standard deviations START_STD, which the localizer knows.
    """
    squares, consistency, path = [], [], drive(seconds)
    for seed in seeds:
        start = Pose2(*(path.truth[0] + np.random.default_rng((seed, 3)).normal(0, START_STD)))
        localizer = build_localizer(spec, Estimate(start, tuple(START_STD)), seed)
        beliefs = run_localizer(localizer, path, seed, noise, imu=imu)
        error = pose_errors(beliefs, path.truth)
        times = np.linspace(0.25, 1, 25) * (len(error) - 1)
        squares.append((np.mean(error[:, 0] ** 2 + error[:, 1] ** 2), np.mean(error[:, 2] ** 2)))
        consistency.append([nees(beliefs[k], error[k]) for k in times.astype(int)])
    rmse, yaw = np.sqrt(squares).T
    return TrackingErrors(rmse, yaw, np.mean(consistency, axis=0))


@dataclass(frozen=True, eq=False)
class Relocalization:
    """Results of n runs.

    found: whether the localizer had found the robot by the last second, and did not lose the robot again (n,)
    seconds: time until the errors stayed small, in s (n,)
    """

    found: "np.ndarray[tuple[int, ...], np.dtype[np.bool_]]"
    seconds: Array


def relocalization(
    spec: Spec, seeds: Iterable[int], drives: "dict[int, tuple[RoomDrive, Estimate]]", begin: float = 0.0
) -> Relocalization:
    """Run a localizer with each seed on the drive and from the initial estimate of this seed.

    Times are measured from `begin` (s).
    """
    rows = []
    for seed in seeds:
        path, estimate = drives[seed]
        error = np.abs(pose_errors(run_localizer(build_localizer(spec, estimate, seed), path, seed), path.truth))
        lost = np.flatnonzero((np.hypot(error[:, 0], error[:, 1]) > FOUND_M) | (error[:, 2] > FOUND_RAD))
        last = lost[-1] + 1 if len(lost) else 0
        rows.append((last <= len(error) - 40, last / 40 - begin))
    found, seconds = np.array(rows).T
    return Relocalization(found.astype(np.bool_), seconds)


def errors_among_people(spec: Spec, seeds: Iterable[int], seconds: float = 60.0) -> Array:
    """Return RMSE and largest error (n, 2) in m for drives with people, moved furniture, slip, and a known start."""
    rows = []
    for seed in seeds:
        path = with_people_and_slip(drive(seconds, seed % 12), seed)
        start = Estimate(Pose2(*path.truth[0]), tuple(START_STD))
        beliefs = run_localizer(build_localizer(spec, start, seed), path, seed)
        distance = np.hypot(*pose_errors(beliefs, path.truth)[:, :2].T)
        rows.append((np.sqrt(np.mean(distance**2)), distance.max()))
    return np.array(rows)


def wrong_start(spec: Spec, seeds: Iterable[int]) -> Relocalization:
    """Return the results for initial estimates that are wrong by 0.5 m in a random direction, and by 20°."""
    drives = {}
    for seed in seeds:
        rng, path = np.random.default_rng((seed, 4)), drive(20.0, seed % 12)
        x, y, yaw = path.truth[0]
        direction, side = rng.uniform(-np.pi, np.pi), rng.choice([-1, 1])
        guess = Pose2(x + 0.5 * np.cos(direction), y + 0.5 * np.sin(direction), yaw + side * np.deg2rad(20))
        drives[seed] = (path, Estimate(guess))
    return relocalization(spec, seeds, drives)


def global_start(spec: Spec, seeds: Iterable[int]) -> Relocalization:
    """Return the results without an initial estimate."""
    return relocalization(spec, seeds, {seed: (drive(40.0, seed % 12), Estimate(None)) for seed in seeds})


def kidnapping(spec: Spec, seeds: Iterable[int]) -> Relocalization:
    """Return the results for a robot that is moved to another place after 10 s, and drives for another 60 s."""
    drives = {}
    for seed in seeds:
        path = kidnapped(drive(10.0, seed % 12), drive(60.0, (seed + 5) % 12))
        drives[seed] = (path, Estimate(Pose2(*path.truth[0])))
    return relocalization(spec, seeds, drives, begin=10.0)


def update_cost(spec: Amcl, particles: int) -> float:
    """Return the wall time in ms of one update by a scan with this number of particles, as median of 100."""
    path = drive(20.0)
    fixed_spec = spec.model_copy(update={"min_particles": particles, "max_particles": particles})
    localizer, costs = build_localizer(fixed_spec, Estimate(Pose2(*path.truth[0])), 1), []
    for tick in range(100):
        localizer.on_odometry(Odometry("odom", tick, Pose2(0.0, 0.0, 0.25 * (tick % 2)), Twist()))
        start = time.perf_counter()
        localizer.on_scan(scan(path.ranges[0], tick))
        costs.append(time.perf_counter() - start)
    return float(np.median(costs)) * 1e3


def main() -> None:
    """Print all results, with fifty seeds each, and ten among people."""
    print_costs()
    print_tracking(range(1, 51))
    print_relocalization(range(1, 51))
    print_among_people(range(1, 11))


def print_among_people(seeds: Iterable[int]) -> None:
    """Print the errors with and without recovery, if the start is known and map and odometry are wrong."""
    many = PROB.model_copy(update={"max_particles": 5000})
    for name, spec in (("amcl", MANY), ("recovery", RECOVERING), ("prob", many), ("prob, recovery", RECOVERING_PROB)):
        rmse, largest = errors_among_people(spec, seeds).T
        print(f"among people, {name}: RMSE {rmse.mean():.2f} m (worst {rmse.max():.2f}), "
              f"at most {largest.max():.2f} m, {np.sum(largest > 1)} of {len(largest)} ever more than 1 m off",
              flush=True)  # fmt: skip


def print_costs() -> None:
    """Print the wall time of one update."""
    for spec in (SUM, PROB, BEAM):
        cost = " and ".join(f"{update_cost(spec, n):.2f} ms with {n}" for n in (500, 2000))
        print(f"an update, {spec.laser_model_type}, 60 beams: {cost} particles", flush=True)


def print_tracking(seeds: Iterable[int]) -> None:
    """Print the errors of each localizer on a drive around the room."""
    cases: list[tuple[str, Spec, Noise, bool]] = [
        ("amcl", SUM, DEFAULT_NOISE, False),
        ("amcl, recovery", RECOVERING, DEFAULT_NOISE, False),
        ("amcl, prob", PROB, DEFAULT_NOISE, False),
        ("amcl, prob, recovery", RECOVERING_PROB, DEFAULT_NOISE, False),
        ("amcl, prob, tuned", TUNED, DEFAULT_NOISE, False),
        ("amcl, beam", BEAM, DEFAULT_NOISE, False),
        ("ekf, odometry only, noise as specified", EXACT_EKF, Noise(drift=0.01, gyro_bias=0.002), False),
        ("ekf, with gyroscope, noise as specified", EXACT_EKF, Noise(drift=0.01, gyro_bias=0.002), True),
        ("ekf, defaults", Ekf(type="ekf"), DEFAULT_NOISE, True),
    ]
    for name, spec, noise, imu in cases:
        result = tracking(spec, seeds, 60.0, noise, imu)
        rmse, yaw, below = result.rmse, np.rad2deg(result.yaw.mean()), np.sum(result.rmse <= 0.05)
        print(f"{name}: RMSE {rmse.mean():.4f} m (worst {rmse.max():.4f}, {below} of {len(rmse)} at most 0.05), "
              f"{yaw:.2f}°, ANEES {result.anees.mean():.2f} ({result.anees.min():.2f} to {result.anees.max():.2f})",
              flush=True)  # fmt: skip


def print_relocalization(seeds: Iterable[int]) -> None:
    """Print how many lost robots are found."""
    searches: list[tuple[str, Callable[[Spec, Iterable[int]], Relocalization], Spec]] = [
        ("wrong start, amcl", wrong_start, SUM),
        ("wrong start, prob", wrong_start, PROB),
        ("global, amcl, 2000", global_start, SUM),
        ("global, amcl, 5000", global_start, MANY),
        ("global, prob, 5000", global_start, PROB.model_copy(update={"max_particles": 5000})),
        ("global, prob, 20000", global_start, PROB.model_copy(update={"max_particles": 20_000})),
        ("kidnapped, amcl, recovery, 5000", kidnapping, RECOVERING),
        ("kidnapped, prob, recovery, 5000", kidnapping, RECOVERING_PROB),
        ("kidnapped, amcl, no recovery", kidnapping, SUM),
    ]
    for name, measure, spec in searches:
        result = measure(spec, seeds)
        print(f"{name}: {result.found.sum()} of {len(result.found)}, median {np.median(result.seconds):.1f} s, "
              f"slowest found {result.seconds[result.found].max(initial=0):.1f} s", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
