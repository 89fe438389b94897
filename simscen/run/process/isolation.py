"""Isolate the processes of runs: resource limits, environment, import path, and cleanup of descendants."""

import ctypes
import json
import os
import resource
import signal
import site
import sys
from collections.abc import Iterable
from pathlib import Path

from simscen.core.cpu_kernels import kernel_variables
from simscen.spec.registry import RegisteredType, search_path

MAX_MEMORY_BYTES = 4 << 30
MAX_FILE_BYTES = 2 << 30
MAX_OPEN_FILES = 256
"""Resource limits of a worker process."""
_PR_SET_PDEATHSIG = 1
_INHERITED_VARIABLES = {"PATH", "HOME", "LANG", "TMPDIR", "XDG_CACHE_HOME", "SIMSCEN_CACHE_DIR"}
_ARITHMETIC_VARIABLES = {
    *("OPENBLAS_CORETYPE", "OPENBLAS_L2_SIZE"),
    *("NPY_DISABLE_CPU_FEATURES", "NPY_ENABLE_CPU_FEATURES", "GLIBC_TUNABLES"),
}
"""Environment variables that affect the last bits of results, because they select processor instructions."""


def die_with_parent(parent: int) -> None:
    """Let the kernel kill this process when the process `parent` ends. Exits if the parent has already ended."""
    ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent:
        os._exit(1)


def limit_memory() -> None:
    """Limit the memory of this process and its future children, and disable core dumps. Sets only soft limits."""
    set_soft_limit(resource.RLIMIT_AS, MAX_MEMORY_BYTES)
    set_soft_limit(resource.RLIMIT_CORE, 0)


def set_soft_limit(resource_id: int, maximum: int) -> None:
    """Set the soft limit of a resource to `maximum`, or to the hard limit if the hard limit is lower."""
    hard = resource.getrlimit(resource_id)[1]
    resource.setrlimit(resource_id, (maximum if hard == resource.RLIM_INFINITY else min(maximum, hard), hard))


def limit_resources() -> None:
    """Limit the memory (see `limit_memory`), the file size, and the number of open files of this process."""
    limit_memory()
    set_soft_limit(resource.RLIMIT_FSIZE, MAX_FILE_BYTES)
    set_soft_limit(resource.RLIMIT_NOFILE, MAX_OPEN_FILES)


def clean_environment() -> dict[str, str]:
    """Return the environment variables of worker processes: fixed BLAS kernels and hash seed, and one BLAS thread.

    Only a few variables of this process are inherited, so that workers see no secrets.
    """
    inherited = {
        k: v for k, v in os.environ.items() if k in _INHERITED_VARIABLES | _ARITHMETIC_VARIABLES or k.startswith("LC_")
    }
    one_thread = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL", "NUMEXPR", "TBB")}
    return {**kernel_variables(), **inherited, **one_thread, "PYTHONHASHSEED": "0"}


_PR_SET_CHILD_SUBREAPER = 36


def adopt_orphans() -> None:
    """Make this process the new parent of descendants when their parent exits (PR_SET_CHILD_SUBREAPER)."""
    ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def has_running_children() -> bool:
    """Return whether a child of this process still runs. Reaps the children that have exited."""
    while True:
        try:
            ended, _ = os.waitpid(-1, os.WNOHANG)
        except ChildProcessError:
            return False
        if not ended:
            return True


def kill_children_except(kept: Iterable[int]) -> None:
    """Kill and reap all children of this process and their descendants, except the children with the ids `kept`.

    Call `adopt_orphans` once before. Programs of other users, such as `sudo`, cannot be killed, and continue.
    """
    own_pid, excluded = os.getpid(), set(kept)
    while True:
        # Not /proc/PID/task/PID/children, which can be incomplete while some children exit (proc(5)).
        running = [int(entry.name) for entry in Path("/proc").iterdir() if entry.name.isdigit()]
        children = [pid for pid in running if pid not in excluded and _parent(pid) == own_pid]  # including zombies
        if not children:
            return
        for pid in children:
            try:
                os.kill(pid, signal.SIGKILL)
            except PermissionError:
                excluded.add(pid)
            else:
                os.waitpid(pid, 0)


def _parent(pid: int) -> int:
    """Return the id of a process's parent, or 0 if the process has ended."""
    try:
        # Bytes, because the name of a program can be invalid UTF-8: the kernel cuts it after 15 bytes.
        return int(Path(f"/proc/{pid}/stat").read_bytes().rpartition(b")")[2].split()[1])
    except OSError:
        return 0


def plugin_path(plugins: Iterable[RegisteredType]) -> str:
    """Return the argument of `apply_plugin_path`, so that a fork server finds the same plug-ins as this process."""
    packages = sorted({(entry.distribution, entry.folder) for entry in plugins})
    user_site = site.getusersitepackages() if site.ENABLE_USER_SITE else ""
    return json.dumps(
        {"path": [str(Path(folder).absolute()) for folder in search_path()], "user": user_site, "packages": packages}
    )


def apply_plugin_path(argument: str) -> None:
    """Extend sys.path in a fork server, so that it finds the plug-ins of its parent process.

    New folders are appended. The folder of a plug-in comes first only if Python would otherwise find another version.
    """
    configuration = json.loads(argument)
    for folder in configuration["path"]:
        if folder not in sys.path:
            # addsitedir reads .pth files, which are used by editable installations.
            site.addsitedir(folder) if folder == configuration["user"] else sys.path.append(folder)
    from importlib.metadata import PackageNotFoundError, distribution

    for name, folder in configuration["packages"]:
        try:
            found = str(distribution(name).locate_file(""))
        except PackageNotFoundError:  # the runs report the missing package
            continue
        if os.path.realpath(found) != os.path.realpath(folder):
            sys.path.insert(0, folder)
