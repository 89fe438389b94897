"""Pytest collector for scenario files, test items (one per run), and the value of the fixture `simscen`."""

from __future__ import annotations

import secrets
from argparse import ArgumentTypeError
from collections.abc import Iterator, Sequence
from datetime import datetime, timezone
from itertools import count
from pathlib import Path
from typing import Any

import pytest
from _pytest._code.code import ReprEntryNative, ReprExceptionInfo, ReprFileLocation, ReprTraceback

import simscen
from simscen.cli.diagnostics import as_text, relative_to_working_folder
from simscen.cli.session.file_checks import FileChecker
from simscen.cli.session.fork_server_start import FORK_SERVER
from simscen.cli.session.stacks import parse_stacks
from simscen.core.errors import InvalidInput, Problem, SimscenError, UsageError
from simscen.core.records.case import Run
from simscen.core.records.run_result import Outcome
from simscen.core.records.session_events import RunFinished
from simscen.loading.checks.scene_runner import world_problems
from simscen.loading.files.discovery import default_root
from simscen.loading.loaded import LoadedScenario
from simscen.loading.plugins import plugins_of
from simscen.pytesting import OUT_OPTION, positive_number
from simscen.report.display_text import plain_text
from simscen.report.session_lines import violation_lines
from simscen.report.violations import error_summary, reported_violations, scenario_file, short_run_name
from simscen.run.kept_files import OutcomeFilter
from simscen.run.process.jobs import Ended, Job
from simscen.run.process.supervisor import Supervisor
from simscen.run.sessions.output_folder import DEFAULT_FOLDER, run_folder
from simscen.run.sessions.results import finished_run
from simscen.run.sessions.run_session import SessionOptions, scenario_seeds

WALL_LIMIT_S = 300.0
"""Wall-clock limit of a run, as in `simscen run`."""


class Runner:
    """Runs each scenario in its own process, one at a time, and writes logs and pictures to `folder`."""

    def __init__(self, folder: Path) -> None:
        """Create a runner without starting a process."""
        self.folder = folder
        self._numbers = count()
        self._supervisor = Supervisor(1, FORK_SERVER)

    def run(self, scenario: LoadedScenario, seed: int) -> RunFinished:
        """Run a scenario with a seed and return the result."""
        key = scenario.key(seed)
        job = Job(next(self._numbers), scenario, key, run_folder(self.folder, key), WALL_LIMIT_S, OutcomeFilter.FAILED)
        ends = [update.end for update in self._supervisor.run([job], plugins_of(scenario)) if isinstance(update, Ended)]
        return finished_run(job, ends[0])

    def close(self) -> None:
        """End the process from which the runs are forked."""
        self._supervisor.close()


_RUNNER: pytest.StashKey[Runner] = pytest.StashKey()


def runner_of(config: pytest.Config) -> Runner:
    """Return the runner of this pytest process. The first call creates it."""
    if (runner := config.stash.get(_RUNNER, None)) is None:
        runner = config.stash[_RUNNER] = Runner(_folder(config))
        config.add_cleanup(runner.close)
    return runner


def _folder(config: pytest.Config) -> Path:
    """Return the output folder: a new folder, or in a worker of pytest-xdist the folder of the controller process."""
    controller_folder = getattr(config, "workerinput", {}).get(OUT_OPTION)
    if controller_folder is not None:
        return Path(controller_folder)
    out_folder = Path(config.getoption("--simscen-out") or config.getini(OUT_OPTION) or DEFAULT_FOLDER)
    return out_folder / f"{datetime.now(timezone.utc):%Y%m%dT%H%M%SZ}-{secrets.token_hex(2)}-pytest"


class Simscen:
    """Value of the fixture `simscen`. Runs scenarios in the process of the test."""

    def __init__(self, folder: Path, out: Path, world_path: Sequence[Path] = ()) -> None:
        """Set the folder of relative scenario paths, the folder `out` for logs, and additional folders with worlds."""
        self._folder, self._out, self._world_path = folder, out, world_path
        self._runs = 0

    def __call__(
        self, scenario: str | Path, seed: int | None = None, *, stack: str | None = None, variation: str = ""
    ) -> Run:
        """Run a scenario with the arguments of `simscen.simulate`, and return the run."""
        self._runs += 1
        log = self._out / f"run-{self._runs}.mcap"
        return simscen.simulate(
            self._folder / scenario, seed, log=log, world_path=self._world_path, stack=stack, variation=variation
        )

    def variations(self, scenario: str | Path) -> list[str]:
        """Return the names of a scenario's variations; `[""]` if it has none."""
        return simscen.variations(self._folder / scenario, world_path=self._world_path)


PYTEST_MARKERS = frozenset(
    {"skip", "skipif", "xfail", "usefixtures", "filterwarnings", "parametrize", "tryfirst", "trylast"}
)
"""Built-in markers of pytest. Tags of scenarios with these names do not become markers."""


