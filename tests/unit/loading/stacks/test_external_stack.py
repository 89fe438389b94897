"""Tests of external stacks in scenarios."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from simscen.core.errors import Problem
from simscen.loading.loaded import LoadedScenario
from simscen.model.stack import StackSpec
from simscen.model.stack_files import ExternalStackSpec
from tests.scenario_files import try_scenario

Write = Callable[[str, str], Path]
Load = Callable[[str], LoadedScenario | list[Problem]]


@pytest.fixture
def load(write: Write, scenario: str, tmp_path: Path) -> Load:
    """Loads the valid scenario after more lines were added to it."""
    return lambda more: try_scenario(write("a.scenario.yaml", scenario + more), tmp_path)


def stack_of(loaded: LoadedScenario | list[Problem]) -> Any:
    assert not isinstance(loaded, list), loaded
    return loaded.spec.stack


def test_default_stack_is_the_reference_stack(load: Load) -> None:
    assert isinstance(stack_of(load("")), StackSpec)
    assert isinstance(stack_of(load("stack: {type: reference}\n")), StackSpec)


def test_a_scenario_only_names_its_external_stack(load: Load) -> None:
    stack = stack_of(load("stack: {external: mine-2.0, controller_frequency: 10 Hz, keepout: [hall]}\n"))
    assert isinstance(stack, ExternalStackSpec)
    assert (stack.external, stack.controller_frequency, stack.keepout) == ("mine-2.0", 10.0, ["hall"])
    assert stack.goal_checker.xy_goal_tolerance == 0.25


@pytest.mark.parametrize(
    ("stack", "code", "message"),
    [
        ("{external: mine, command: rm}", "SC012", "unknown key `command` in `stack`"),
        ("{external: mine, planner: {}}", "SC012", "unknown key `planner` in `stack`"),
        ("{type: reference, external: mine}", "SC012", "unknown key `external` in `stack`"),
        ("{external: 'a b; rm'}", "SC017", "`a b; rm` is not a valid name"),
        ("{external: ../mine}", "SC017", "`../mine` is not a valid name"),
        ("{external: [sh, -c]}", "SC011", "expected text, got a list"),
        ("{type: refrence}", "SC014", "`refrence` is not one of the choices"),
        ("mine", "SC011", "expected a mapping, got the text `mine`"),
        ("{external: mine, keepout: [hell]}", "SC030", "no region of the world is called `hell`"),
        ("{external: mine, controller_frequency: 7}", "SC034", "stack.controller_frequency: 7 Hz does not divide"),
    ],
)
def test_forbidden_keys_of_an_external_stack_are_errors(load: Load, stack: str, code: str, message: str) -> None:
    found = load(f"stack: {stack}\n")
    assert isinstance(found, list)
    assert [problem.code for problem in found] == [code], found
    assert found[0].message.startswith(message)


def test_an_external_stack_takes_the_place_of_one_that_a_scenario_extends(load: Load, write: Write) -> None:
    write("defaults.yaml", "stack: {localizer: {type: ekf}, controller_frequency: 10}\n")
    assert stack_of(load("stack: {external: mine}\n")).controller_frequency == 20.0


def test_settings_of_an_external_stack_are_merged(load: Load, write: Write) -> None:
    write("defaults.yaml", "stack: {external: mine, controller_frequency: 10}\n")
    stack = stack_of(load("stack: {keepout: [hall]}\n"))
    assert (stack.external, stack.controller_frequency, stack.keepout) == ("mine", 10.0, ["hall"])


def test_recovery_and_localization_triggers_are_valid_with_an_external_stack(load: Load) -> None:
    events = "events:\n  - {when: {recovery: {name: spin}}, do: {cancel_goal: {}}}\n"
    lost = "  - {when: {localization_error: 3}, do: {cancel_goal: {}}}\n"
    assert isinstance(stack_of(load(f"stack: {{external: mine}}\n{events}{lost}")), ExternalStackSpec)
