"""Signals: the first stops a session cleanly, the second one immediately."""

import subprocess
import sys

PROGRAM = """
import os, signal, sys
from simscen.cli.session.backends import interrupt_on_signals
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
    done = run_program([0.0, 3.0])
    assert (done.returncode, done.stdout) == (130, "interrupted by 2\n")
    assert done.stderr.startswith("simscen: stopped without reports; run `simscen report`")
    assert run_program([0.0, 3.0], "SIGTERM").returncode == 143


def test_repeated_signal_of_one_key_press_counts_once():
    done = run_program([0.0, 0.01])
    assert (done.returncode, done.stdout) == (0, "interrupted by 2\nreports are written\n")
