"""Runs the user's command and ends everything that it started, whatever becomes of the adapter.

`python keeper.py COMMAND`: the command runs in a shell and a process group of its own. When standard input closes, or
the command ends, all of its descendants are ended: they are asked with SIGINT, as Ctrl-C would, then SIGTERM, SIGKILL.
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
from typing import Dict, List

PR_SET_CHILD_SUBREAPER = 36
PATIENCE = ((signal.SIGINT, 4.0), (signal.SIGTERM, 2.0), (signal.SIGKILL, 5.0))


def descendants(parent: int) -> List[int]:
    """All processes that stem from `parent`, children first."""
    children: Dict[int, List[int]] = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            with contextlib.suppress(OSError):
                state, above = (entry / "stat").read_text().rpartition(")")[2].split()[:2]
                if state != "Z":
                    children.setdefault(int(above), []).append(int(entry.name))
    found, new = [], [parent]
    while new:
        new = [child for one in new for child in children.get(one, ())]
        found += new
    return found


def end_all() -> None:
    """End what stems from this process."""
    for number, seconds in PATIENCE:
        for child in descendants(os.getpid()):
            with contextlib.suppress(ProcessLookupError):
                os.kill(child, number)
        until = time.monotonic() + seconds
        while descendants(os.getpid()):
            if time.monotonic() > until:
                break
            time.sleep(0.02)
        else:
            return


def main() -> int:
    """Run the command to its end, or to the adapter's."""
    # Who loses its parent becomes a child of this process, instead of slipping away.
    ctypes.CDLL(None, use_errno=True).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda *_: None)
    started = subprocess.Popen(sys.argv[1], shell=True, stdin=subprocess.DEVNULL, start_new_session=True)
    while started.poll() is None:
        if select.select([0], [], [], 0.05)[0] and not os.read(0, 1):
            break
    end_all()
    code = started.wait()
    return code if code >= 0 else 128 - code


if __name__ == "__main__":
    sys.exit(main())
