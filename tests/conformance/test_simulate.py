"""Conformance tests of `simscen.simulate()`: runs are equal to those of the command line."""

from pathlib import Path

import pytest

import simscen
from simscen.core.errors import InvalidInput
from simscen.record.log_reader import read_log

PLANNED = """\
stack: {localizer: {type: scan_matching_amcl, max_particles: 500}, planner: {type: rrt_connect}}
faults: [{sensor: lidar, noise: {std: 5 cm}}]
"""


@pytest.fixture
def scenario(folder: Path) -> Path:
    """Write a scenario around the crate with a randomized planner, localizer, and fault; return its path."""
    text = (folder / "a.scenario.yaml").read_text().replace("{x: 1.5, y: 1}", "{x: 4.6, y: 2.6}")
    (folder / "b.scenario.yaml").write_text(text + PLANNED)
    return folder / "b.scenario.yaml"


def test_run_from_python_equals_run_from_command_line(scenario, folder, request):
    first = simscen.simulate(scenario, log="first.mcap")
    other = simscen.simulate(scenario, seed=8)
    again = simscen.simulate(str(scenario), log=folder / "again.mcap")
    assert first.passed, first.result
    assert first.log.read_bytes() == again.log.read_bytes()
    assert other.result.key.seed == 8
    assert other.trace.truth.values.tolist() != first.trace.truth.values.tolist()
    ended = request.getfixturevalue("simscen")("run", scenario, "--out", "out")
    assert ended.code == 0, ended.out + ended.err
    (shown,) = Path("out").rglob("run.mcap")
    assert shown.read_bytes() == first.log.read_bytes()


def test_log_contains_the_judged_trace(scenario):
    run = simscen.simulate(scenario, log="run.mcap")
    replayed = read_log(run.log)
    assert replayed.trace.events == run.trace.events
    assert (replayed.trace.truth.values == run.trace.truth.values).all()


def test_verdicts_are_found_by_name(scenario):
    run = simscen.simulate(scenario)
    assert run.verdict("goals_reached").status.value == "pass"
    with pytest.raises(KeyError, match="there are: goals_reached"):
        run.verdict("speed")


def test_unusable_file_raises_position_and_reason(folder):
    (folder / "bad.scenario.yaml").write_text("simscen: 1\n")
    with pytest.raises(InvalidInput, match="missing key"):
        simscen.simulate("bad.scenario.yaml")
