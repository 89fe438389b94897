"""Tests of merging `--stack` with the stack of a scenario."""

from pathlib import Path

import pytest

from simscen.core.errors import InvalidInput
from simscen.loading.named_places import resolve_places
from simscen.loading.scenario import load_scenario
from simscen.loading.scenario_text import resolved_text
from simscen.loading.stacks.choice import StackChoice
from simscen.loading.stacks.stack_files import load_stack_file
from simscen.model.stack import StackSpec
from tests.scenario_files import spec_of_text

ZONES = "stack: {keepout: [hall], speed_zones: [{region: hall, speed_limit: 0.2}], costmap: {inflation_radius: 1}}\n"


@pytest.fixture
def load_with_stack_file(write, scenario, tmp_path: Path):
    """Return a function that loads the scenario with additional lines and with a stack file."""

    def load(lines: str, stack_file: str, name: str = "mine.stack.yaml"):
        choice = load_stack_file("mine", name, write(name, stack_file), tmp_path)
        return load_scenario(write("a.scenario.yaml", scenario + lines), tmp_path, (), choice)

    return load


def test_zones_are_from_the_scenario_and_parameters_from_the_stack_file(load_with_stack_file) -> None:
    loaded = load_with_stack_file(ZONES, "simscen: 1\nstack: {controller: {type: dwb}}\n")
    stack = loaded.spec.stack
    assert stack.controller.type == "dwb"
    assert stack.keepout == ["hall"]
    assert stack.speed_zones[0].speed_limit == 0.2
    assert stack.costmap.inflation_radius == 0.70  # the stack file replaces all parameters of the scenario


def test_the_log_keeps_the_scenario_as_it_ran(load_with_stack_file) -> None:
    loaded = load_with_stack_file(ZONES, "simscen: 1\nstack: {controller: {type: dwb}}\n")
    assert resolve_places(spec_of_text(resolved_text(loaded), "log"), loaded.world.spec.places) == loaded.spec
    assert loaded.text != resolved_text(loaded)


def test_the_reference_stack_keeps_the_parameters_that_the_scenario_gives_it(write, scenario, tmp_path: Path) -> None:
    file = write("a.scenario.yaml", scenario + ZONES)
    loaded = load_scenario(file, tmp_path, (), StackChoice("ref", "reference", "reference"))
    assert loaded.spec == load_scenario(file, tmp_path).spec
    assert resolved_text(loaded) == file.read_text()


def test_a_mistake_in_a_stack_file_is_reported_at_its_position(load_with_stack_file, tmp_path: Path) -> None:
    with pytest.raises(InvalidInput) as expected:
        load_with_stack_file("", "simscen: 1\nstack:\n  controler: {type: dwb}\n  keepout: [hall]\n")
    found = [(p.path, p.line, p.col, p.code, p.source) for p in expected.value.problems]
    assert found == [
        ("mine.stack.yaml", 3, 3, "SC012", "  controler: {type: dwb}"),
        ("mine.stack.yaml", 4, 3, "SC016", "  keepout: [hall]"),
    ]


def test_scenario_dependent_mistake_is_reported_in_the_stack_file(load_with_stack_file) -> None:
    """240 Hz of physics is not 7 times anything."""
    with pytest.raises(InvalidInput) as expected:
        load_with_stack_file("", "simscen: 1\nstack:\n  controller_frequency: 7 Hz\n")
    (problem,) = expected.value.problems
    assert (problem.path, problem.line, problem.code) == ("mine.stack.yaml", 3, "SC034")
    assert problem.source == "  controller_frequency: 7 Hz"


def test_a_stack_file_may_extend_another_and_lie_outside_the_root(write, scenario, tmp_path: Path) -> None:
    home = tmp_path / "project"
    file = write("project/a.scenario.yaml", scenario.replace("room", "../room").replace("cube", "../cube"))
    write("stacks/base.stack.yaml", "simscen: 1\nstack: {costmap: {inflation_radius: 0.4}}\n")
    text = "extends: base.stack.yaml\nstack: {controller: {type: mppi}}\n"
    choice = load_stack_file("m", "m", write("stacks/m.stack.yaml", text), home)
    assert choice.section is not None
    assert choice.section.plain == {"controller": {"type": "mppi"}, "costmap": {"inflation_radius": 0.4}}
    assert choice.relative_to_folder(home) == f"m={tmp_path}/stacks/m.stack.yaml"
    assert choice.relative_to_folder(tmp_path) == "m=stacks/m.stack.yaml"
    assert load_scenario(file, tmp_path, (), choice).spec.stack.costmap.inflation_radius == 0.4


def test_a_scenario_may_extend_a_stack_file(write, scenario, tmp_path: Path) -> None:
    write("m.stack.yaml", "simscen: 1\nstack: {controller: {type: mppi}}\n")
    loaded = load_scenario(write("a.scenario.yaml", "extends: m.stack.yaml\n" + scenario), tmp_path)
    assert loaded.spec.stack.controller.type == "mppi"


def test_the_reference_stack_takes_the_place_of_an_external_one(write, scenario, tmp_path: Path) -> None:
    file = write("a.scenario.yaml", scenario + "stack: {external: mine, keepout: [hall]}\n")
    stack = load_scenario(file, tmp_path, (), StackChoice("ref", "reference", "reference")).spec.stack
    assert isinstance(stack, StackSpec)
    assert stack.keepout == ["hall"]
