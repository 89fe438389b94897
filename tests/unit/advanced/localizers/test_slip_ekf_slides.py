"""Tests of the consistency of the slip EKF when robots slide, skid, or are pushed."""

import math

import numpy as np
import pytest
from scipy import stats
from test_slip_ekf_slip import RATE, replayed

from simscen.advanced.localizers.slip_model import SlipDetector
from simscen.advanced.spec import SlipEkf
from simscen.core.geometry import Array
from simscen.testing.synthetic_room import nees

SPEC = SlipEkf(type="slip_ekf")
TRACK = 0.4
Chance = np.random.Generator


def slide(rng: Chance, truth: Array, wheels: Array, along: Array) -> None:
    """Pushed while it stands, in any direction, and turned by it; `along` counts the seconds of the slide from 0."""
    direction, speed = rng.uniform(0, 2 * math.pi), rng.uniform(0.05, 0.6)
    truth[:] = speed * math.cos(direction), speed * math.sin(direction), _turn(rng, 0.1, 1.0)
    wheels[:] = 0.0


def ramp(rng: Chance, truth: Array, wheels: Array, along: Array) -> None:
    """Down a slope, faster and faster, brakes on, turning slowly: the slope stays where it is."""
    truth[:, 2] = _turn(rng, 0.1, 1.0) * np.minimum(1.0, along / 0.3)
    down = rng.uniform(0, 2 * math.pi) - np.cumsum(truth[:, 2]) / RATE
    speed = rng.uniform(0.1, 0.4) * along
    truth[:, :2] = np.column_stack((speed * np.cos(down), speed * np.sin(down)))
    wheels[:] = 0.0


def turntable(rng: Chance, truth: Array, wheels: Array, along: Array) -> None:
    """What it stands on turns."""
    slide(rng, truth, wheels, along)
    truth[:, :2] *= abs(truth[0, 2]) / max(0.6, math.hypot(*truth[0, :2]))


def lock(rng: Chance, truth: Array, wheels: Array, along: Array) -> None:
    """Wheels that lock in a turn; the robot slides to a stop."""
    truth *= (1.0 - along / along[-1])[:, None]
    wheels[:] = 0.0


def lock_on_ice(rng: Chance, truth: Array, wheels: Array, along: Array) -> None:
    """The same, and it slides on as before."""
    wheels[:] = 0.0


def one_wheel(rng: Chance, truth: Array, wheels: Array, along: Array) -> None:
    """The left one locks: the robot does something between what it did and turning about that wheel."""
    wheels[:, 2] = (wheels[:, 0] + wheels[:, 2] * TRACK / 2) / TRACK
    wheels[:, 0] = wheels[:, 2] * TRACK / 2
    held = rng.uniform(0, 1)
    truth[:] = held * truth + (1 - held) * wheels


def spin(rng: Chance, truth: Array, wheels: Array, along: Array) -> None:
    """Something holds the robot, and its wheels go on turning."""
    truth[:] = 0.0


def _turn(rng: Chance, least: float, most: float) -> float:
    return float(rng.choice([-1, 1]) * rng.uniform(least, most))


def drive(what: object, seed: int) -> float:
    """NEES after 5 s of standing or driving in a bend, with half a second to three of something else in the middle."""
    rng = np.random.default_rng(seed)
    n, first = 5 * RATE, RATE
    truth = np.tile([rng.uniform(0.2, 0.8), 0.0, _turn(rng, 0.2, 1.0)], (n, 1))
    if what in (slide, ramp, turntable):
        truth[first // 2 :] = 0.0
    wheels = truth.copy()
    last = first + round(rng.uniform(0.5, 3.0) * RATE)
    what(rng, truth[first:last], wheels[first:last], np.arange(last - first) / RATE)  # type: ignore[operator]
    way, turn = np.abs(wheels[:, 0]) / RATE, np.abs(wheels[:, 2]) / RATE
    noise = rng.normal(size=(2, n)) * RATE
    wheels[:, 0] += SPEC.translation_noise * np.sqrt(way) * noise[0]
    wheels[:, 2] += SPEC.rotation_noise * np.sqrt(way + turn) * noise[1]
    gyro = truth[:, 2] + rng.normal(0, SPEC.gyro_noise) + rng.normal(0, SPEC.gyro_noise, n)
    return nees(*replayed(SPEC, truth, wheels, gyro))


@pytest.mark.sample(2)
@pytest.mark.parametrize("what", [slide, ramp, turntable, lock, lock_on_ice, one_wheel, spin], ids=lambda f: f.__name__)
def test_covariance_is_not_overconfident_for_any_slip(what: object, is_quick: bool) -> None:
    """NEES of 3 degrees of freedom add up to chi-square; it may be less sure, as no sensor tells how a robot slides."""
    seeds = range(4000, 4008 if is_quick else 4020)
    total = sum(drive(what, seed) for seed in seeds)
    assert len(seeds) < total < stats.chi2.ppf(0.999, 3 * len(seeds))


def test_slip_check_works_with_odometry_at_1_hz() -> None:
    watch = SlipDetector()
    assert [watch.update(rate, 1e-4, 1e-6, 1.0) > 0.0 for rate in (0.0, 0.2, 0.0)] == [False, True, False]
