"""A warm process whose runs do what the scenario's first tag says before they are done as ever."""

import ctypes
import os
import signal
import time

from simscen.cli import warm_process

perform = warm_process._perform
prepared = warm_process._PREPARED.prepared


def misbehave(job, tell):
    tag = next(iter(job.scenario.spec.tags), "")
    if tag == "environment":
        print(dict(os.environ))
    if tag == "chatter":
        os.write(2, b"::set-output name=x::y\n##[error]boo\n]]>\x1b[31m</system-err><script>\xff\n")
        os.kill(os.getpid(), signal.SIGKILL)
    if tag == "crash":
        ctypes.string_at(0)
    return perform(job, tell)


def slow_to_prepare(scenario):
    if "slow-to-prepare" in scenario.spec.tags:
        time.sleep(60)
    return prepared(scenario)


if __name__ == "__main__":
    warm_process._perform = misbehave
    warm_process._PREPARED.prepared = slow_to_prepare
    warm_process.main()
