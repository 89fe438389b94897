"""A fork server that injects the fault named by the first tag of a scenario, before or during the run.

`segfault` crashes before the run, `segfault.at.5` in the lockstep loop after 5 s of simulated time.
"""

import contextlib
import ctypes
import itertools
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pybullet

from simscen.cli.session import fork_server_main
from simscen.stack.localizers import sensor_models

FLOOD_MIB = 200
execute = fork_server_main._execute
prepare = fork_server_main._SCENARIO_CACHE.get_or_prepare


def spin():
    """Loop in C forever, holding the GIL and not handling signals, with little CPU load."""
    sum(map(ctypes.PyDLL(None).usleep, itertools.repeat(10_000)))


def leak():
    """Allocate memory until malloc fails, then abort, as an engine in C++ does."""
    while ctypes.CDLL(None).malloc(ctypes.c_size_t(1 << 28)):
        pass
    ctypes.CDLL(None).abort()


def print_flood():
    os.write(1, b"start of the output\n")
    for _ in range(FLOOD_MIB):
        os.write(1, b"x" * (1 << 20))


def fork_a_daemon():
    """Start a process that is in another process group and session, and has no living parent."""
    if os.fork() == 0:
        os.setsid()
        if os.fork() == 0:
            os.closerange(3, 256)
            os.execvp("sleep", ["sleep", "61.5"])
        os._exit(0)
    time.sleep(0.1)


def ignore_sigterm():
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    while True:
        time.sleep(1)


def return_nan_poses():
    """Make the engine return a pose of NaN."""
    pybullet.getBasePositionAndOrientation = lambda *_, **__: ((float("nan"),) * 3, (0.0, 0.0, 0.0, 1.0))


def make_weights_zero():
    sensor_models.LikelihoodField.log_likelihood = lambda self, poses, *_: np.full(len(poses), -np.inf)


def make_weights_nan():
    sensor_models.LikelihoodField.log_likelihood = lambda self, poses, *_: np.full(len(poses), np.nan)


def print_hostile_text():
    os.write(2, b"::set-output name=x::y\n##[error]boo\n]]>\x1b[31m</system-err><script>\xff\n")
    os.kill(os.getpid(), signal.SIGKILL)


def write_stray_bytes():
    for pipe in range(3, 256):
        with contextlib.suppress(OSError):
            os.write(pipe, b"\xff[[[ stray {\n" + b"[" * 100_000 + b'\n[1]\n{"end": 1}\n')


FAULTS = {
    "environment": lambda: print(dict(os.environ)),
    "chatter": print_hostile_text,
    "crash": lambda: ctypes.string_at(0),
    "segfault": lambda: ctypes.string_at(0),
    "sigkill": lambda: os.kill(os.getpid(), signal.SIGKILL),
    "exit-0": lambda: os._exit(0),
    "sys-exit": lambda: sys.exit(0),
    "spin": spin,
    "deaf": ignore_sigterm,
    "hang": lambda: time.sleep(600),
    "memory": lambda: [bytes(1 << 28) for _ in range(1 << 10)],
    "swell": leak,
    "grandchild": lambda: subprocess.Popen(["sleep", "61.5"]),
    "daemon": fork_a_daemon,
    "flood": print_flood,
    "exception": lambda: 1 / 0,
    "nan": return_nan_poses,
    "weightless": make_weights_zero,
    "nan-weights": make_weights_nan,
    "stray-bytes": write_stray_bytes,
    "kill-preparer": lambda: os.kill(os.getppid(), signal.SIGKILL),
    "stop-preparer": lambda: os.kill(os.getppid(), signal.SIGSTOP),
}


def execute_with_fault(job, report_time):
    fault, _, at = next(iter(job.scenario.spec.tags), "").partition(".at.")
    if fault not in FAULTS:
        return execute(job, report_time)
    if not at:
        FAULTS[fault]()
        return execute(job, report_time)
    pending = [FAULTS[fault]]

    def report_time_and_fail(seconds):
        report_time(seconds)
        if seconds >= float(at) and pending:
            pending.pop()()

    return execute(job, report_time_and_fail)


def prepare_with_fault(scenario):
    match next(iter(scenario.spec.tags), ""):
        case "slow-to-prepare":
            time.sleep(60)
        case "crash-to-prepare":
            ctypes.string_at(0)
        case "swell-to-prepare":
            leak()
    return prepare(scenario)


if __name__ == "__main__":
    fork_server_main._execute = execute_with_fault
    fork_server_main._SCENARIO_CACHE.get_or_prepare = prepare_with_fault
    fork_server_main.main()
