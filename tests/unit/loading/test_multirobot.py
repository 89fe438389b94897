"""Tests of `robots:` and its error messages."""

import pytest

from simscen.core.errors import InvalidInput
from simscen.loading.checks.scene_runner import check_in_world
from simscen.loading.scenario import load_scenario
from simscen.loading.scenario_text import criteria_of_text
from tests.scenario_files import try_scenario

HEAD = """\
simscen: 1
world:
  simscen: 1
  walls: [{name: wall, points: [[0, 0], [9, 0], [9, 6], [0, 6], [0, 0]]}]
  objects: [{name: crate, box: [0.3, 0.3, 0.3], pose: {x: 8, y: 5}}]
  places: {here: {x: 1, y: 1}, there: {x: 5, y: 4}}
"""
A, B = "a: {pose: here, goals: [there]}", "b: {pose: there, goals: [here]}"
REMOVE = "do: {remove: {name: crate}}"
PASS = "pass: [{collisions: {max: 0}}]\n"


@pytest.fixture
def load(tmp_path):
    def load(text, base=""):
        file = tmp_path / "several.scenario.yaml"
        if base:
            (tmp_path / "base.scenario.yaml").write_text(HEAD + base)
            file.write_text(f"extends: base.scenario.yaml\n{text}")
        else:
            file.write_text(HEAD + text)
        return try_scenario(file, tmp_path)

    return load


def output(problems):
    assert isinstance(problems, list), "the file is valid"
    return [(problem.line, problem.code, problem.message) for problem in problems]


