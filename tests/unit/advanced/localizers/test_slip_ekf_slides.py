"""Tests of the consistency of the slip EKF when robots slide, skid, or are pushed."""

import math

import numpy as np
import pytest
from scipy import stats
from test_slip_ekf_slip import RATE, replay_drive

from simscen.advanced.localizers.slip_model import SlipDetector
from simscen.advanced.spec import SlipEkf
from simscen.core.geometry import Array
from simscen.testing.synthetic_room import nees

SPEC = SlipEkf(type="slip_ekf")
WHEEL_SEPARATION_M = 0.4
Rng = np.random.Generator

# Each disturbance changes true twists `truth` (n, 3) and wheel twists `wheels` (n, 3), both vx, vy, wz at 40 Hz, in
# place. `times` (n,) are seconds since the start of the disturbance.


def slide(rng: Rng, truth: Array, wheels: Array, times: Array) -> None:
    """Push and turn the stationary robot in a random direction."""
    direction, speed = rng.uniform(0, 2 * math.pi), rng.uniform(0.05, 0.6)
    truth[:] = speed * math.cos(direction), speed * math.sin(direction), random_rate(rng, 0.1, 1.0)
    wheels[:] = 0.0


def ramp(rng: Rng, truth: Array, wheels: Array, times: Array) -> None:
    """Slide down a fixed slope with locked brakes, accelerating and turning slowly."""
    truth[:, 2] = random_rate(rng, 0.1, 1.0) * np.minimum(1.0, times / 0.3)
    down = rng.uniform(0, 2 * math.pi) - np.cumsum(truth[:, 2]) / RATE
    speed = rng.uniform(0.1, 0.4) * times
    truth[:, :2] = np.column_stack((speed * np.cos(down), speed * np.sin(down)))
    wheels[:] = 0.0


def turntable(rng: Rng, truth: Array, wheels: Array, times: Array) -> None:
    """Rotate the ground below the robot."""
    slide(rng, truth, wheels, times)
    truth[:, :2] *= abs(truth[0, 2]) / max(0.6, math.hypot(*truth[0, :2]))


def lock(rng: Rng, truth: Array, wheels: Array, times: Array) -> None:
    """Lock the wheels in a turn; the robot slides to a stop."""
    truth *= (1.0 - times / times[-1])[:, None]
    wheels[:] = 0.0


def lock_on_ice(rng: Rng, truth: Array, wheels: Array, times: Array) -> None:
    """Lock the wheels in a turn; the robot keeps its velocity."""
    wheels[:] = 0.0


def lock_left(rng: Rng, truth: Array, wheels: Array, times: Array) -> None:
    """Lock the left wheel: the robot drives a mixture of its earlier motion and a rotation about this wheel."""
    wheels[:, 2] = (wheels[:, 0] + wheels[:, 2] * WHEEL_SEPARATION_M / 2) / WHEEL_SEPARATION_M
    wheels[:, 0] = wheels[:, 2] * WHEEL_SEPARATION_M / 2
    grip = rng.uniform(0, 1)
    truth[:] = grip * truth + (1 - grip) * wheels


def spin(rng: Rng, truth: Array, wheels: Array, times: Array) -> None:
    """Hold the robot while its wheels spin."""
    truth[:] = 0.0


def random_rate(rng: Rng, low: float, high: float) -> float:
    """Return a turn rate with a random sign and an absolute value from `low` to `high` rad/s."""
    return float(rng.choice([-1, 1]) * rng.uniform(low, high))


def nees_after_drive(slip: object, seed: int) -> float:
    """Return the NEES after 5 s in a bend. The disturbance `slip` starts after 1 s and lasts 0.5 s to 3 s.

    Before a slide, a ramp, or a turntable, the robot stops.
    """
    rng = np.random.default_rng(seed)
    n, start = 5 * RATE, RATE
    truth = np.tile([rng.uniform(0.2, 0.8), 0.0, random_rate(rng, 0.2, 1.0)], (n, 1))
    if slip in (slide, ramp, turntable):
        truth[start // 2 :] = 0.0
    wheels = truth.copy()
    end = start + round(rng.uniform(0.5, 3.0) * RATE)
    slip(rng, truth[start:end], wheels[start:end], np.arange(end - start) / RATE)  # type: ignore[operator]
    distance, turn = np.abs(wheels[:, 0]) / RATE, np.abs(wheels[:, 2]) / RATE
    noise = rng.normal(size=(2, n)) * RATE
    wheels[:, 0] += SPEC.translation_noise * np.sqrt(distance) * noise[0]
    wheels[:, 2] += SPEC.rotation_noise * np.sqrt(distance + turn) * noise[1]
    gyro = truth[:, 2] + rng.normal(0, SPEC.gyro_noise) + rng.normal(0, SPEC.gyro_noise, n)
    return nees(*replay_drive(SPEC, truth, wheels, gyro))


@pytest.mark.sample(2)
@pytest.mark.parametrize("slip", [slide, ramp, turntable, lock, lock_on_ice, lock_left, spin], ids=lambda f: f.__name__)
def test_covariance_is_not_overconfident_for_any_slip(slip: object, is_quick: bool) -> None:
    """The sum of NEES values has a chi-square distribution for a consistent filter. It may be lower here, as no sensor
    measures a slide.
    """
    seeds = range(4000, 4008 if is_quick else 4020)
    nees_sum = sum(nees_after_drive(slip, seed) for seed in seeds)
    assert len(seeds) < nees_sum < stats.chi2.ppf(0.999, 3 * len(seeds))


def test_slip_check_works_with_odometry_at_1_hz() -> None:
    detector = SlipDetector()
    assert [detector.update(rate, 1e-4, 1e-6, 1.0) > 0.0 for rate in (0.0, 0.2, 0.0)] == [False, True, False]
