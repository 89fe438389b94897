"""Runner of scenarios for pytest: one warm process per worker, and one output folder per session."""

import secrets
from datetime import datetime, timezone
from itertools import count
from pathlib import Path

import pytest

import simscen
from simscen.core.records.case import Run
from simscen.core.records.session_events import RunFinished
from simscen.loading.loaded import LoadedScenario
from simscen.loading.plugins import plugins_of
from simscen.pytesting import OUT_OPTION
from simscen.run.process.jobs import Ended, Job, ReplayMode
from simscen.run.process.supervisor import Supervisor
from simscen.run.sessions.output_folder import DEFAULT_FOLDER, run_folder
from simscen.run.sessions.results import finished_run

WARM_PROCESS = ("-m", "simscen.cli.session.warm_process")
WALL_LIMIT_S = 300.0
"""Wall-clock limit of a run, as in `simscen run`."""


class Runner:
    """Runs scenarios one after the other, each in its own process, and writes their files to `folder`."""

    def __init__(self, folder: Path) -> None:
        """Create a runner that writes to a folder."""
        self.folder = folder
        self._numbers = count()
        self._supervisor = Supervisor(1, WARM_PROCESS)

    def run(self, scenario: LoadedScenario, seed: int) -> RunFinished:
        """Run a scenario and return its result."""
        key = scenario.key(seed)
        job = Job(next(self._numbers), scenario, key, run_folder(self.folder, key), WALL_LIMIT_S, ReplayMode.FAILED)
        ends = [update.end for update in self._supervisor.run([job], plugins_of(scenario)) if isinstance(update, Ended)]
        return finished_run(job, ends[0])

    def close(self) -> None:
        """End the warm process."""
        self._supervisor.close()


_RUNNER: pytest.StashKey[Runner] = pytest.StashKey()


def runner_of(config: pytest.Config) -> Runner:
    """Return the runner of this process. A worker of xdist gets its folder from the controller."""
    if (runner := config.stash.get(_RUNNER, None)) is None:
        runner = config.stash[_RUNNER] = Runner(_folder(config))
        config.add_cleanup(runner.close)
    return runner


def _folder(config: pytest.Config) -> Path:
    controller_folder = getattr(config, "workerinput", {}).get(OUT_OPTION)
    if controller_folder is not None:
        return Path(controller_folder)
    home = Path(config.getoption("--simscen-out") or config.getini(OUT_OPTION) or DEFAULT_FOLDER)
    return home / f"{datetime.now(timezone.utc):%Y%m%dT%H%M%SZ}-{secrets.token_hex(2)}-pytest"


class Simscen:
    """Value of the fixture `simscen`: runs scenarios in the process of the test with `simscen.simulate()`.

    Paths are relative to the folder of the test. The log of each run, `run.log`, is in the test's temporary folder.
    """

    def __init__(self, folder: Path, out: Path) -> None:
        """Take the folder of the test and the folder for logs."""
        self._folder, self._out = folder, out
        self._runs = 0

    def __call__(
        self, scenario: str | Path, seed: int | None = None, *, stack: str | None = None, variation: str = ""
    ) -> Run:
        """Run a scenario; the arguments are those of `simscen.simulate`."""
        self._runs += 1
        log = self._out / f"run-{self._runs}.mcap"
        return simscen.simulate(self._folder / scenario, seed, log=log, stack=stack, variation=variation)

    def variations(self, scenario: str | Path) -> list[str]:
        """Return the names of a scenario's variations; `[""]` without any."""
        return simscen.variations(self._folder / scenario)
