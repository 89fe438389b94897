"""Processes that a run leaves behind: adopted rather than lost, so that they can be found and killed.

A group or a session can be left (`setsid`, a double fork), the adoption by a subreaper cannot: whose parent has died
becomes a child of the nearest ancestor that asked for it. That takes no rights and no cgroup.
"""

import ctypes
import os
import signal
from collections.abc import Iterable
from pathlib import Path

_PR_SET_CHILD_SUBREAPER = 36


def adopt_orphans() -> None:
    """Become the parent of every descendant whose own parent dies. Children do not inherit this."""
    ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def has_descendants() -> bool:
    """Whether anything that this process started, or adopted, still runs; what has ended is reaped."""
    while True:
        try:
            ended, _ = os.waitpid(-1, os.WNOHANG)
        except ChildProcessError:
            return False
        if not ended:
            return True


def kill_children_but(known: Iterable[int]) -> bool:
    """Kill and reap the children of this process that are not `known`, and what they leave in turn.

    Returns whether there were any.
    """
    found, spared = False, set(known)
    while strangers := [pid for pid in _children() if pid not in spared]:
        found = True
        for pid in strangers:
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)
    return found


def _children() -> list[int]:
    """The children of this process, dead ones too (Linux: /proc/PID/task/TID/children, or all of /proc)."""
    own = os.getpid()
    try:
        return [int(pid) for pid in Path(f"/proc/{own}/task/{own}/children").read_text().split()]
    except FileNotFoundError:  # a kernel without CONFIG_PROC_CHILDREN
        everything = [int(entry.name) for entry in Path("/proc").iterdir() if entry.name.isdigit()]
        return [pid for pid in everything if _parent(pid) == own]


def _parent(pid: int) -> int:
    """Field 4 of /proc/PID/stat; 0 when the process has ended meanwhile."""
    try:
        return int(Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[1])
    except OSError:
        return 0
