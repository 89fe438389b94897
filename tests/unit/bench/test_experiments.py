"""Tests that all generated benchmark scenarios are valid."""

from pathlib import Path

import pytest

from simscen.bench.navigation.experiments import Experiment, corner_cases, write_sandbox
from simscen.bench.navigation.localization_drives import write_localization_experiments
from simscen.bench.navigation.moving_cylinders import write_dynamic_fields
from simscen.bench.navigation.obstacle_fields import write_generated_fields
from simscen.cli.benchmarks.navigation import experiments_with_stack
from simscen.loading.scenario import load_scenario

PROJECT = Path(__file__).parents[3]
SANDBOX = PROJECT.parent / "shared" / "data" / "nav2_tb3_sandbox"


def load_drives(experiment: Experiment) -> None:
    """Load the scenario of each drive, which raises InvalidInput if a scenario is invalid."""
    for drive in experiment.drives:
        load_scenario(drive.file, experiment.root, experiment.world_path)


def test_generated_fields_load_and_carry_their_reference_length(tmp_path: Path) -> None:
    fields = write_generated_fields(tmp_path, (1,))
    load_drives(fields)
    assert (fields.drives[0].reference_length or 0.0) >= 10.0


def test_dynamic_fields_load_at_three_speeds(tmp_path: Path) -> None:
    experiments = write_dynamic_fields(tmp_path, (1,))
    assert [experiment.name for experiment in experiments] == [
        "dynamic fields, 0.74 m/s",
        "dynamic fields, 1.23 m/s",
        "dynamic fields, 1.72 m/s",
    ]
    for experiment in experiments:
        load_drives(experiment)


def test_localization_drives_have_different_wrong_estimates(tmp_path: Path) -> None:
    experiments = write_localization_experiments(tmp_path, PROJECT / "worlds", range(1, 21), range(1, 4))
    for experiment in experiments:
        load_drives(experiment)
    _, misled, unknown, _ = experiments
    assert list(unknown.drives[0].seeds) == [1, 2, 3]
    assert len({drive.file.read_text() for drive in misled.drives}) == 3


def test_every_corner_case_that_ships_is_an_experiment() -> None:
    cases = corner_cases(PROJECT / "scenarios", range(1, 21))
    assert {"narrow doorway", "dead end", "u trap"} <= {case.name for case in cases}
    for case in cases:
        load_drives(case)


@pytest.mark.skipif(not SANDBOX.is_dir(), reason="the worlds of Nav2 are not in this folder: see CONTRIBUTING.md")
def test_the_sandbox_loads_with_and_without_the_box(tmp_path: Path) -> None:
    for experiment in write_sandbox(tmp_path, SANDBOX, [1]):
        load_drives(experiment)


NAV2 = """\
controller_server:
  ros__parameters: {FollowPath: {plugin: "nav2_mppi_controller::MPPIController", vx_max: 0.4}}
planner_server:
  ros__parameters: {GridBased: {plugin: "nav2_navfn_planner::NavfnPlanner"}}
"""


def test_every_experiment_accepts_a_nav2_parameter_file(tmp_path: Path) -> None:
    (tmp_path / "nav2.yaml").write_text(NAV2)
    (tmp_path / "ours.stack.yaml").write_text("simscen: 1\nstack: {nav2_params: nav2.yaml}\n")
    experiments = [
        write_generated_fields(tmp_path / "made", (1,)),
        *write_dynamic_fields(tmp_path / "made", (1,))[:1],
        *corner_cases(PROJECT / "scenarios", range(1, 2)),
        *write_localization_experiments(tmp_path / "made", PROJECT / "worlds", range(1, 2), range(1, 2)),
    ]
    for experiment in experiments_with_stack(tmp_path / "ours.stack.yaml", experiments, tmp_path / "made", PROJECT):
        for drive in experiment.drives:
            stack = load_scenario(drive.file, experiment.root, experiment.world_path).spec.stack
            assert (stack.controller.type, stack.controller.vx_max, stack.planner.type) == ("mppi", 0.4, "navfn")
