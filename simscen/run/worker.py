"""The process of one run, from its first instruction to its last."""

import faulthandler
import json
import os
import signal
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

from simscen.core.errors import InvalidInput, RunError
from simscen.core.trace import Moment
from simscen.run.confine import die_with_parent, limit_resources
from simscen.run.jobs import Job, line

PROGRESS_EVERY = 5.0
"""Simulated seconds between two signs of life."""

Perform = Callable[[Job, Callable[[float], None]], dict[str, Any]]
"""Runs a job; is handed what to tell simulated seconds to; returns the end record."""


def be_worker(job: Job, parent: int, report: int, perform: Perform) -> None:
    """Run the job, tell how it ended on file descriptor `report`, and leave without looking back.

    `os._exit` because nanobind and Bullet have nothing to say at the end that a user should read.
    """
    os.setsid()
    die_with_parent(parent)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    job.folder.mkdir(parents=True, exist_ok=True)
    _redirect_output(job.folder / "worker.log")
    faulthandler.enable()
    faulthandler.dump_traceback_later(job.wall_limit, exit=False)
    limit_resources()
    end = _end_record(job, report, perform)
    os.write(report, line({"end": end}))
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0)


def _end_record(job: Job, report: int, perform: Perform) -> dict[str, Any]:
    try:
        return perform(job, lambda seconds: _tell(report, seconds))
    except RunError as error:
        return {"error": error.kind, "message": str(error)}
    except InvalidInput as error:
        return {"error": "invalid", "message": str(error)}
    except MemoryError:
        return {"error": "out-of-memory", "message": "the run used more memory than it may"}
    except OSError as error:
        traceback.print_exc()
        return {"error": "output", "message": f"{error.strerror or error} writing {error.filename or job.folder}"}
    except Exception as error:
        # The boundary of the process: whatever went wrong becomes this run's error, with the line it came from.
        traceback.print_exc()
        frame = traceback.extract_tb(error.__traceback__)[-1]
        return {
            "error": "crashed",
            "message": f"{type(error).__name__}: {error} ({Path(frame.filename).name}:{frame.lineno})",
        }


def _tell(report: int, seconds: float) -> None:
    os.write(report, json.dumps({"seconds": seconds}).encode() + b"\n")


def _redirect_output(path: Path) -> None:
    """Send what libraries print (also from C) to the run's own log, out of the command line's way."""
    log = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_APPEND, 0o644)
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.dup2(log, 1)
    os.dup2(log, 2)


class Progress:
    """A log that only tells how far the run is."""

    def __init__(self, tick_rate: int, tell: Callable[[float], None]) -> None:
        self._rate, self._tell = tick_rate, tell
        self._next = 0.0

    def append(self, moment: Moment) -> None:
        """Tell now and then."""
        seconds = moment.tick / self._rate
        if seconds >= self._next:
            self._next = seconds + PROGRESS_EVERY
            self._tell(seconds)