WRONG = {
    "none": ("robots: {}\n" + PASS, (7, "SC017", "expected 2 or more values, got 0")),
    "one": (f"robots: {{{A}}}\n" + PASS, (7, "SC017", "expected 2 or more values, got 1")),
    "a path": (f"robots: {{{A}, ../x: {{pose: there}}}}\n" + PASS, (7, "SC017", "`../x` is not a valid name")),
    "no namespace": (f"robots: {{{A}, a__b: {{pose: there}}}}\n" + PASS, (7, "SC017", "`a__b` is not a valid name")),
    "a blank": (
        f"robots: {{{A}, my robot: {{pose: there}}}}\n" + PASS,
        (7, "SC017", "`my robot` is not a valid name"),
    ),
    "the same twice": (f"robots: {{{A}, {A}}}\n" + PASS, (7, "SC007", "duplicate key `a` (first at 7:10)")),
    "both": (
        f"robot: {{pose: here}}\nrobots: {{{A}, {B}}}\n" + PASS,
        (7, "SC016", "`robot` and `robots` exclude each other"),
    ),
    "goals of all": (
        f"robots: {{{A}, {B}}}\ngoals: [there]\n" + PASS,
        (8, "SC016", "`goals` belongs to one robot, but the scenario has several"),
    ),
    "nothing must hold": (
        f"robots:\n  a: {{pose: here, {PASS.strip()}}}\n  {B}\n",
        (9, "SC010", "missing key `pass` in `robots.b`"),
    ),
    "a thing's name": (
        f"robots: {{{A}, crate: {{pose: there}}}}\n" + PASS,
        (7, "SC033", "an object of the world is also called `crate`"),
    ),
    "whose trigger": (
        f"robots: {{{A}, {B}}}\nevents: [{{when: {{travelled: 1}}, {REMOVE}}}]\n" + PASS,
        (8, "SC043", "`travelled` must name one of the robots"),
    ),
    "whose part of a trigger": (
        f"robots: {{{A}, {B}}}\nevents: [{{when: {{all: [{{time: 1}}, {{travelled: 1}}]}}, {REMOVE}}}]\n" + PASS,
        (8, "SC043", "`travelled` must name one of the robots"),
    ),
    "whose action": (
        f"robots: {{{A}, {B}}}\nevents: [{{when: {{time: 1}}, do: {{push: {{impulse: [1, 0]}}}}}}]\n" + PASS,
        (8, "SC043", "`push` must name one of the robots"),
    ),
    "whose fault": (
        "robots:\n  a: {pose: here, faults: [{sensor: lidar, off: {}}]}\n"
        f"  {B}\nevents: [{{when: {{event: {{name: lidar.off}}}}, {REMOVE}}}]\n" + PASS,
        (10, "SC043", "`event` must name one of the robots"),
    ),
    "a stranger": (
        f"robots: {{{A}, {B}}}\nevents: [{{when: {{travelled: 1, robot: c}}, {REMOVE}}}]\n" + PASS,
        (8, "SC030", "no robot is called `c`"),
    ),
    "another's goal": (
        f"robots: {{{A}, {B}}}\n"
        "events: [{when: {goal: {status: reached, name: there}, robot: b}, do: {remove: {name: crate}}}]\n" + PASS,
        (8, "SC030", "no goal is called `there`"),
    ),
    "a robot is no thing to remove": (
        f"robots: {{{A}, {B}}}\nevents: [{{when: {{time: 1}}, do: {{remove: {{name: b}}}}}}]\n" + PASS,
        (8, "SC035", "`b` is one of the robots, which cannot be moved or followed"),
    ),
    "a sensor of one": (
        "robots:\n  a: {pose: here, faults: [{sensor: sonar, off: {}}]}\n  " + B + "\n" + PASS,
        (8, "SC031", "robot `turtlebot` has no sensor called `sonar`"),
    ),
    "an expectation of nobody": (
        f"robots: {{{A}, {B}}}\nexpected: {{fail: NAV-1, criteria: [a/collisions, collisions]}}\n" + PASS,
        (8, "SC030", "no criterion, event or fault is called `collisions`"),
    ),
    "an expectation of a stranger": (
        f"robots: {{{A}, {B}}}\nexpected: {{fail: NAV-1, criteria: [a/collisions, c/collisions]}}\n" + PASS,
        (8, "SC030", "no criterion, event or fault is called `c/collisions`"),
    ),
    "a name in a scenario of one robot": (
        "robot: {pose: here}\nevents: [{when: {travelled: 1, robot: a}, do: {remove: {name: crate}}}]\n" + PASS,
        (8, "SC030", "no robot is called `a`: the only robot has no name"),
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_mistakes_are_reported_at_their_positions(load, case):
    text, expected = WRONG[case]
    assert expected in output(load(text))


def test_robot_used_as_object_is_reported_once(load):
    text = f"robots: {{{A}, {B}}}\nevents: [{{when: {{time: 1}}, do: {{remove: {{name: b}}}}}}]\n"
    assert output(load(text + PASS)) == [(8, "SC035", "`b` is one of the robots, which cannot be moved or followed")]


def test_each_robot_may_be_sent_a_goal_of_the_same_name(load):
    sent = [f"{{new_goal: {{name: charger, pose: {{x: 2, y: 4}}}}, robot: {name}}}" for name in "ab"]
    loaded = load(f"robots: {{{A}, {B}}}\nevents: [{{when: {{time: 1}}, do: [{', '.join(sent)}]}}]\n" + PASS)
    assert not isinstance(loaded, list), output(loaded)


@pytest.mark.parametrize("pose", ["{x: 1.2, y: 1.1}", "here", "{x: 1, y: 1, yaw: 90 deg}"])
def test_overlapping_start_poses_are_errors(load, pose):
    loaded = load(f"robots: {{{A}, b: {{pose: {pose}}}}}\n" + PASS)
    (problem,) = [problem for problem in check_in_world(loaded) if problem.severity == "error"]
    assert (problem.line, problem.code) == (7, "SC044")
    assert "robot `b` overlaps robot `a` at the start" in problem.message


def test_shared_settings_apply_to_robots_without_their_own(load):
    loaded = load(
        f"robots:\n  {A}\n  b: {{pose: there, stack: {{controller: {{type: mppi}}}}, map: none, {PASS.strip()}}}\n"
        "stack: {controller_frequency: 10 Hz}\n" + PASS
    )
    a, b = loaded.robots["a"], loaded.robots["b"]
    assert (a.spec.stack.controller_frequency, b.spec.stack.controller_frequency) == (10.0, 10.0)
    assert (a.spec.stack.controller.type, b.spec.stack.controller.type) != (b.spec.stack.controller.type,) * 2
    assert (a.map, b.map) == (None, "none")
    assert [len(view.spec.pass_) for view in (a, b)] == [1, 2]
    assert [goal.pose.place for goal in a.spec.goals] == ["there"]
    assert a.position_of("goals", 0).line == 8


def test_the_order_of_robots_in_the_file_means_nothing(load):
    names = [list(load(f"robots: {{{one}, {other}}}\n{PASS}").robots) for one, other in ((A, B), (B, A))]
    assert names == [["a", "b"], ["a", "b"]]


def test_a_file_that_extends_another_changes_one_robot_of_it(load):
    loaded = load("robots: {b: {goals: []}}\n", base=f"robots: {{{A}, {B}}}\n{PASS}")
    assert [len(view.spec.goals) for view in loaded.robots.values()] == [1, 0]


def test_a_scenario_of_several_robots_is_not_loaded_by_halves(tmp_path):
    file = tmp_path / "several.scenario.yaml"
    file.write_text(HEAD + f"robots: {{{A}, b: {{pose: nowhere}}}}\n" + PASS)
    with pytest.raises(InvalidInput, match="nowhere"):
        load_scenario(file, tmp_path)


@pytest.mark.parametrize("robots", [f"robots: {{{A}, {B}}}\n", "robots: {a: 1}\n", ""])
def test_a_robot_that_the_text_of_a_log_does_not_have_is_a_problem_of_the_log(robots):
    with pytest.raises(InvalidInput, match=r"run\.mcap: the log is damaged: its scenario has no robot `c`"):
        criteria_of_text(HEAD + robots + PASS, "run.mcap", {}, "c")
