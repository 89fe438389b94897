"""Tests of `--stack` for scenarios with several robots."""

from pathlib import Path

import pytest

from simscen.cli.session.selection import Selection, load_selection
from simscen.loading.scenario_text import resolved_text
from simscen.run.reproducibility import scenario_digests
from tests.scenario_files import spec_of_text

HEAD = """\
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]}
time_limit: 1 s
pass: [{collisions: {max: 0}}]
"""
MIXED = (
    HEAD
    + """\
robots:
  a: {pose: {x: 1, y: 1}, stack: {external: mine, controller_frequency: 10 Hz}}
  b: {pose: {x: 3, y: 1}, stack: {controller: {type: dwb}}}
  c: {pose: {x: 5, y: 1}, stack: {external: other}}
"""
)
ALL = (
    HEAD
    + """\
stack: {external: mine}
robots:
  a: {pose: {x: 1, y: 1}}
  b: {pose: {x: 3, y: 1}, stack: {controller_frequency: 10 Hz}}
  c: {pose: {x: 5, y: 1}, stack: {type: reference}}
"""
)


@pytest.fixture
def project(simscen, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder with two scenarios, a program, and a configuration of the stack `other`."""
    (tmp_path / "good.scenario.yaml").unlink()
    for name, text in (("mixed", MIXED), ("all", ALL)):
        (tmp_path / f"{name}.scenario.yaml").write_text(text)
    (tmp_path / "nav").write_text("#!/bin/sh\n")
    (tmp_path / "nav").chmod(0o755)
    (tmp_path / "home/simscen").mkdir(parents=True)
    (tmp_path / "home/simscen/config.yaml").write_text("stacks: {other: {command: ./nav --other}}\n")
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "home"))
    return tmp_path


def loaded(name: str, *stacks: str):
    """Return the scenarios that are run for a scenario file and values of `--stack`."""
    return load_selection([Path(f"{name}.scenario.yaml")], None, [], False, Selection(), stacks)[0]


def stacks_by_robot(scenario) -> dict[str, str]:
    """Return the stack of each robot: the words of its command, or the type of the in-process stack."""
    return {
        name: " ".join(view.external_command.argv) if view.external_command else type(view.spec.stack).__name__
        for name, view in scenario.robots.items()
    }


def test_command_for_the_stack_name_of_one_robot_applies_only_to_this_robot(project: Path) -> None:
    (scenario,) = loaded("mixed", "mine=./nav --mine")
    assert stacks_by_robot(scenario) == {"a": "./nav --mine", "b": "StackSpec", "c": "./nav --other"}
    assert scenario.stack == "mine=./nav --mine"
    assert scenario.robots["b"].spec.stack.controller.type == "dwb"


def test_other_stack_replaces_the_stacks_of_all_robots(project: Path) -> None:
    (scenario,) = loaded("mixed", "v2=./nav --v2")
    assert stacks_by_robot(scenario) == dict.fromkeys("abc", "./nav --v2")
    assert scenario.robots["a"].spec.stack.controller_frequency == 10.0
    (scenario,) = loaded("mixed", "reference")
    assert stacks_by_robot(scenario) == dict.fromkeys("abc", "StackSpec")
    assert scenario.robots["b"].spec.stack.controller.type == "dwb"
    assert scenario.robots["a"].spec.stack.controller_frequency == 10.0
    (project / "mppi.stack.yaml").write_text("simscen: 1\nstack: {controller: {type: mppi}}\n")
    (scenario,) = loaded("mixed", "m=mppi.stack.yaml")
    assert {view.spec.stack.controller.type for view in scenario.robots.values()} == {"mppi"}


def test_stack_of_the_scenario_applies_to_robots_without_their_own(project: Path) -> None:
    (scenario,) = loaded("all", "mine=./nav")
    assert stacks_by_robot(scenario) == {"a": "./nav", "b": "./nav", "c": "StackSpec"}
    assert scenario.robots["b"].spec.stack.controller_frequency == 10.0
    (scenario,) = loaded("all", "reference")
    assert stacks_by_robot(scenario) == dict.fromkeys("abc", "StackSpec")


def test_recorded_scenario_contains_the_stack_of_each_robot(project: Path) -> None:
    for name, stack_option in (("mixed", "v2=./nav"), ("all", "reference")):
        (scenario,) = loaded(name, stack_option)
        recorded = spec_of_text(resolved_text(scenario), "kept")
        assert recorded.robots is not None
        for robot, view in scenario.robots.items():
            stack = recorded.robots[robot].stack or recorded.stack
            assert stack == view.spec.stack


def test_undefined_name_is_reported_for_each_robot(simscen, project: Path) -> None:
    result = simscen("run", "mixed.scenario.yaml")
    assert result.code == 2
    assert "mixed.scenario.yaml:6:45: error[SC060] the external stack `mine` has no command" in result.err
    assert result.err.count("SC060") == 1
    assert simscen("run", "all.scenario.yaml").err.count("SC060") == 1
    assert simscen("validate", ".").out.count("warning[SC060]") == 2


def test_two_stack_names_of_one_scenario_are_rejected(simscen, project) -> None:
    result = simscen("run", "mixed.scenario.yaml", "--stack", "mine=./nav", "--stack", "other=./nav")
    assert result.code == 2
    assert (
        "error[SC042] robots of this scenario have the stacks `mine` and `other`, but a run can have only one --stack"
        in result.err
    )
    assert "home/simscen/config.yaml" in result.err


def test_invalid_robots_are_reported_with_any_stack(simscen, project: Path) -> None:
    (project / "bad.scenario.yaml").write_text(HEAD + "robots: {a: 3, b: {pose: {x: 1, y: 1}}}\n")
    assert "bad.scenario.yaml:5:13: error" in simscen("validate", "bad.scenario.yaml", "--stack", "v2=./nav").out


def test_variation_of_a_replaced_stack_is_reported(simscen, project: Path) -> None:
    kept, replaced = "robots.a.stack.controller_frequency: [5 Hz, 20 Hz]", "robots.c.stack.external: [third, fourth]"
    for path, is_rejected in ((kept, False), (replaced, True)):
        (project / "varied.scenario.yaml").write_text(MIXED + f"variations: {{grid: {{{path}}}}}\n")
        result = simscen("validate", "varied.scenario.yaml", "--stack", "v2=./nav")
        assert ("SC062" in result.out, result.code) == (is_rejected, 2 if is_rejected else 0), result.out


def test_digest_includes_the_stack_of_each_robot(project: Path) -> None:
    original = scenario_digests(loaded("mixed", "mine=./nav")[0]).run
    assert scenario_digests(loaded("mixed", "mine=./nav")[0]).run == original
    assert scenario_digests(loaded("mixed", "mine=./nav 2")[0]).run != original
    (project / "home/simscen/config.yaml").write_text("stacks: {other: {command: ./nav --else}}\n")
    assert scenario_digests(loaded("mixed", "mine=./nav")[0]).run != original


def test_list_shows_the_stacks_of_robots(simscen, project: Path) -> None:
    assert "(stacks mine, other)" in simscen("list", ".").out
