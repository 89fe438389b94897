"""A fork server whose runs do what the scenario's first tag says, before they begin or mid-run.

`segfault` strikes before the run, `segfault.at.5` from inside the lockstep when five simulated seconds have gone by.
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

FLOOD = 200  # MiB
perform = fork_server_main._execute
prepared = fork_server_main._SCENARIOS.get_or_prepare


def spin():
    """A loop in C that holds Python's lock and never looks for signals. It hardly uses the processor."""
    sum(map(ctypes.PyDLL(None).usleep, itertools.repeat(10_000)))


def swell():
    """Memory as an engine in C++ takes it: until malloc gives no more, and then as if it had."""
    while ctypes.CDLL(None).malloc(ctypes.c_size_t(1 << 28)):
        pass
    ctypes.CDLL(None).abort()


def flood():
    os.write(1, b"the beginning\n")
    for _ in range(FLOOD):
        os.write(1, b"x" * (1 << 20))


def fork_a_daemon():
    """A process that left group, session and parent behind."""
    if os.fork() == 0:
        os.setsid()
        if os.fork() == 0:
            os.closerange(3, 256)
            os.execvp("sleep", ["sleep", "61.5"])
        os._exit(0)
    time.sleep(0.1)


def be_deaf():
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    while True:
        time.sleep(1)


def lose_the_robot():
    """The pose that an engine gives after dividing by zero."""
    pybullet.getBasePositionAndOrientation = lambda *_, **__: ((float("nan"),) * 3, (0.0, 0.0, 0.0, 1.0))


def lose_all_weight():
    sensor_models.LikelihoodField.log_likelihood = lambda self, poses, *_: np.full(len(poses), -np.inf)


def make_weights_nan():
    sensor_models.LikelihoodField.log_likelihood = lambda self, poses, *_: np.full(len(poses), np.nan)


def chatter():
    os.write(2, b"::set-output name=x::y\n##[error]boo\n]]>\x1b[31m</system-err><script>\xff\n")
    os.kill(os.getpid(), signal.SIGKILL)


def stray_bytes():
    for pipe in range(3, 256):
        with contextlib.suppress(OSError):
            os.write(pipe, b"\xff[[[ stray {\n" + b"[" * 100_000 + b'\n[1]\n{"end": 1}\n')


FAULTS = {
    "environment": lambda: print(dict(os.environ)),
    "chatter": chatter,
    "crash": lambda: ctypes.string_at(0),
    "segfault": lambda: ctypes.string_at(0),
    "sigkill": lambda: os.kill(os.getpid(), signal.SIGKILL),
    "exit-0": lambda: os._exit(0),
    "sys-exit": lambda: sys.exit(0),
    "spin": spin,
    "deaf": be_deaf,
    "hang": lambda: time.sleep(600),
    "memory": lambda: [bytes(1 << 28) for _ in range(1 << 10)],
    "swell": swell,
    "grandchild": lambda: subprocess.Popen(["sleep", "61.5"]),
    "daemon": fork_a_daemon,
    "flood": flood,
    "exception": lambda: 1 / 0,
    "nan": lose_the_robot,
    "weightless": lose_all_weight,
    "nan-weights": make_weights_nan,
    "stray-bytes": stray_bytes,
    "kill-preparer": lambda: os.kill(os.getppid(), signal.SIGKILL),
    "stop-preparer": lambda: os.kill(os.getppid(), signal.SIGSTOP),
}


def misbehave(job, tell):
    fault, _, at = next(iter(job.scenario.spec.tags), "").partition(".at.")
    if fault not in FAULTS:
        return perform(job, tell)
    if not at:
        FAULTS[fault]()
        return perform(job, tell)
    left = [FAULTS[fault]]

    def tell_and_fail(seconds):
        tell(seconds)
        if seconds >= float(at) and left:
            left.pop()()

    return perform(job, tell_and_fail)


def slow_to_prepare(scenario):
    match next(iter(scenario.spec.tags), ""):
        case "slow-to-prepare":
            time.sleep(60)
        case "crash-to-prepare":
            ctypes.string_at(0)
        case "swell-to-prepare":
            swell()
    return prepared(scenario)


if __name__ == "__main__":
    fork_server_main._execute = misbehave
    fork_server_main._SCENARIOS.get_or_prepare = slow_to_prepare
    fork_server_main.main()
