"""End-to-end tests of failure explanations, in runs and in `judge`."""

from pathlib import Path

import pytest

from simscen.judge.result_json import to_json
from simscen.judge.run_result import judge_run
from simscen.loading.scenario import load_scenario
from simscen.loading.scenario_text import criteria_of_text
from simscen.record.log_reader import read_log
from simscen.run.preparation import prepare
from simscen.run.simulate import simulate

HEAD = """\
simscen: 1
world:
  simscen: 1
  walls:
    - {name: outer wall, points: [[0, 0], [8, 0], [8, 4], [0, 4], [0, 0]]}
    - {name: south of the door, points: [[4, 0], [4, 1.5]]}
    - {name: north of the door, points: [[4, 2.5], [4, 4]]}
robot: {pose: {x: 1, y: 1}}
stack: {recovery: {number_of_retries: 1}}
goals: [{name: far room, pose: {x: 7, y: 3}, timeout: 20 s}]
time_limit: 25 s
"""

CASES = {
    "a crate in the only door": (
        """\
events: [{name: crate falls, when: {time: 1 s}, do: {spawn: {name: crate, box: [0.3, 0.8, 1], pose: {x: 4, y: 2}}}}]
pass: [{goals_reached: {}}]
""",
        "goals_reached",
        "why: crate (spawned by event `crate falls` at t = 1.00 s) closes the passage of 1.00 m between "
        "`south of the door` and `north of the door` at (3.95, 2.00) on the shortest path: "
        "0.10 m are left, the robot is 0.44 m wide",
    ),
    "a kidnapped robot": (
        """\
events: [{name: kidnapped, when: {travelled: 1 m}, do: {kidnap: {pose: {x: 5, y: 1}}}}]
pass: [{localization_error: {max: 0.5 m}}]
""",
        "localization_error",
        "why: event `kidnapped` had moved the robot elsewhere ",
    ),
    "a box dropped before a robot at speed": (
        """\
events: [{name: box falls, when: {travelled: 1 m}, do: {spawn: {name: box, box: [0.3, 0.3, 0.4], ahead: [0.45, 0]}}}]
pass: [{collisions: {max: 0}}]
""",
        "collisions",
        "why: box: event `box falls` had spawned it 0.30 m from the robot's center ",
    ),
    "a lidar that is silent": (
        """\
faults: [{sensor: lidar, off: {}, when: {time: 4 s}}]
pass: [{goals_reached: {}}]
""",
        "goals_reached",
        "why: the collision monitor has stopped the robot, as reported at t = 5.25 s: lidar `lidar` has been silent "
        "for 1.35",
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_cause_is_reported_first_in_run_and_judge(name, tmp_path):
    text, criterion, expected = CASES[name]
    file, log = tmp_path / "own.scenario.yaml", tmp_path / "run.mcap"
    file.write_text(HEAD + text)
    run = simulate(prepare(load_scenario(file, tmp_path)), log=log)
    finding = run.verdict(criterion).tightest
    assert finding.detail[0].startswith(expected), finding.detail
    assert all(outcome.happened for outcome in run.result.disturbances)
    assert judge_log(log, run.result) == to_json(run.result)


def judge_log(log: Path, result) -> str:
    """Judge the log of a run; return the result as JSON."""
    read = read_log(log)
    criteria = criteria_of_text(read.header.scenario, "log", {}).pass_
    lines = result.lines[-len(criteria) :]
    return to_json(judge_run(result.key, result.path, criteria, read.trace, read.header.case, lines))
