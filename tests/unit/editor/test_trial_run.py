"""Tests of trial runs of the editor: progress, cancellation, errors, and deleted files."""

import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from simscen.editor.checking import TextChecks
from simscen.editor.document import EditedFile
from simscen.editor.trial_run import TrialRun, TrialRuns
from simscen.loading.loaded import LoadedScenario
from simscen.run.process.jobs import Job, JobUpdate, Progressed, Started
from simscen.spec.registry import RegisteredType

TEXT = """\
simscen: 1
world: {simscen: 1}
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 3, y: 1}}]
time_limit: 60 s
pass: [goals_reached: {}]
"""


class EndlessBackend:
    """Backend whose run reports progress until it is canceled."""

    def __enter__(self) -> "EndlessBackend":
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def run(
        self, jobs: Iterable[Job], plugins: Sequence[RegisteredType] = (), go_on: Callable[[], bool] = lambda: True
    ) -> Iterator[JobUpdate]:
        (job,) = jobs
        job.folder.mkdir(parents=True)
        yield Started(job.number)
        for seconds in range(1_000_000):
            time.sleep(0.01)
            yield Progressed(job.number, seconds + 1)


@pytest.fixture
def loaded(tmp_path: Path) -> LoadedScenario:
    return TextChecks(EditedFile(tmp_path / "a.scenario.yaml", "scenario", tmp_path)).load(TEXT)[0]


def wait_until(condition: Callable[[], bool]) -> None:
    """Return as soon as the condition is true; fail after 10 s."""
    for _ in range(1000):
        if condition():
            return
        time.sleep(0.01)
    raise AssertionError("the condition is still false after 10 s")


def test_a_run_shows_its_progress_until_it_is_stopped(loaded: LoadedScenario) -> None:
    runs = TrialRuns(EndlessBackend)
    trial = runs.start(loaded)
    wait_until(lambda: trial.seconds > 2)
    assert trial.data()["state"] == "running" and trial.data()["limit"] == 60
    trial.is_canceled = True
    wait_until(lambda: trial.state == "canceled")
    assert not trial.data()["replay"]
    runs.close()


def test_new_run_stops_the_previous_one_and_closing_deletes_all_files(loaded: LoadedScenario) -> None:
    runs = TrialRuns(EndlessBackend)
    trials: list[TrialRun] = []
    for _ in range(2):
        trials.append(runs.start(loaded))
        wait_until(lambda: trials[-1].seconds > 1)
    assert trials[0].state == "canceled"
    folder = trials[0].folder.parent
    assert folder.is_dir() and folder.name.startswith("simscen-edit-")
    runs.close()
    assert not folder.exists()


def test_a_run_that_is_stopped_before_its_turn_starts_no_process(loaded: LoadedScenario) -> None:
    started, is_released = [], threading.Event()

    class WaitingBackend(EndlessBackend):
        def run(self, jobs: Iterable[Job], *arguments: object) -> Iterator[JobUpdate]:
            (job,) = jobs
            started.append(job.folder.name)
            is_released.wait(10)
            yield Progressed(job.number, 1.0)

    runs = TrialRuns(WaitingBackend)
    runs.start(loaded)
    second = runs.start(loaded)
    second.is_canceled = True
    is_released.set()
    wait_until(lambda: second.state == "canceled")
    assert started == ["1"]
    runs.close()


class BrokenBackend(EndlessBackend):
    """Backend that raises an error when a run starts."""

    def run(self, *_: object) -> Iterator[JobUpdate]:
        raise RuntimeError("broken")


def test_an_unexpected_error_ends_the_run(loaded: LoadedScenario, capsys: pytest.CaptureFixture[str]) -> None:
    runs = TrialRuns(BrokenBackend)
    trial = runs.start(loaded)
    wait_until(lambda: trial.state == "error" and trial.message != "")
    assert trial.message == "internal error: RuntimeError; this is a bug in simscen"
    assert "RuntimeError: broken" in capsys.readouterr().err
    runs.close()


def test_runs_that_start_at_the_same_time_have_different_numbers(
    loaded: LoadedScenario, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def make_folder(prefix: str) -> str:
        time.sleep(0.2)  # the other thread starts its run in this time
        return str(tmp_path / prefix)

    monkeypatch.setattr("simscen.editor.trial_run.tempfile.mkdtemp", make_folder)
    runs = TrialRuns(EndlessBackend)
    with ThreadPoolExecutor(2) as threads:
        trials = list(threads.map(runs.start, [loaded, loaded]))
    assert sorted(trial.number for trial in trials) == [1, 2]
    assert [runs.trial(trial.number) for trial in trials] == trials
    runs.close()
