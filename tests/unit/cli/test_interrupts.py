"""Tests of signals: the first one stops a session cleanly, the second one immediately."""

import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from simscen.cli.commands import doctor
from simscen.cli.session import from_log
from simscen.core.errors import Exit
from simscen.core.records.session_events import RunFinished
from simscen.run.process.supervisor import Interrupted

PROGRAM = """
import os, signal, sys
from simscen.cli.session.backends import interrupt_on_signals
from simscen.core.errors import Exit
from simscen.core.records.session_events import RunFinished
from simscen.run.process.supervisor import Interrupted

now = iter({signal_times})
try:
    with interrupt_on_signals(lambda: next(now)):
        os.kill(os.getpid(), signal.SIGINT)
except Interrupted as interrupted:
    print("interrupted by", interrupted.number, flush=True)
os.kill(os.getpid(), signal.{second})
print("reports are written", flush=True)
"""


def run_program(signal_times, second="SIGINT"):
    program = PROGRAM.format(signal_times=signal_times, second=second)
    return subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)


def test_second_signal_exits_and_names_the_report_command():
    result = run_program([0.0, 3.0])
    assert (result.returncode, result.stdout) == (130, "interrupted by 2\n")
    assert result.stderr.startswith("simscen: stopped without reports; run `simscen report`")
    assert run_program([0.0, 3.0], "SIGTERM").returncode == 143


def test_repeated_signal_of_one_key_press_counts_once():
    result = run_program([0.0, 0.01])
    assert (result.returncode, result.stdout) == (0, "interrupted by 2\nreports are written\n")


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Provide the folder for temporary files, and restore the handlers of signals afterwards."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    previous = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    signal.signal(signal.SIGHUP, signal.SIG_DFL)  # nohup ignores it
    yield tmp_path
    for number, handler in previous.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_signal_during_the_run_of_a_reconstructed_scenario_leaves_no_files(
    temporary: Path, monkeypatch: pytest.MonkeyPatch, number: signal.Signals
) -> None:
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: os.kill(os.getpid(), number))
    with pytest.raises(Interrupted):
        from_log._run(temporary / "a.scenario.yaml", temporary / "a.mcap", temporary / "recorded.mcap")
    assert not list(temporary.iterdir())


def test_signal_during_the_run_of_doctor_ends_the_command_and_leaves_no_files(
    temporary: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted_session(*_: object) -> tuple[list[RunFinished], Exit]:
        with pytest.raises(Interrupted):
            os.kill(os.getpid(), signal.SIGTERM)
        return [], Exit.TERMINATED

    monkeypatch.setattr("simscen.run.sessions.run_session.run_session", interrupted_session)
    with pytest.raises(SystemExit) as end:
        doctor.check_run()
    assert end.value.code == 143
    assert not list(temporary.iterdir())
