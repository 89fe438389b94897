"""Test of plans in synthetic traces."""

from simscen.testing.synthetic_trace import synthetic_trace


def test_plan_can_have_one_point():
    trace = synthetic_trace({"seconds": 1, "truth": [[0, 0, 0]], "plans": [[0, [[1, 2]]]]})
    assert trace.plans[0].points.tolist() == [[1, 2, 0]]
