"""Whether what moves may come near at all, beside looking at each moment."""

import numpy as np
import pytest

from simscen.core.geometry import Pose2
from simscen.stack.prediction.moving import Moving, Thing


def test_what_is_told_to_come_no_nearer_comes_no_nearer_whichever_way_one_goes() -> None:
    chance, times = np.random.default_rng(5), np.linspace(0.0, 3.0, 3001)
    for _ in range(200):
        x, y, vx, vy = chance.normal(0.0, 2.0, 4).tolist()
        here, speed = complex(*chance.normal(0.0, 2.0, 2)), float(chance.uniform(0.0, 3.0))
        thing = Thing(complex(x, y), complex(vx, vy), 0.3, 0.0, 0.0, 0.0)
        off = np.abs(thing.place + thing.velocity * times - here) - speed * times - 0.3
        assert thing.missed_by(here, speed, 3.0) == pytest.approx(off.min(), abs=2e-3)
    assert Thing(2 + 0j, 0j, 0.3, 0.0, 0.0, 0.0).missed_by(0j, 0.0, 3.0) == pytest.approx(1.7)
    assert Thing(0j, -1 + 0j, 0.3, 0.0, 0.0, 0.0).missed_by(0j, 0.0, 3.0) == pytest.approx(-0.3)


def test_arrays_are_what_it_was_made_of_and_turn_with_the_frame() -> None:
    spread = np.kron([[[0.1, 0.02], [0.02, 0.4]]], np.eye(2))
    one = Moving(np.array([[3.0, 1.0]]), np.array([[1.0, 0.0]]), np.array([0.3]), spread, 1.0)
    assert one.covariances == pytest.approx(spread)
    seen = one.seen_from(Pose2(1.0, 1.0, np.pi / 2)).after(2.0)
    assert seen.centres == pytest.approx(np.array([[0.0, -4.0]]))
    assert seen.velocities == pytest.approx(np.array([[0.0, -1.0]]))
    step = np.eye(4) + 2.0 * np.eye(4, k=2)
    assert seen.covariances == pytest.approx(step @ spread @ step.T)
    assert Moving.of((), 1.0).centres.shape == (0, 2) and Moving.of((), 1.0).covariances.shape == (0, 4, 4)
