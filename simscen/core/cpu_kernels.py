"""Environment variables that make NumPy and OpenBLAS compute identical results on all processors with AVX2.

By default, both libraries choose kernels (AVX2, AVX-512, …) for the processor when they are loaded. The results of
different kernels differ in the last bits, so that runs on different processors diverge.
"""

import os
from importlib.util import find_spec
from pathlib import Path

CPUINFO = Path("/proc/cpuinfo")
"""File in which Linux lists the instruction sets of the processors."""
_FIRST_PROCESSOR_BYTES = 8192
"""Number of bytes to read from CPUINFO, enough for the entry of the first processor."""
_AVX512_BEFORE_2_4 = "AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL"
"""Names of the AVX-512 kernels before NumPy 2.4."""
_AVX512 = "X86_V4 AVX512_ICL AVX512_SPR"
"""Names of the AVX-512 kernels since NumPy 2.4."""

_pinned: set[str] = set()
"""Names of the variables that `pin_kernels` has set."""


def kernel_variables() -> dict[str, str]:
    """Return the environment variables that select AVX2 kernels; empty on processors without AVX2 or FMA."""
    if not {"avx2", "fma"} <= _processor_flags():
        return {}
    avx512 = _AVX512_BEFORE_2_4 if _numpy_version() < (2, 4) else _AVX512
    return {"OPENBLAS_CORETYPE": "Haswell", "NPY_DISABLE_CPU_FEATURES": avx512}


def pin_kernels() -> None:
    """Set the variables that `kernel_variables` returns, except those that the environment already contains.

    Call this before NumPy is imported.
    """
    for name, value in kernel_variables().items():
        if name not in os.environ:
            os.environ[name] = value
            _pinned.add(name)


def pinned_variables() -> frozenset[str]:
    """Return the names of the variables that `pin_kernels` has set."""
    return frozenset(_pinned)


def _processor_flags() -> set[str]:
    """Return the instruction sets of the first processor; empty if they are unknown."""
    try:
        with CPUINFO.open("rb") as file:
            text = file.read(_FIRST_PROCESSOR_BYTES).decode(errors="replace")
    except OSError:
        return set()
    flags = (line.partition(":")[2] for line in text.splitlines() if line.startswith("flags"))
    return set(next(flags, "").split())


def _numpy_version() -> tuple[int, int]:
    """Return major and minor version of NumPy without loading it; (0, 0) if it is missing."""
    spec = find_spec("numpy")
    for folder in (spec and spec.submodule_search_locations) or ():
        for line in Path(folder, "version.py").read_text(encoding="utf-8").splitlines():
            if line.startswith("version = "):
                major, minor, *_ = line.split('"')[1].split(".")
                return int(major), int(minor)
    return 0, 0
