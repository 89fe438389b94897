"""Versions of software, and digests of code and arithmetic, on which the results of runs depend."""

import hashlib
import importlib
import math
import platform
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from simscen.core.version import PACKAGE

PACKAGES = (
    *("simscen", "pybullet", "ompl", "filterpy", "numpy", "scipy", "embreex", "trimesh", "mapbox-earcut", "pycollada"),
    *("pillow", "mcap", "zstandard", "pydantic", "pyyaml"),
)
"""Python packages that affect the results or the log of a run."""
_RELEVANT_CPU_FLAGS = frozenset({"fma", "avx", "avx2", "avx512f", "sse4_2"})
"""Instruction sets that affect the last bits of results."""


def software_versions() -> dict[str, str]:
    """Return the versions of Python and all packages that affect results; "" for a missing package."""
    versions = {"python": platform.python_version(), **dict.fromkeys(PACKAGES, "")}
    for name in PACKAGES:
        with suppress(PackageNotFoundError):
            versions[name] = version(name)
    return versions


def cpu_flags() -> list[str]:
    """Return the instruction sets of this machine that affect results; empty except on x86 machines with Linux."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return []
    flags = next((line.split(":", 1)[1].split() for line in lines if line.startswith("flags")), [])
    return sorted(_RELEVANT_CPU_FLAGS.intersection(flags))


@cache
def arithmetic_fingerprints() -> dict[str, str]:
    """Return digests of sample results of OpenBLAS, the C math library, and NumPy, and the CPU features of NumPy.

    These libraries choose processor instructions at run time, so that results can differ in the last bits.
    """
    import numpy as np

    numbers = [(0.37 + 1.618 * k) * 1.7 ** (k % 23) for k in range(400)]
    functions = (math.sin, math.cos, math.tan, math.atan, math.sqrt, lambda x: math.exp(-x / 1e5), math.log)
    libm = [function(number) for function in functions for number in numbers]
    array = np.array(numbers)
    array_results = [
        np.sin(array),
        np.exp(-array / 1e5),
        np.arctan2(array, array[::-1]),
        np.outer(array, array) @ array,
    ]
    square = np.sin(np.arange(8100.0)).reshape(90, 90) + 90 * np.eye(90)
    blas = [
        function(square[:k, :k])
        for k in (3, 16, 90)
        for function in (lambda matrix: matrix @ matrix.T, np.linalg.inv, np.linalg.cholesky)
    ]
    core = "numpy._core" if np.lib.NumpyVersion(np.__version__) >= "2.0.0" else "numpy.core"
    cpu_features = importlib.import_module(f"{core}._multiarray_umath").__cpu_features__
    return {
        "blas": hashlib.sha256(b"".join(part.tobytes() for part in blas)).hexdigest()[:16],
        "libm": hashlib.sha256(repr(libm).encode()).hexdigest()[:16],
        "numpy": hashlib.sha256(b"".join(part.tobytes() for part in array_results)).hexdigest()[:16],
        "numpy_dispatch": " ".join(sorted(name for name, is_available in cpu_features.items() if is_available)),
    }


@cache
def source_digest(*parts: str) -> str:
    """Return the SHA-256 of simscen's source files, or only of the subpackages and modules (`name.py`) in `parts`."""
    sha, folder = hashlib.sha256(), PACKAGE
    roots = [folder / part for part in parts or (".",)]
    files = [path for root in roots for path in ([root] if root.is_file() else root.rglob("*"))]
    for file in sorted(path for path in files if path.suffix in (".py", ".yaml", ".json")):
        sha.update(f"{file.relative_to(folder).as_posix()}\0".encode() + file.read_bytes())
    return sha.hexdigest()
