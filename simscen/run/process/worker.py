"""Execute one run in a worker process, and send its progress and its end record to the fork server."""

import errno
import faulthandler
import os
import signal
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

from simscen.core.errors import InvalidInput, RunError
from simscen.core.records.trace import Moment
from simscen.run.process.isolation import (
    adopt_orphans,
    die_with_parent,
    has_running_children,
    limit_resources,
    prefer_for_oom_kill,
)
from simscen.run.process.jobs import Job, json_line

PROGRESS_INTERVAL_S = 5.0
"""Simulated time between two progress messages."""

ExecuteJob = Callable[[Job, Callable[[float], None]], dict[str, Any]]
"""Function that runs a job, passes the simulated time in s to a callback, and returns the end record.

The end record is a summary of the run with the keys `outcome` and `sha256` (of the log).
"""

_DISK_FULL_ERRNOS = frozenset({errno.ENOSPC, errno.EDQUOT})
_OUT_OF_MEMORY = {"error": "out-of-memory", "message": "the run exceeded its memory limit"}


class WorkerPipes(NamedTuple):
    """File descriptors of the pipes for a worker's messages (`report`), and for its stdout and stderr (`output`)."""

    report: int
    output: int


def run_worker(job: Job, parent: int, pipes: WorkerPipes, execute: ExecuteJob) -> NoReturn:
    """Run the job, send the end record, and exit. `parent` is the process id of the fork server.

    After an error, the end record has the keys `error` and `message`.
    """
    code = 1
    try:
        _set_up_process(parent, pipes.output)
        end = _end_record(job, pipes.report, execute)
        os.write(pipes.report, json_line({"end": end, "left_processes": has_running_children()}))
        code = 0
        sys.stdout.flush()
        sys.stderr.flush()
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(code)  # the worker is a copy of the fork server, and must not return into its code


def _set_up_process(parent: int, output: int) -> None:
    """Set up the POSIX session, signals, output, resource limits, and faulthandler of this process."""
    os.setsid()
    die_with_parent(parent)
    adopt_orphans()
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _redirect_output(output)
    faulthandler.enable()
    faulthandler.register(signal.SIGUSR1)
    prefer_for_oom_kill()
    limit_resources()


def _end_record(job: Job, report: int, execute: ExecuteJob) -> dict[str, Any]:
    """Run the job and return its end record; an exception becomes a record with `error` and `message`."""
    try:
        job.folder.mkdir(parents=True, exist_ok=True)
        return execute(job, lambda seconds: _send_progress(report, seconds))
    except RunError as error:
        return {"error": error.kind, "message": str(error), "tail": error.tail, "by_stack": error.by_stack}
    except InvalidInput as error:
        return {"error": "invalid", "message": str(error)}
    except MemoryError:
        return _OUT_OF_MEMORY
    except SystemExit as error:
        return {"error": "crashed", "message": f"exited {error.code} by itself ({_innermost_frame(error)})"}
    except OSError as error:
        if error.errno == errno.ENOMEM:
            return _OUT_OF_MEMORY
        if error.errno not in _DISK_FULL_ERRNOS:
            traceback.print_exc()
        return {"error": "output", "message": f"{error.strerror or error} writing {error.filename or job.folder}"}
    except Exception as error:
        # The boundary of the process: any exception becomes the error of this run.
        traceback.print_exc()
        return {"error": "crashed", "message": f"{type(error).__name__}: {error} ({_innermost_frame(error)})"}


def _innermost_frame(error: BaseException) -> str:
    frame = traceback.extract_tb(error.__traceback__)[-1]
    return f"{Path(frame.filename).name}:{frame.lineno}"


def _send_progress(report: int, seconds: float) -> None:
    os.write(report, json_line({"seconds": seconds}))


def _redirect_output(output: int) -> None:
    """Redirect stdout and stderr, also of C libraries, to the pipe `output`."""
    null = os.open(os.devnull, os.O_RDONLY)
    os.dup2(null, 0)
    os.dup2(output, 1)
    os.dup2(output, 2)
    os.close(null)
    os.close(output)


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
