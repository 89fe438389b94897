"""Isolation of processes: resource limits, environment, and cleanup of descendants."""

import ctypes
import json
import os
import resource
import signal
import site
import sys
from collections.abc import Collection, Iterable
from contextlib import suppress
from pathlib import Path

from simscen.core.cpu_kernels import kernel_variables
from simscen.spec.registry import Entry, search_path

MAX_MEMORY_BYTES = 4 << 30
MAX_FILE_BYTES = 2 << 30
MAX_OPEN_FILES = 256
_PR_SET_PDEATHSIG = 1
_INHERITED_VARIABLES = {"PATH", "HOME", "LANG", "TMPDIR", "XDG_CACHE_HOME", "SIMSCEN_CACHE_DIR"}
_ARITHMETIC_VARIABLES = {
    *("OPENBLAS_CORETYPE", "OPENBLAS_L2_SIZE"),
    *("NPY_DISABLE_CPU_FEATURES", "NPY_ENABLE_CPU_FEATURES", "GLIBC_TUNABLES"),
}
"""Variables that select processor instructions and so affect the last bits of results."""


def die_with_parent(parent: int) -> None:
    """Have the kernel kill this process when `parent` ends for any reason.

    Exits at once if the parent has already ended.
    """
    ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent:
        os._exit(1)


def limit_memory() -> None:
    """Limit the memory of this process and its children, and disable core dumps."""
    for limit, maximum in ((resource.RLIMIT_AS, MAX_MEMORY_BYTES), (resource.RLIMIT_CORE, 0)):
        hard = resource.getrlimit(limit)[1]
        resource.setrlimit(limit, (maximum if hard == resource.RLIM_INFINITY else min(maximum, hard), hard))


def prefer_for_oom_kill() -> None:
    """Make this process the preferred victim of the OOM killer, so that the supervisor survives."""
    with suppress(OSError):  # not permitted in some sandboxes
        Path("/proc/self/oom_score_adj").write_text("500")


def limit_resources() -> None:
    """Limit memory, file size, and open files of this process, and disable core dumps.

    The hard limits stay, so that an external stack can have its original limits restored.
    """
    for limit, maximum in (
        (resource.RLIMIT_AS, MAX_MEMORY_BYTES),
        (resource.RLIMIT_FSIZE, MAX_FILE_BYTES),
        (resource.RLIMIT_NOFILE, MAX_OPEN_FILES),
        (resource.RLIMIT_CORE, 0),
    ):
        hard = resource.getrlimit(limit)[1]
        bound = maximum if hard == resource.RLIM_INFINITY else min(maximum, hard)
        resource.setrlimit(limit, (bound, hard))


def clean_environment() -> dict[str, str]:
    """Return the environment of worker processes: no secrets, fixed CPU kernels and hash seed, one BLAS thread."""
    inherited = {
        k: v for k, v in os.environ.items() if k in _INHERITED_VARIABLES | _ARITHMETIC_VARIABLES or k.startswith("LC_")
    }
    one_thread = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL", "NUMEXPR", "TBB")}
    return {**kernel_variables(), **inherited, **one_thread, "PYTHONHASHSEED": "0"}


_PR_SET_CHILD_SUBREAPER = 36


def adopt_orphans() -> None:
    """Become the parent of descendants whose own parent exits (PR_SET_CHILD_SUBREAPER).

    A descendant can leave its process group or session, but not its subreaper. Children do not inherit the setting."""
    ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def has_descendants() -> bool:
    """Return whether a child or adopted process still runs. Reaps those that have exited."""
    while True:
        try:
            ended, _ = os.waitpid(-1, os.WNOHANG)
        except ChildProcessError:
            return False
        if not ended:
            return True


def kill_children_except(known: Iterable[int]) -> bool:
    """Kill and reap all children that are not `known`, and their descendants.

    Returns whether there were any.
    """
    found, excluded = False, set(known)
    while unknown := _children_except(excluded):
        found = True
        for pid in unknown:
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)
    return found


def _children_except(excluded: Collection[int]) -> list[int]:
    """Return the children of this process that are not `excluded`, including zombies.

    The kernel's list of children may lack some while others exit (proc(5)). An empty list is therefore confirmed by
    the list of all processes.
    """
    own = os.getpid()
    with suppress(FileNotFoundError):  # a kernel without CONFIG_PROC_CHILDREN
        listed = map(int, Path(f"/proc/{own}/task/{own}/children").read_text().split())
        if found := [pid for pid in listed if pid not in excluded]:
            return found
    everything = (int(entry.name) for entry in Path("/proc").iterdir() if entry.name.isdigit())
    return [pid for pid in everything if pid not in excluded and _parent(pid) == own]


def _parent(pid: int) -> int:
    """Return the parent of a process, or 0 if the process has ended."""
    try:
        return int(Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[1])
    except OSError:
        return 0


def plugin_path_arguments(plugins: Iterable[Entry]) -> tuple[str, ...]:
    """Return the arguments with which the fork server finds these plug-ins; empty if there are none."""
    used = sorted({(entry.distribution, entry.folder) for entry in plugins})
    if not used:
        return ()
    user_site = site.getusersitepackages() if site.ENABLE_USER_SITE else ""
    return (
        json.dumps(
            {"path": [str(Path(folder).absolute()) for folder in search_path()], "user": user_site, "used": used}
        ),
    )


def apply_plugin_path(argument: str) -> None:
    """Extend sys.path in the fork server, so that it finds the same plug-ins as its parent.

    New folders come last, so that the engine does not change. A folder comes first only if another version of a used
    package would be found otherwise.
    """
    configuration = json.loads(argument)
    for folder in configuration["path"]:
        if folder not in sys.path:
            # addsitedir reads .pth files, which are used by editable installations.
            site.addsitedir(folder) if folder == configuration["user"] else sys.path.append(folder)
    from importlib.metadata import PackageNotFoundError, distribution

    for name, folder in configuration["used"]:
        try:
            found = str(distribution(name).locate_file(""))
        except PackageNotFoundError:  # its runs report the missing package
            continue
        if os.path.realpath(found) != os.path.realpath(folder):
            sys.path.insert(0, folder)