class ScenarioFile(pytest.File):
    """Collector of the runs of a scenario file."""

    def collect(self) -> Iterator[pytest.Item]:
        """Yield an item for each variation, seed, and stack. Raises CollectError for an invalid scenario."""
        try:
            yield from self._items()
        except InvalidInput as error:
            raise self.CollectError(as_text(error.problems)) from error
        except SimscenError as error:
            raise self.CollectError(str(error)) from error

    def _items(self) -> Iterator[pytest.Item]:
        config = self.config
        root, world_path = default_root([self.path]), config.getini("simscen_world_path")
        stacks = config.getoption("--simscen-stack") or config.getini("simscen_stack")
        checker = FileChecker(root, world_path, fast=True, stacks=parse_stacks(stacks, root, world_path))
        options = SessionOptions(seed=_seed(config), repeat=config.getoption("--simscen-repeat"))
        for choice in checker.choices:
            scenarios, problems = checker.check_scenario(self.path, choice)
            _raise_errors(problems, root)
            for scenario in scenarios:
                loaded = scenario.with_changes(has_several_stacks=len(checker.choices) > 1)
                for seed in scenario_seeds(loaded, options):
                    yield ScenarioRun.create(self, loaded, seed, with_seed=options.repeat > 1)


class ScenarioRun(pytest.Item):
    """Test item for one run of a scenario."""

    def __init__(self, *, scenario: LoadedScenario, seed: int, **kwargs: Any) -> None:
        """Create an item from the scenario, the seed, and the arguments of `pytest.Item`."""
        super().__init__(**kwargs)
        self._scenario, self._seed = scenario, seed

    @classmethod
    def create(cls, parent: ScenarioFile, scenario: LoadedScenario, seed: int, *, with_seed: bool) -> ScenarioRun:
        """Create an item with the tags of the scenario as markers. The name contains the seed only if `with_seed`."""
        folder = scenario.id.rpartition("/")[0]
        name = short_run_name(scenario.key(seed), with_seed, f"{folder}/" if folder else "")
        item: ScenarioRun = cls.from_parent(parent, name=name, scenario=scenario, seed=seed)
        for tag in ("simscen", *scenario.spec.tags):
            if tag not in PYTEST_MARKERS and not tag.startswith("_"):
                item.config.addinivalue_line("markers", f"{tag}: a tag of scenarios")
                item.add_marker(tag)
        if scenario.spec.skip is not None:
            item.add_marker(pytest.mark.skip(reason=scenario.spec.skip))
        return item

    def runtest(self) -> None:
        """Run the scenario in its own process. Raises ScenarioFailed if the run fails unexpectedly or is aborted."""
        _raise_errors(world_problems(self._scenario), self._scenario.root)
        run = runner_of(self.config).run(self._scenario, self._seed)
        self.user_properties += _properties(run)
        if run.outcome is Outcome.FAILED_AS_EXPECTED:
            pytest.xfail(run.result.reason)
        if run.outcome is not Outcome.PASSED:
            raise ScenarioFailed(run)

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        """Return the violated criteria of a failed run, the problems of an invalid scenario, or else the traceback."""
        if isinstance(excinfo.value, ScenarioFailed):
            return failure_representation(excinfo.value.run)
        if isinstance(excinfo.value, InvalidInput):
            return as_text(excinfo.value.problems)
        return super().repr_failure(excinfo)

    def reportinfo(self) -> tuple[Path, int | None, str]:
        """Return file, line, and name of the item."""
        return self.path, 0, self.name


def _raise_errors(problems: list[Problem], root: Path) -> None:
    """Raise InvalidInput if there is a problem with severity error. Ignore warnings.

    Paths in `problems` are relative to `root`. Paths in InvalidInput are relative to the working folder.
    """
    if errors := [problem for problem in problems if problem.severity == "error"]:
        raise InvalidInput(relative_to_working_folder(errors, root))


def _seed(config: pytest.Config) -> int | None:
    """Return the seed of the command line or the ini option; None for the seeds of the scenarios. Raises UsageError."""
    option: int | None = config.getoption("--simscen-seed")
    ini_value = config.getini("simscen_seed")
    if option is not None or not ini_value:
        return option
    try:
        return positive_number(ini_value)
    except ArgumentTypeError as error:
        raise UsageError(f"simscen_seed: {error}") from error


def _properties(run: RunFinished) -> list[tuple[str, object]]:
    """Return names and values of the JUnit properties of a run."""
    files = {"log": run.artifacts.mcap, "picture": run.artifacts.picture}
    facts = {"seed": run.key.seed, "simulated_seconds": f"{run.result.simulated:.3f}", "again": run.again, **files}
    return [(name, value) for name, value in facts.items() if value]


class ScenarioFailed(AssertionError):
    """A run failed unexpectedly or was aborted."""

    def __init__(self, run: RunFinished) -> None:
        """Create the error for a finished run."""
        self.run = run
        super().__init__(_cause(run))


def failure_representation(run: RunFinished) -> Any:
    """Return pytest's representation of a failed run, with the lines that `simscen run` prints for the run."""
    lines = [f"{plain_text(line).removeprefix('      ')}\n" for line in violation_lines(run)]
    first = next((violation.line for violation in reported_violations(run) if not violation.is_warning), 0)
    # This class is not public in pytest, but xdist sends a failure to the controller only as this class.
    crash = ReprFileLocation(path=scenario_file(run), lineno=first or 1, message=_cause(run))
    return ReprExceptionInfo(ReprTraceback([ReprEntryNative(lines)], extraline=None, style="native"), crash)


def _cause(run: RunFinished) -> str:
    """Return the first cause of the failure in one line."""
    if run.outcome is Outcome.ERROR:
        return error_summary(run)
    return next((violation.message for violation in reported_violations(run) if not violation.is_warning), "failed")
