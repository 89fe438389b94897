import pytest

from simscen.core.verdict import Finding, Status, Verdict
from simscen.judge.wording import sentence, tightest


def verdict(finding, kind="stopped_within", name="stopped_within"):
    return Verdict(kind, name, "fail", (finding,))


STOP = Finding(
    Status.FAIL, "stopped_within", "0.84 s", "≤ 0.50 s after lidar.off", -0.34, "s", 0.84, 10 * 240 + 202, (2.1, 3.41)
)


def test_a_failure_reads_as_in_the_format():
    expected = "stopped_within: 0.84 s > 0.50 s after lidar.off, at t = 10.84 s, (2.10, 3.41)"
    assert sentence(verdict(STOP), STOP, 240) == expected


@pytest.mark.parametrize(
    ("finding", "text"),
    [
        (Finding(Status.PASS, "clearance", "0.20 m", "≥ 0.10 m"), "clearance: 0.20 m ≥ 0.10 m"),
        (Finding(Status.FAIL, "clearance", "0.05 m", "≥ 0.10 m"), "clearance: 0.05 m < 0.10 m"),
        (Finding(Status.FAIL, "result", "FAILED", "SUCCEEDED"), "clearance: result: FAILED; expected SUCCEEDED"),
        (Finding(Status.PASS, "result", "FAILED", "FAILED"), "clearance: result: FAILED"),
        (Finding(Status.INCONCLUSIVE, "clearance", "nothing", "≥ 0.10 m"), "clearance: inconclusive: nothing"),
        (Finding(Status.FAIL, "clearance ratio", "2", "≤ 1"), "clearance: ratio: 2 > 1"),
    ],
)
def test_every_kind_of_answer_has_its_sentence(finding, text):
    assert sentence(verdict(finding, "clearance", "clearance"), finding, 240) == text


def test_the_tightest_bound_is_the_one_with_the_least_share_of_its_limit_left():
    far = Finding(Status.PASS, "time_to_goal", "", "≤ 40.00 s", 4.0, "s", 36.0)
    near = Finding(Status.PASS, "path_length", "", "≤ 10.00 m", 0.14, "m", 9.86)
    count = Finding(Status.PASS, "collisions", "", "≤ 0", 0.0, "", 0.0)
    verdicts = [
        verdict(far, "time_to_goal", "t"),
        verdict(near, "path_length", "path_length"),
        verdict(count, "c", "c"),
    ]
    assert tightest(verdicts) == "path_length +0.14 m"
    assert tightest([]) == ""
