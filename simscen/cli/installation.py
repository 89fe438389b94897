"""Checks of the machine and the installation for `simscen doctor`.

Each check returns its result as text, or raises CheckFailed or an error of the operating system.
"""

import os
import platform
import resource
import shutil
import sys
import tempfile
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from simscen.cli.requirements import unmet_requirements
from simscen.run.platform_fingerprint import PACKAGES, cpu_flags
from simscen.run.process.isolation import MAX_FILE_BYTES, MAX_MEMORY_BYTES, MAX_OPEN_FILES

SUPPORTED_PYTHONS = ((3, 10), (3, 11), (3, 12), (3, 13))
"""Supported versions of Python (major, minor)."""
MIN_DISK_BYTES = 500 << 20
"""Minimum free disk space: about a hundred logs of one minute."""
MIN_MEMORY_BYTES = 1 << 30
"""Minimum for the memory limit of a run."""
MIN_SHARED_MEMORY_BYTES = 16 << 20
"""Minimum free space in /dev/shm, which OpenMP and the renderer use."""
MIN_OPEN_FILES = 64
"""Minimum for the limit of open files of a run."""


class CheckFailed(Exception):
    """A check failed. The message states the reason, and what to do."""


def check_python() -> str:
    """Check the version of Python, and return the version and the path of the interpreter."""
    if sys.version_info[:2] not in SUPPORTED_PYTHONS:
        raise CheckFailed(f"{platform.python_version()}: simscen needs Python 3.10 to 3.13")
    return f"{platform.python_version()} ({sys.executable})"


def check_packages() -> str:
    """Check the versions of all required packages, and return the versions of the packages that affect results."""
    if problems := unmet_requirements():
        raise CheckFailed("; ".join(problems))
    return ", ".join(f"{name} {_version(name)}" for name in PACKAGES)


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        raise CheckFailed(f"{name} is not installed: pip install {name}") from None


def describe_processor() -> str:
    """Return the architecture, the number of usable cores, and the CPU flags of this machine."""
    return f"{platform.machine()}, {len(os.sched_getaffinity(0))} cores, {' '.join(cpu_flags()) or 'flags unknown'}"


def check_fork() -> str:
    """Check that the system is Linux, and that processes can be forked."""
    if sys.platform != "linux":
        raise CheckFailed(f"{sys.platform}: simscen runs on Linux only")
    child = os.fork()
    if child == 0:
        os._exit(7)
    if os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) != 7:
        raise CheckFailed("a forked process did not exit with the expected code")
    return "processes can be forked"


def check_pidfd() -> str:
    """Check that the system call pidfd_open works, and return the version of Linux."""
    try:
        os.close(os.pidfd_open(os.getpid()))
    except (AttributeError, OSError) as error:
        raise CheckFailed(f"pidfd_open: {error}; use Linux 5.3 or newer and a sandbox that allows it") from None
    return f"Linux {platform.release()}"


def check_writable(folder: Path) -> str:
    """Check that a file can be written in a folder."""
    try:
        with tempfile.NamedTemporaryFile(dir=folder) as file:
            file.write(b"simscen")
            file.flush()
    except OSError as error:
        raise CheckFailed(f"cannot write in {folder}: {error.strerror}") from None
    return f"{folder} is writable"


def check_temporary_folder() -> str:
    """Check that there is a writable folder for temporary files."""
    try:
        return check_writable(Path(tempfile.gettempdir()))
    except FileNotFoundError as error:
        raise CheckFailed(f"{error.strerror}; set TMPDIR to a writable folder") from None


def check_disk_space(folder: Path) -> str:
    """Check that a folder is writable and has MIN_DISK_BYTES of free space."""
    result = check_writable(folder)
    free = shutil.disk_usage(folder).free
    if free < MIN_DISK_BYTES:
        raise CheckFailed(f"only {free / 2**20:.0f} MiB are free in {folder}; a run of one minute writes about 5 MiB")
    return f"{result}, {free / 2**30:.1f} GiB free"


def check_resource_limits() -> str:
    """Check that the limits of memory, open files, and file sizes (of shell, container, and system) allow a run."""
    memory = min(_soft_limit(resource.RLIMIT_AS), _cgroup_memory(), MAX_MEMORY_BYTES)
    files, length = _soft_limit(resource.RLIMIT_NOFILE), _soft_limit(resource.RLIMIT_FSIZE)
    if memory < MIN_MEMORY_BYTES:
        hint = "raise `ulimit -v` or the container's limit to 1 GiB for each job"
        raise CheckFailed(f"a run gets only {_size(memory)} of memory; {hint}")
    if files < MIN_OPEN_FILES:
        raise CheckFailed(f"a process may open only {files} files; raise `ulimit -n` to {MAX_OPEN_FILES}")
    if length < MIN_DISK_BYTES:
        raise CheckFailed(f"a file may have only {_size(length)}; raise `ulimit -f`, otherwise logs are truncated")
    size = _size(min(length, MAX_FILE_BYTES))
    return f"a run may use {_size(memory)} of memory, {min(files, MAX_OPEN_FILES)} files of {size}"


def check_shared_memory() -> str:
    """Check that /dev/shm has MIN_SHARED_MEMORY_BYTES of free space."""
    try:
        free = shutil.disk_usage("/dev/shm").free
    except OSError as error:
        raise CheckFailed(f"/dev/shm: {error.strerror}; mount it, e.g. docker run --shm-size 64m") from None
    if free < MIN_SHARED_MEMORY_BYTES:
        raise CheckFailed(f"/dev/shm has only {_size(free)} free; empty it, or start the container with --shm-size 64m")
    return f"/dev/shm has {_size(free)} free"


def _soft_limit(limit: int) -> int:
    """Return the soft limit of a resource, such as resource.RLIMIT_AS; sys.maxsize if the resource is unlimited."""
    soft = resource.getrlimit(limit)[0]
    return sys.maxsize if soft == resource.RLIM_INFINITY else soft


def _cgroup_memory() -> int:
    """Return the memory limit of the root control group (of the container) in bytes; sys.maxsize without a limit."""
    for name in ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"):
        try:
            text = Path(name).read_text(encoding="ascii").strip()
        except OSError:
            continue
        return int(text) if text.isdecimal() else sys.maxsize
    return sys.maxsize


def _size(byte_count: int) -> str:
    """Return a size in bytes as text in MiB, or in GiB from 10 GiB."""
    return f"{byte_count / 2**20:.0f} MiB" if byte_count < 10 << 30 else f"{byte_count / 2**30:.0f} GiB"
