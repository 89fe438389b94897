"""Tests of criteria with filter masks against shapely, on random masks and drives."""

import math

import numpy as np
import pytest
import shapely
import shapely.affinity
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from simscen.core.environment.costmap_filters import mask_blocks
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose2
from simscen.core.records.verdict import Status
from simscen.criteria.registry import AnyCriterion
from simscen.criteria.speed import _sliding_maximum
from simscen.judge.evaluation import judge
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace

SEEDS = st.integers(0, 2**32 - 1)
LONG_FOOTPRINT = [[-0.4, -0.1], [0.3, -0.2], [0.5, 0.0], [0.3, 0.2], [-0.4, 0.1]]
NOTCHED_FOOTPRINT = [[-0.4, -0.3], [0.4, -0.3], [0.4, 0.3], [0.0, 0.0], [-0.4, 0.3]]


def mask_of(rng, values, share):
    cells = np.where(rng.random((9, 7)) < share, rng.choice(values, (9, 7)), 0).astype(np.int8)
    origin = Pose2(*rng.uniform(-1, 1, 2), rng.uniform(-math.pi, math.pi))
    return OccupancyGrid(cells, float(rng.uniform(0.1, 0.5)), origin)


def findings_and_trace(criterion, grid, truth, footprint=(), seconds=10.0):
    mask = mask_blocks(grid)
    case = synthetic_case({
        "footprint": footprint,
        "inscribed_radius": 0.2,
        "masks": {"a.yaml": {"resolution": mask.resolution, "origin": list(mask.origin), "blocks": mask.blocks}},
    })  # fmt: skip
    trace = synthetic_trace({"seconds": seconds, "truth": truth})
    (verdict,) = judge([AnyCriterion.model_validate(criterion)], trace, case)
    return verdict.findings, trace


def area_of(grid):
    """Return the squares of all occupied cells."""
    boxes = []
    for row, column in np.argwhere(grid.cells == 100):
        corners = np.array([[column, row], [column + 1, row], [column + 1, row + 1], [column, row + 1]], dtype=float)
        boxes.append(shapely.Polygon(grid.origin.apply(corners * grid.resolution)))
    return shapely.MultiPolygon(boxes)


def placed(outline, x, y, yaw):
    rotated = shapely.affinity.rotate(shapely.Polygon(outline), yaw, origin=(0, 0), use_radians=True)
    return shapely.affinity.translate(rotated, x, y)


@given(SEEDS, st.sampled_from([LONG_FOOTPRINT, NOTCHED_FOOTPRINT]))
@settings(deadline=None)
def test_distance_to_a_keepout_mask_equals_that_of_shapely(seed, outline):
    rng = np.random.default_rng(seed)
    grid = mask_of(rng, [40, 100, 100], share=0.3)
    x, y, yaw = *rng.uniform(-3, 3, 2), rng.uniform(-3, 3)
    (finding,), _ = findings_and_trace({"keepout": {"mask": "a.yaml"}}, grid, [[0, x, y, yaw]], outline, seconds=0.1)
    area, footprint = area_of(grid), placed(outline, x, y, yaw)
    if not len(area.geoms):
        assert finding.status is Status.INCONCLUSIVE
    elif (distance := footprint.distance(area)) > 1e-9:
        assert finding.status is Status.PASS
        assert finding.value == pytest.approx(distance, abs=1e-9)
    elif footprint.intersection(area).area > 1e-9:
        assert finding.status is Status.FAIL
        max_depth = (
            footprint.bounds[2] - footprint.bounds[0] + footprint.bounds[3] - footprint.bounds[1] + 7 * grid.resolution
        )
        assert -max_depth < finding.value < 0


@given(SEEDS)
@settings(deadline=None, max_examples=30)
def test_distance_of_a_drive_to_a_keepout_mask_is_that_of_its_nearest_pose(seed):
    rng = np.random.default_rng(seed)
    grid = mask_of(rng, [100], share=0.1)
    poses = [[t, *rng.uniform(-3, 3, 2), rng.uniform(-3, 3)] for t in (0, 2, 4)]
    (finding,), trace = findings_and_trace({"keepout": {"mask": "a.yaml"}}, grid, poses, LONG_FOOTPRINT, seconds=4)
    area = area_of(grid)
    assume(len(area.geoms) > 0)
    distances = [placed(LONG_FOOTPRINT, *pose).distance(area) for pose in trace.truth.values]
    step = 0.06 * (1 + np.abs(np.diff(np.unwrap(trace.truth.values[:, 2]))).max())
    if min(distances) > 1e-9:
        assert finding.value <= min(distances) + 1e-9
        assert finding.value >= min(distances) - step - np.hypot(*np.diff(trace.truth.values[:, :2], axis=0).T).max()
    else:
        assert finding.value <= 1e-9


