"""Execute one run in a worker process, and send its progress and its end record to the fork server."""

import errno
import faulthandler
import os
import signal
import sys
import traceback
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, NoReturn

from simscen.core.errors import InvalidInput, RunError, exception_place
from simscen.core.records.trace import Moment
from simscen.run.process.isolation import adopt_orphans, die_with_parent, has_running_children, limit_resources
from simscen.run.process.jobs import Job, json_line

PROGRESS_INTERVAL_S = 5.0
"""Simulated time between two progress messages."""

ExecuteJob = Callable[[Job, Callable[[float], None]], dict[str, Any]]
"""Function that runs a job, passes the simulated time in s to a callback, and returns the end record.

The end record is a summary of the run with the keys `outcome` and `sha256` (of the log).
"""

_DISK_FULL_ERRNOS = frozenset({errno.ENOSPC, errno.EDQUOT})
_OUT_OF_MEMORY = {"error": "out-of-memory", "message": "the run exceeded its memory limit"}


def run_worker(job: Job, parent: int, report: int, output: int, execute: ExecuteJob) -> NoReturn:
    """Run the job, send the end record, and exit. `parent` is the process id of the fork server.

    `report` and `output` are the file descriptors of the pipes for messages, and for stdout and stderr. After an error,
    the end record has the keys `error` and `message`.
    """
    code = 1
    try:
        _set_up_process(parent, output)
        end = _end_record(job, report, execute)
        os.write(report, json_line({"end": end, "left_processes": has_running_children()}))
        code = 0
        sys.stdout.flush()
        sys.stderr.flush()
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(code)  # the worker is a copy of the fork server, and must not return into its code


def _set_up_process(parent: int, output: int) -> None:
    os.setsid()
    die_with_parent(parent)
    adopt_orphans()
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    null = os.open(os.devnull, os.O_RDONLY)
    for descriptor, target in ((null, 0), (output, 1), (output, 2)):  # redirects the output of C libraries, too
        os.dup2(descriptor, target)
    os.close(null)
    os.close(output)
    faulthandler.enable()
    faulthandler.register(signal.SIGUSR1)
    with suppress(OSError):  # not permitted in some sandboxes
        # The kernel kills this process first when the machine runs out of memory.
        Path("/proc/self/oom_score_adj").write_text("500")
    limit_resources()


def _end_record(job: Job, report: int, execute: ExecuteJob) -> dict[str, Any]:
    """Run the job and return its end record; an exception becomes a record with `error` and `message`."""

    def send_progress(seconds: float) -> None:
        os.write(report, json_line({"seconds": seconds}))

    try:
        job.folder.mkdir(parents=True, exist_ok=True)
        return execute(job, send_progress)
    except RunError as error:
        return {"error": error.kind, "message": str(error), "tail": error.tail, "by_stack": error.by_stack}
    except InvalidInput as error:
        return {"error": "invalid", "message": str(error)}
    except MemoryError:
        return _OUT_OF_MEMORY
    except SystemExit as error:
        return {"error": "crashed", "message": f"called sys.exit({error.code}) ({exception_place(error)})"}
    except Exception as error:
        # The boundary of the process: any exception becomes the error of this run.
        if isinstance(error, OSError) and error.errno == errno.ENOMEM:
            return _OUT_OF_MEMORY
        if isinstance(error, OSError) and _is_about_output(error, job.folder):
            return {"error": "output", "message": f"{error.strerror} writing {error.filename or job.folder}"}
        traceback.print_exc()
        return {"error": "crashed", "message": f"{type(error).__name__}: {error} ({exception_place(error)})"}


def _is_about_output(error: OSError, folder: Path) -> bool:
    """Return whether an error is about a file in the output folder of the run, or about a full disk."""
    is_in_folder = isinstance(error.filename, str) and Path(error.filename).is_relative_to(folder)
    return is_in_folder or error.errno in _DISK_FULL_ERRNOS


class ProgressReporter:
    """MomentSink (receiver of the recorded beats) that passes the simulated time in s to `send`."""

    def __init__(self, tick_rate: int, send: Callable[[float], None]) -> None:
        self._rate, self._send = tick_rate, send
        self._next = 0.0

    def append(self, moment: Moment) -> None:
        """Report the simulated time if PROGRESS_INTERVAL_S has passed since the last report."""
        seconds = moment.tick / self._rate
        if seconds >= self._next:
            self._next = seconds + PROGRESS_INTERVAL_S
            self._send(seconds)
