"""Tests of the runs of the experiments of `simscen bench nav`."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from simscen.bench.localization.consistency import anees_bounds
from simscen.bench.navigation import generated_worlds
from simscen.bench.navigation.experiments import Experiment
from simscen.bench.navigation.summary import Trial
from simscen.cli.benchmarks import navigation_runs
from simscen.cli.benchmarks.navigation import experiments_with_stack
from simscen.cli.benchmarks.navigation_runs import _plan_jobs, summarize_experiment
from simscen.core.errors import InvalidInput
from simscen.core.records.run_result import Outcome, RunKey, RunResult
from simscen.core.records.session_events import Artifacts, RunFinished
from simscen.testing.synthetic_trace import synthetic_trace


def ramps(folder: Path) -> Experiment:
    return generated_worlds.write_ramps(folder, (1, 2))


def test_runs_with_another_stack_have_different_keys(tmp_path: Path) -> None:
    stack = tmp_path / "slow.stack.yaml"
    stack.write_text("simscen: 1\nstack: {controller: {desired_linear_vel: 0.3}}\n", encoding="utf-8")
    experiments = [ramps(tmp_path / "made/wide"), ramps(tmp_path / "made/narrow")]
    changed = experiments_with_stack(stack, experiments, tmp_path / "made", tmp_path)
    jobs, owners = _plan_jobs(changed, tmp_path / "out")
    assert [owners[job.key][0] for job in jobs] == [0, 0, 1, 1]
    assert len({job.folder for job in jobs}) == 4


def test_problems_of_a_stack_file_have_paths_from_the_working_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    project = tmp_path / "project"
    project.mkdir()
    (project / "bad.stack.yaml").write_text("simscen: 1\nstack: {planer: {}}\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InvalidInput) as error:
        experiments_with_stack(Path("project/bad.stack.yaml"), [], tmp_path / "made", Path("project"))
    assert [problem.path for problem in error.value.problems] == ["project/bad.stack.yaml"]


def test_anees_interval_at_a_time_counts_only_the_runs_that_last_until_this_time(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def read_log(file: Path) -> Any:
        # An error of 0.1 m with a standard deviation of 0.1 m: the NEES is 1.
        drive = {"seconds": float(file.stem), "truth": [[0, 0, 0]], "belief": {"offset": [0.1, 0, 0]}}
        return SimpleNamespace(trace=synthetic_trace(drive))

    monkeypatch.setattr(navigation_runs, "read_log", read_log)
    trials = [
        Trial(RunFinished(RunResult(RunKey("s", 1), "s", Outcome.PASSED), artifacts=Artifacts(mcap=f"{seconds}.mcap")))
        for seconds in (12, 25)
    ]
    accuracy = summarize_experiment(Experiment("tour", (), Path(), measures_localization=True), trials).localized
    assert accuracy is not None
    assert accuracy.anees == pytest.approx({5.0: 1.0, 10.0: 1.0, 20.0: 1.0})
    assert accuracy.bounds == {5.0: anees_bounds(2), 10.0: anees_bounds(2), 20.0: anees_bounds(1)}


NAV2 = """\
controller_server:
  ros__parameters:
    controller_plugins: [FollowPath]
    FollowPath: {plugin: "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController", lookahead_dist: 0.77}
    unheard_of: 3
"""


def test_nav2_parameter_file_is_a_valid_stack_and_ignored_parameters_are_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text(NAV2, encoding="utf-8")
    (other,) = experiments_with_stack(file, [ramps(tmp_path / "made")], tmp_path / "made", tmp_path)
    jobs, _ = _plan_jobs([other], tmp_path / "out")
    stack = jobs[0].scenario.spec.stack
    assert stack.controller.type == "regulated_pure_pursuit"
    assert stack.controller.lookahead_dist == 0.77
    assert "mine.yaml:5:" in (output := capsys.readouterr().err)
    assert "warning[SC341] controller_server: simscen has no unheard_of (5)" in output


def test_experiments_without_fields_select_nothing(simscen: Any) -> None:
    result = simscen("bench", "nav", "--only", "generated fields", "--fields", "0")
    assert result.code == 5
    assert "those that match have no data, fields, or drives" in result.err


def test_experiments_with_duplicate_runs_are_rejected(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="ramp_1"):
        _plan_jobs([ramps(tmp_path / "wide"), ramps(tmp_path / "narrow")], tmp_path / "out")
