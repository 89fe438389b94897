"""Launcher of an external stack: `python -I -m simscen.run.external.launcher CONTROL REPORT SOCKET`.

A worker process starts this internal program with three file descriptors. The launcher reads the command of the stack
from CONTROL and starts the stack, which inherits SOCKET. It writes the exit code of the stack to REPORT. After one more
byte from CONTROL, or when the worker dies, it ends the stack and kills all descendants of the stack.
"""

import errno
import json
import os
import resource
import select
import signal
import struct
import subprocess
import sys
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

from simscen.run.process.isolation import adopt_orphans, die_with_parent, kill_children_except, set_soft_limit

EXIT_GRACE_S = 0.5
"""Time that a stack has to exit by itself after the run."""
TERM_GRACE_S = 0.5
"""Time between SIGTERM and SIGKILL."""
MAX_OPEN_FILES = 1024
"""Soft limit of open files for the stack, the usual default of Linux."""


def main() -> None:
    """Run one stack from start to end."""
    control, report, stream = map(int, sys.argv[1:])
    (size,) = struct.unpack("<I", _read_exactly(control, 4))
    order: dict[str, Any] = json.loads(_read_exactly(control, size))
    adopt_orphans()
    _restore_user_limits()
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # the worker ignores SIGINT, which the stack would inherit
    try:
        process = subprocess.Popen(
            order["argv"],
            env={**order["env"], order["variable"]: str(stream)},
            cwd=order["cwd"],
            stdin=subprocess.DEVNULL,
            pass_fds=[stream],
            start_new_session=True,
            preexec_fn=partial(die_with_parent, os.getpid()),  # noqa: PLW1509 - this program has one thread
        )
    except (OSError, ValueError) as error:
        _send_report(report, {"failed": _start_failure(error)})
        return
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.close(stream)
    pidfd = os.pidfd_open(process.pid)
    released = _watch(process, pidfd, control, report)
    if not _has_exited(pidfd, EXIT_GRACE_S if released else 0.0):
        with suppress(PermissionError):  # a program of another user, such as sudo
            os.killpg(process.pid, signal.SIGTERM)
        _has_exited(pidfd, TERM_GRACE_S)
    kill_children_except(())


def _start_failure(error: Exception) -> str:
    if not isinstance(error, OSError) or error.strerror is None:
        return str(error)
    if error.errno == errno.ENOEXEC:
        return f"{error.strerror}: neither a program for this machine nor a script that begins with #!"
    if error.errno == errno.ENOENT and error.filename and Path(error.filename).exists():
        return f"{error.strerror}: the file exists, but something that it needs does not, such as its dynamic linker"
    return f"{error.strerror}: {error.filename}" if error.filename else error.strerror


def _watch(process: "subprocess.Popen[bytes]", pidfd: int, control: int, report: int) -> bool:
    """Wait for the end of the run. If the stack exits before that, report its exit code. `pidfd` refers to the stack.

    Returns True if the worker requested the end of the stack, and False if the worker has died.
    """
    waiting = [control, pidfd]
    while True:
        ready, _, _ = select.select(waiting, [], [])
        if pidfd in ready:
            _send_report(report, {"exit": process.wait()})
            waiting.remove(pidfd)
        if control in ready:
            return bool(os.read(control, 1))


def _has_exited(pidfd: int, limit_s: float) -> bool:
    """Wait until a process exits, for at most `limit_s` seconds; return whether it has exited."""
    return bool(select.select([pidfd], [], [], limit_s)[0])


def _restore_user_limits() -> None:
    """Set the soft limits of memory and file size to the hard limits, and of open files to at most MAX_OPEN_FILES."""
    for limit in (resource.RLIMIT_AS, resource.RLIMIT_FSIZE):
        hard = resource.getrlimit(limit)[1]
        resource.setrlimit(limit, (hard, hard))
    set_soft_limit(resource.RLIMIT_NOFILE, MAX_OPEN_FILES)


def _send_report(report: int, message: dict[str, Any]) -> None:
    with suppress(BrokenPipeError):
        os.write(report, json.dumps(message).encode() + b"\n")


def _read_exactly(pipe: int, size: int) -> bytes:
    data = b""
    while len(data) < size:
        if not (piece := os.read(pipe, size - len(data))):
            sys.exit()  # the worker has ended
        data += piece
    return data


if __name__ == "__main__":
    main()
