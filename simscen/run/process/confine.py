"""What a run's process may do: bounded in memory, files and life."""

import ctypes
import os
import resource
import signal
from contextlib import suppress
from pathlib import Path

MEMORY_BYTES = 4 << 30
FILE_BYTES = 2 << 30
OPEN_FILES = 256
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
    for what, most in ((resource.RLIMIT_AS, MEMORY_BYTES), (resource.RLIMIT_CORE, 0)):
        hard = resource.getrlimit(what)[1]
        resource.setrlimit(what, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))


def offer_to_the_oom_killer() -> None:
    """Ask the kernel to end this process rather than the one that watches over it when the machine is out of memory."""
    with suppress(OSError):  # a kernel or sandbox that does not let itself be asked
        Path("/proc/self/oom_score_adj").write_text("500")


def limit_resources() -> None:
    """Bound memory, file sizes and open files of this process; no core dumps.

    The hard limits stay, so that what an external stack may do can be given back to it.
    """
    for what, most in (
        (resource.RLIMIT_AS, MEMORY_BYTES),
        (resource.RLIMIT_FSIZE, FILE_BYTES),
        (resource.RLIMIT_NOFILE, OPEN_FILES),
        (resource.RLIMIT_CORE, 0),
    ):
        hard = resource.getrlimit(what)[1]
        bound = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(what, (bound, hard))


def environment() -> dict[str, str]:
    """The environment of the processes that run scenarios: nothing secret, one BLAS thread, no hash seed."""
    kept = {k: v for k, v in os.environ.items() if k in _PASSED_ON | _ARITHMETIC or k.startswith("LC_")}
    one_thread = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL", "NUMEXPR", "TBB")}
    return {**kept, **one_thread, "PYTHONHASHSEED": "0"}
