"""A robot drifts with the way that it goes, and no faster."""

import numpy as np
import pytest

from simscen.core.geometry import Pose2
from simscen.stack.localizers.sure import AROUND, DRIFT, Sure, drifted

THEN = Pose2(1.0, 2.0, np.pi / 2)
SURE = Sure.at(np.array([5.0, 5.0, 0.0]), THEN, np.ones(3))
NOW = THEN.compose(Pose2(2.0, 1.0, 0.3))


def test_it_is_expected_where_its_scans_say_that_it_went() -> None:
    assert SURE.expected(NOW) == pytest.approx([7.0, 6.0, 0.3])
    assert SURE.unlikely(np.array([[7.0, 6.0, 0.3]]), NOW, np.ones(3)) == pytest.approx(0.0)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(("metres", "torn"), [(0.0, Pose2(0, 0, 0)), (20.0, Pose2(0, 0, 0)), (0.5, Pose2(0.3, 0, 0.2))])
def test_how_unlikely_another_place_is_goes_by_how_far_it_may_have_drifted(
    axis: int, metres: float, torn: Pose2
) -> None:
    off = np.eye(3)[axis] * 2 * (AROUND[axis] + DRIFT[axis] * metres + (torn.x, torn.x, torn.yaw)[axis])
    drift = SURE.drift + drifted(metres, torn)
    assert SURE.unlikely((SURE.expected(NOW) + off)[None], NOW, drift) == pytest.approx(2.0)
