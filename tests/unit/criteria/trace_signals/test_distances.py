"""Tests of distances to pedestrians against shapely, for robots of any shape and heading."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
import shapely.affinity

from simscen.core.messages.navigation import Path
from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Samples
from simscen.core.records.verdict import Status
from simscen.criteria.clearance import PersonalSpace
from simscen.criteria.findings import InvalidTrace
from simscen.criteria.trace_signals.catalog import read_signal
from simscen.criteria.trace_signals.distances import pedestrian_gap, pedestrian_radii
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace

SHAPES = {
    "triangle": [[0.5, 0.0], [-0.3, 0.3], [-0.3, -0.3]],
    "box off center": [[0.9, 0.2], [-0.1, 0.2], [-0.1, -0.3], [0.9, -0.3]],
}


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("seed", range(6))
def test_gap_equals_that_of_shapely(shape: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    x, y, yaw = (float(value) for value in rng.uniform(-3.0, 3.0, 3))
    people = {name: [[0, *rng.uniform(-3.0, 3.0, 2).tolist()]] for name in ("anna", "bert")}
    radii = {"anna": 0.25, "bert": 0.4}
    trace = synthetic_trace({
        "seconds": 2,
        "truth": [[0, x, y, yaw], [2, x, y, yaw]],
        "objects": people,
        "events": [[0, "object.spawned", name, {"person": True, "size": [radius]}] for name, radius in radii.items()],
    })  # fmt: skip
    robot = shapely.affinity.translate(
        shapely.affinity.rotate(shapely.Polygon(SHAPES[shape]), yaw, origin=(0, 0), use_radians=True), x, y
    )
    expected = min(
        max(0.0, robot.distance(shapely.Point(place[0][1:])) - radii[name]) for name, place in people.items()
    )
    assert pedestrian_gap(trace, synthetic_case({"footprint": SHAPES[shape]})) == pytest.approx(expected, abs=1e-9)


def test_objects_are_people_only_with_a_radius() -> None:
    data = {
        "anna": {"person": True, "size": [0.25, 1.7]},
        "bert": {"person": True, "size": [0.3]},
        "crate": {"size": [0.5]},
        "ghost": {"person": True, "size": []},
        "unknown": {"person": True},
        "named": {"person": True, "size": ["large", 1.7]},
    }
    trace = synthetic_trace({"seconds": 1, "truth": [[0, 0, 0]]})
    events = tuple(Event(0, EventKind.OBJECT_SPAWNED, name, found) for name, found in data.items())
    assert pedestrian_radii(replace(trace, events=events)) == {"anna": 0.25, "bert": 0.3}


@pytest.mark.parametrize(("speed", "drives"), [(0.1, False), (0.1001, True)])
def test_robot_drives_if_it_is_faster_than_a_tenth_of_a_meter_per_second(speed: float, drives: bool) -> None:
    trace = synthetic_trace({
        "seconds": 2,
        "truth": [[0, 0, 0]],
        "objects": {"anna": [[0, 1, 0]]},
        "events": [[0, "object.spawned", "anna", {"person": True, "size": [0.25]}]],
    })  # fmt: skip
    velocity = Samples(trace.truth.ticks, np.tile((speed, 0.0, 0.0), (len(trace.truth), 1)))
    criterion = PersonalSpace(min=2.0, while_driving=True)
    (finding,) = criterion.judge(replace(trace, velocity=velocity), synthetic_case({"inscribed_radius": 0.2}))
    assert finding.status is (Status.FAIL if drives else Status.INCONCLUSIVE)


def test_deviation_does_not_depend_on_the_headings_of_a_plan():
    """Plans in logs of real robots can lack headings."""
    plan = Path(np.array([[0.0, 1.0, np.nan], [5.0, 1.0, np.nan]]), 0)
    trace = replace(synthetic_trace({"seconds": 2, "truth": [[0, 2, 0]]}), plans=(plan,))
    assert read_signal("plan_deviation", trace, synthetic_case({}), {}).tolist() == [1.0] * len(trace.truth)


def test_a_plan_with_a_single_invalid_coordinate_is_an_error():
    plan = Path(np.array([[0.0, 1.0, 0.0], [5.0, np.nan, 0.0]]), 0)
    trace = replace(synthetic_trace({"seconds": 2, "truth": [[0, 2, 0]]}), plans=(plan,))
    with pytest.raises(InvalidTrace, match=r"the plan is not finite at t = 0.00 s"):
        read_signal("plan_deviation", trace, synthetic_case({}), {})
