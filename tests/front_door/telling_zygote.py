"""A warm process whose runs do what the scenario's first tag says before they are done as ever."""

import ctypes
import os
import signal

from simscen.cli import zygote

perform = zygote._perform


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


if __name__ == "__main__":
    zygote._perform = misbehave
    zygote.main()
