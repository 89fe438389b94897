"""Runs the user's launch command, and ends all processes that it started, even if the adapter is killed.

LaunchedCommand runs this file as a program, `python launch.py COMMAND`. The program runs the command in a shell. When
the command ends or the adapter closes standard input, the program sends SIGINT to all descendants, then SIGTERM, then
SIGKILL.
"""

import contextlib
import ctypes
import os
import select
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Dict, List, Mapping, Optional

PR_SET_CHILD_SUBREAPER = 36
"""Option of Linux's prctl that makes a process adopt descendants whose parent has ended."""
SIGNALS_AND_WAITS_S = ((signal.SIGINT, 4.0), (signal.SIGTERM, 2.0), (signal.SIGKILL, 5.0))
"""Signals to the descendants, each with the maximum time to wait for their end."""


class LaunchedCommand:
    """The running launch command. The constructor starts it."""

    def __init__(self, command: str, environment: Mapping[str, str]) -> None:
        self.command = command
        program = [sys.executable, str(Path(__file__).resolve()), command]
        self._process = subprocess.Popen(
            program, stdin=subprocess.PIPE, stdout=2, env=environment, start_new_session=True
        )

    @property
    def end_reason(self) -> Optional[str]:
        """How the command ended, such as "ended with exit code 1"; None while it runs."""
        code = self._process.poll()
        if code is None:
            return None
        number = -code if code < 0 else code - 128
        return f"ended by signal {number}" if 0 < number < signal.NSIG else f"ended with exit code {code}"

    def end(self) -> None:
        """End the command and all processes that it started, and wait until they have ended."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait()


def descendants(parent: int) -> List[int]:
    """Return the ids of all running descendants of the process `parent`, children before grandchildren."""
    children: Dict[int, List[int]] = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            with contextlib.suppress(OSError):
                # Bytes, because the name of a program can be invalid UTF-8: the kernel cuts it after 15 bytes.
                state, parent_pid = (entry / "stat").read_bytes().rpartition(b")")[2].split()[:2]
                if state != b"Z":
                    children.setdefault(int(parent_pid), []).append(int(entry.name))
    found, new = [], [parent]
    while new:
        new = [child for process in new for child in children.get(process, ())]
        found += new
    return found


def end_descendants() -> None:
    """End all descendants of this process with SIGNALS_AND_WAITS_S."""
    for number, seconds in SIGNALS_AND_WAITS_S:
        for child in descendants(os.getpid()):
            with contextlib.suppress(ProcessLookupError):
                os.kill(child, number)
        end = time.monotonic() + seconds
        while descendants(os.getpid()):
            if time.monotonic() > end:
                break
            time.sleep(0.02)
        else:
            return


def main() -> int:
    """Run the command until it ends or standard input is closed. Return its exit code."""
    # A descendant whose parent ends becomes a child of this process, so that `descendants` still finds it.
    ctypes.CDLL(None, use_errno=True).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda *_: None)
    command = subprocess.Popen(sys.argv[1], shell=True, stdin=subprocess.DEVNULL, start_new_session=True)
    while command.poll() is None:
        if select.select([0], [], [], 0.05)[0] and not os.read(0, 1):
            break
    end_descendants()
    code = command.wait()
    return code if code >= 0 else 128 - code


if __name__ == "__main__":
    sys.exit(main())