def test_a_round_robot_without_a_footprint_is_judged_by_its_radius():
    grid = OccupancyGrid(np.full((10, 10), 100, dtype=np.int8), 0.1, Pose2(2.0, -0.5))
    (finding,), _ = findings_and_trace({"keepout": {"mask": "a.yaml"}}, grid, [[0, 0, 0], [10, 1, 0]])
    assert finding.value == pytest.approx(0.8)


@given(SEEDS, st.sampled_from([0.0, 0.2, 0.5]))
@settings(deadline=None, max_examples=50)
def test_speed_limit_is_that_of_the_cell_at_the_true_pose(seed, grace):
    rng = np.random.default_rng(seed)
    grid = mask_of(rng, [20, 60], share=0.6)
    poses = [[t, *rng.uniform(-1.5, 1.5, 2)] for t in range(0, 5)]
    speed_mask = {"file": "a.yaml", "base": 100.0, "multiplier": -1.0}
    criterion = {"speed": {"mask": speed_mask, "full_speed": 1.0, "tolerance": 0.0, "grace": grace}}
    (finding,), trace = findings_and_trace(criterion, grid, poses, seconds=4)
    ticks, speed = trace.velocity.ticks, np.hypot(*trace.velocity.values[:, :2].T)
    values = grid.values_at(trace.truth.at(ticks)[:, :2])
    limits = [1.0 - value / 100 if value > 0 else math.inf for value in values]
    margins = [
        max(limits[j] for j in range(len(ticks)) if abs(int(ticks[j] - tick)) <= round(grace * trace.tick_rate))
        - speed[k]
        for k, tick in enumerate(ticks)
    ]
    limited = [margin for margin in margins if math.isfinite(margin)]
    if limited:
        assert finding.margin == pytest.approx(min(limited))
    else:
        assert finding.status is Status.INCONCLUSIVE


def test_missing_mask_in_the_log_is_not_a_pass():
    trace = synthetic_trace({"seconds": 1, "truth": [[0, 0, 0]]})
    for criterion in (
        {"keepout": {"mask": "b.yaml"}},
        {"speed": {"mask": {"file": "b.yaml", "type": "absolute"}}},
    ):
        (verdict,) = judge([AnyCriterion.model_validate(criterion)], trace, synthetic_case({}))
        assert [(f.status, f.measured) for f in verdict.findings] == [
            (Status.INCONCLUSIVE, "the log has no mask `b.yaml`")
        ]


@pytest.mark.parametrize(
    ("criterion", "message"),
    [
        ({"keepout": {}}, "expected either region or mask"),
        ({"keepout": {"region": "wet", "mask": "a.yaml"}}, "expected either region or mask"),
        ({"speed": {"mask": {"file": "a.yaml"}}}, "expected full_speed"),
        (
            {"speed": {"mask": {"file": "a.yaml", "type": "absolute"}, "full_speed": 1.0}},
            "full_speed only applies to a mask",
        ),
        ({"speed": {"max": 1.0, "full_speed": 1.0}}, "full_speed only applies to a mask"),
        ({"speed": {"max": 1.0, "while_on": True}}, "while_on only applies to the zone of a region"),
        (
            {"speed": {"mask": {"file": "a.yaml", "type": "absolute"}, "in": "wet", "while_on": True}},
            "while_on only applies to the zone of a region",
        ),
    ],
)
def test_contradictory_values_are_refused(criterion, message):
    with pytest.raises(ValueError, match=message):
        AnyCriterion.model_validate(criterion)


@given(SEEDS)
def test_windowed_maximum_equals_brute_force(seed):
    """The expected maxima compare all pairs of samples; some pairs have exactly the distance of the window."""
    rng = np.random.default_rng(seed)
    ticks = np.unique(rng.integers(0, 60, 20))
    values, reach_ticks = rng.normal(size=len(ticks)) - 5.0, int(rng.integers(0, 15))
    expected = [values[np.abs(ticks - tick) <= reach_ticks].max() for tick in ticks]
    assert _sliding_maximum(values, ticks, reach_ticks).tolist() == expected
