"""What a run's process may do: bounded in memory, files and life."""

import ctypes
import os
import resource
import signal
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

MAX_MEMORY_BYTES = 4 << 30
MAX_FILE_BYTES = 2 << 30
MAX_OPEN_FILES = 256
_PR_SET_PDEATHSIG = 1
_PASSED_ON = {"PATH", "HOME", "LANG", "TMPDIR", "XDG_CACHE_HOME", "SIMSCEN_CACHE_DIR"}
_ARITHMETIC = {
    *("OPENBLAS_CORETYPE", "OPENBLAS_L2_SIZE"),
    *("NPY_DISABLE_CPU_FEATURES", "NPY_ENABLE_CPU_FEATURES", "GLIBC_TUNABLES"),
}
"""Which instructions are used, so that a run has the last bits that the caller's own process would give it."""


def die_with_parent(parent: int) -> None:
    """Be killed when the process `parent` ends, even if it is killed itself.

    The request is lost when the parent ended before it was made, so that is checked afterwards.
    """
    ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent:
        os._exit(1)


def limit_memory() -> None:
    """Bound the memory of this process and of what it forks; no core dumps."""
    for what, most in ((resource.RLIMIT_AS, MAX_MEMORY_BYTES), (resource.RLIMIT_CORE, 0)):
        hard = resource.getrlimit(what)[1]
        resource.setrlimit(what, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))


def prefer_for_oom_kill() -> None:
    """Ask the kernel to end this process rather than the one that watches over it when the machine is out of memory."""
    with suppress(OSError):  # a kernel or sandbox that does not let itself be asked
        Path("/proc/self/oom_score_adj").write_text("500")


def limit_resources() -> None:
    """Bound memory, file sizes and open files of this process; no core dumps.

    The hard limits stay, so that what an external stack may do can be given back to it.
    """
    for what, most in (
        (resource.RLIMIT_AS, MAX_MEMORY_BYTES),
        (resource.RLIMIT_FSIZE, MAX_FILE_BYTES),
        (resource.RLIMIT_NOFILE, MAX_OPEN_FILES),
        (resource.RLIMIT_CORE, 0),
    ):
        hard = resource.getrlimit(what)[1]
        bound = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(what, (bound, hard))


def clean_environment() -> dict[str, str]:
    """The environment of the processes that run scenarios: nothing secret, one BLAS thread, no hash seed."""
    kept = {k: v for k, v in os.environ.items() if k in _PASSED_ON | _ARITHMETIC or k.startswith("LC_")}
    one_thread = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL", "NUMEXPR", "TBB")}
    return {**kept, **one_thread, "PYTHONHASHSEED": "0"}


# MERGED: Processes that a run leaves behind: adopted rather than lost, so that they can be found and killed.
# MERGED:
# MERGED: A group or a session can be left (`setsid`, a double fork), the adoption by a subreaper cannot: whose parent has died
# MERGED: becomes a child of the nearest ancestor that asked for it. That takes no rights and no cgroup.
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


def kill_children_except(known: Iterable[int]) -> bool:
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
