"""What of a machine and an installation keeps runs from working; `simscen doctor` asks."""

import os
import platform
import resource
import shutil
import sys
import tempfile
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from simscen.cli.requirements import unmet
from simscen.run.process.confine import FILE_BYTES, MEMORY_BYTES, OPEN_FILES
from simscen.run.versions import PACKAGES, cpu_flags

PYTHONS = ((3, 10), (3, 11))
LEAST_FREE = 500 << 20
"""Bytes: some hundred logs of a minute each."""
LEAST_MEMORY = 1 << 30
"""Bytes that a run of a common world needs with room to spare."""
LEAST_SHARED = 16 << 20
"""Bytes of /dev/shm: what OpenMP and the renderer ask for."""
LEAST_FILES = 64


class Ill(Exception):
    """Why a check does not hold, and what would help."""


def python() -> str:
    """The version of Python is one that pybullet and ompl have wheels for."""
    if sys.version_info[:2] not in PYTHONS:
        raise Ill(f"{platform.python_version()}: simscen needs 3.10 or 3.11, which pybullet and ompl have wheels for")
    return f"{platform.python_version()} ({sys.executable})"


def packages() -> str:
    """All packages are there, in versions that simscen works with."""
    if told := unmet():
        raise Ill("; ".join(told))
    return ", ".join(f"{name} {_version(name)}" for name in PACKAGES)


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        raise Ill(f"{name} is not installed: pip install {name}") from None


def processor() -> str:
    """What logs may differ by in their last bits: never ill."""
    return f"{platform.machine()}, {len(os.sched_getaffinity(0))} cores, {' '.join(cpu_flags()) or 'flags unknown'}"


def fork() -> str:
    """Runs are forked from a warm process."""
    if sys.platform != "linux":
        raise Ill(f"{sys.platform}: runs are supervised with means that only Linux has")
    child = os.fork()
    if child == 0:
        os._exit(7)
    if os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) != 7:
        raise Ill("a forked process did not end as it should")
    return "processes can be forked"


def pidfd() -> str:
    """The supervisor waits for processes by file descriptors."""
    try:
        os.close(os.pidfd_open(os.getpid()))
    except (AttributeError, OSError) as error:
        raise Ill(f"pidfd_open: {error}; Linux 5.3 or newer is needed, and a sandbox that allows it") from None
    return f"Linux {platform.release()}"


def writable(folder: Path) -> str:
    """Something can be written in a folder."""
    try:
        with tempfile.NamedTemporaryFile(dir=folder) as file:
            file.write(b"simscen")
            file.flush()
    except OSError as error:
        raise Ill(f"cannot write in {folder}: {error.strerror}") from None
    return f"{folder} is writable"


def room(folder: Path) -> str:
    """There is room for some logs where simscen-out would be."""
    told = writable(folder)
    free = shutil.disk_usage(folder).free
    if free < LEAST_FREE:
        raise Ill(f"only {free / 2**20:.0f} MiB are free in {folder}; a run of a minute writes some 5 MiB")
    return f"{told}, {free / 2**30:.1f} GiB free"


def limits() -> str:
    """What the shell, the container and the system allow is enough for a run."""
    memory = min(_soft(resource.RLIMIT_AS), _cgroup_memory(), MEMORY_BYTES)
    files, length = _soft(resource.RLIMIT_NOFILE), _soft(resource.RLIMIT_FSIZE)
    if memory < LEAST_MEMORY:
        hint = "raise `ulimit -v` or the container's limit to 1 GiB for each job"
        raise Ill(f"a run gets {_mib(memory)} of memory; {hint}")
    if files < LEAST_FILES:
        raise Ill(f"a process may open {files} files; raise `ulimit -n` to {OPEN_FILES}")
    if length < LEAST_FREE:
        raise Ill(f"a file may have {_mib(length)}; raise `ulimit -f`, or logs are cut off")
    return f"a run may take {_mib(memory)} of memory, {min(files, OPEN_FILES)} files of {_mib(min(length, FILE_BYTES))}"


def shared_memory() -> str:
    """/dev/shm has room, which Docker keeps at 64 MiB."""
    try:
        free = shutil.disk_usage("/dev/shm").free
    except OSError as error:
        raise Ill(f"/dev/shm: {error.strerror}; mount it, e.g. docker run --shm-size 64m") from None
    if free < LEAST_SHARED:
        raise Ill(f"/dev/shm has only {_mib(free)} free; empty it, or start the container with --shm-size 64m")
    return f"/dev/shm has {_mib(free)} free"


def _soft(what: int) -> int:
    soft = resource.getrlimit(what)[0]
    return sys.maxsize if soft == resource.RLIM_INFINITY else soft


def _cgroup_memory() -> int:
    """What the control group, which a container is, may take (version 2, then 1)."""
    for name in ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"):
        try:
            text = Path(name).read_text(encoding="ascii").strip()
        except OSError:
            continue
        return int(text) if text.isdecimal() else sys.maxsize
    return sys.maxsize


def _mib(size: int) -> str:
    return f"{size / 2**20:.0f} MiB" if size < 10 << 30 else f"{size / 2**30:.0f} GiB"
