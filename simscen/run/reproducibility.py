"""Digests of everything on which the result of a run depends: files, software, plug-ins, and processor.

They show whether an earlier result can be reused, and whether two results can be compared.
"""

import hashlib
import importlib
import importlib.util
import json
import math
import platform
from collections.abc import Iterable, Iterator, Mapping
from functools import cache, lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path, PurePath
from typing import Any, NamedTuple

from simscen.core.geometry import Array
from simscen.core.version import PACKAGE
from simscen.loading.loaded import LoadedMap, LoadedScenario
from simscen.loading.plugins import plugins_of
from simscen.loading.yaml.library import DEFAULTS_FILE
from simscen.model.stack_base import StackBase
from simscen.spec.registry import RegisteredType

PACKAGES = (
    *("simscen", "pybullet", "ompl", "filterpy", "numpy", "scipy", "embreex", "trimesh", "mapbox-earcut", "pycollada"),
    *("pillow", "mcap", "zstandard", "pydantic", "pyyaml"),
)
"""Python packages that affect the results or the log of a run."""
_RELEVANT_CPU_FLAGS = frozenset({"fma", "avx", "avx2", "avx512f", "sse4_2"})
"""Instruction sets that affect the last bits of results."""


def software_versions() -> dict[str, str]:
    """Return the versions of Python and all packages that affect results; "" for a missing package."""
    return {"python": platform.python_version(), **{name: _version(name) for name in PACKAGES}}


def cpu_flags() -> list[str]:
    """Return the instruction sets of this machine that affect results; empty if /proc/cpuinfo cannot be read."""
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
        for function in (_times_transpose, np.linalg.inv, np.linalg.cholesky)
    ]
    return {
        "blas": hashlib.sha256(b"".join(part.tobytes() for part in blas)).hexdigest()[:16],
        "libm": hashlib.sha256(repr(libm).encode()).hexdigest()[:16],
        "numpy": hashlib.sha256(b"".join(part.tobytes() for part in array_results)).hexdigest()[:16],
        "numpy_dispatch": " ".join(sorted(name for name, used in _numpy_features().items() if used)),
    }


def _times_transpose(matrix: Array) -> Array:
    """Return matrix · matrixᵀ."""
    product: Array = matrix @ matrix.T
    return product


def _numpy_features() -> dict[str, bool]:
    import numpy as np

    core = "numpy._core" if np.lib.NumpyVersion(np.__version__) >= "2.0.0" else "numpy.core"
    return dict(importlib.import_module(f"{core}._multiarray_umath").__cpu_features__)


@cache
def source_digest(*parts: str) -> str:
    """Return the SHA-256 of simscen's source files, or only of the subpackages and modules (`name.py`) in `parts`."""
    sha, folder = hashlib.sha256(), PACKAGE
    roots = [folder / part for part in parts or (".",)]
    files = [path for root in roots for path in ([root] if root.is_file() else root.rglob("*"))]
    for file in sorted(path for path in files if path.suffix in (".py", ".yaml", ".json")):
        sha.update(f"{file.relative_to(folder).as_posix()}\0".encode() + file.read_bytes())
    return sha.hexdigest()


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return ""


def plugin_packages(plugins: Iterable[RegisteredType]) -> dict[str, dict[str, object]]:
    """Return the `version` and the `used` entry points of each package with plug-ins, by package name."""
    found: dict[str, dict[str, object]] = {}
    for entry in plugins:
        package = found.setdefault(entry.distribution, {"version": entry.version, "used": []})
        used = package["used"]
        assert isinstance(used, list)
        used.append(f"{entry.group} {entry.name}")
    return found


def plugin_fingerprints(plugins: Iterable[RegisteredType]) -> dict[str, list[str]]:
    """Return the package, its version, the class, and the digest of all files of each plug-in, by "GROUP NAME"."""
    return {
        f"{entry.group} {entry.name}": [entry.distribution, entry.version, entry.value, _package_digest(entry.value)]
        for entry in plugins
    }


def _package_digest(class_path: str) -> str:
    """Return the SHA-256 of the files of the top-level package that contains a class ("module:Class")."""
    stats = ((name, file, file.stat()) for name, file in _package_files(class_path))
    return _digest_of_files(tuple((name, file, stat.st_mtime_ns, stat.st_size) for name, file, stat in stats))


@lru_cache(maxsize=64)
def _digest_of_files(files: tuple[tuple[str, Path, int, int], ...]) -> str:
    """Return the SHA-256 of files, each given as name, path, modification time in ns, and size in bytes. Cached."""
    sha = hashlib.sha256()
    for name, file, _, _ in files:
        _hash_file(sha, name, file.read_bytes())
    return sha.hexdigest()


def plugin_files(plugins: Iterable[RegisteredType]) -> list[Path]:
    """Return the files of the top-level packages that contain the plug-ins."""
    return [file for entry in plugins for _, file in _package_files(entry.value)]


def _package_files(class_path: str) -> Iterator[tuple[str, Path]]:
    """Yield name and path of each file of the top-level package that contains a class ("module:Class")."""
    found = importlib.util.find_spec(class_path.partition(":")[0])
    if found is None or found.origin is None:
        return
    file = Path(found.origin)
    folder = file.parent
    if not (folder / "__init__.py").is_file():
        yield file.name, file
        return
    while (folder.parent / "__init__.py").is_file():
        folder = folder.parent
    for path in sorted(folder.rglob("*")):
        if path.is_file() and "__pycache__" not in path.parts:
            yield path.relative_to(folder).as_posix(), path


class ScenarioDigests(NamedTuple):
    """SHA-256 digests of a scenario.

    Attributes:
        run: Digest of all files, options, versions, and processor features that affect a run, except the seed. A result
            is reused only if this digest is equal.
        definition: Digest of the world, robots, maps, and meshes, and of the scenario without the parameters of its
            stacks. Results of two stacks are compared only if this digest is equal.
    """

    run: str
    definition: str


def scenario_digests(loaded: LoadedScenario) -> ScenarioDigests:
    """Return the digests of a scenario. Raises OSError if a file cannot be read.

    `run` depends on the paths of files. `definition` depends neither on their folders nor on comments in the scenario.
    """
    texts = {name: text.encode() for name, text in sorted(loaded.sources.items())}
    files = {
        _portable_name(file, loaded): file.read_bytes()
        for file in sorted({*referenced_files(loaded), *loaded.read_files})
    }
    run = hashlib.sha256(json.dumps(_run_inputs(loaded), sort_keys=True).encode())
    for name, data in (*texts.items(), *files.items()):
        _hash_file(run, name, data)
    defining = {name: data for name, data in texts.items() if name.endswith(DEFINING_SUFFIXES)} | files
    # Only the names of files, because the shipped robots are installed elsewhere on another machine.
    contents = sorted((PurePath(name).name, hashlib.sha256(data).hexdigest()) for name, data in defining.items())
    definition = json.dumps([_definition(loaded), contents], sort_keys=True, default=str)
    return ScenarioDigests(run.hexdigest(), hashlib.sha256(definition.encode()).hexdigest())


def _definition(loaded: LoadedScenario) -> dict[str, Any]:
    """Return the scenario without the parameters of its stacks."""
    plain = _without_stack_parameters(loaded.tree.plain)
    if isinstance(robots := plain.get("robots"), Mapping):
        plain["robots"] = {
            name: _without_stack_parameters(robot) if isinstance(robot, Mapping) else robot
            for name, robot in robots.items()
        }
    return plain


def _without_stack_parameters(entry: Mapping[str, Any]) -> dict[str, Any]:
    """Return a scenario or robot without `extends`, and with only the common parameters of its stack.

    These are the parameters that all types of stacks have, except `controller_frequency`.
    """
    stack = entry.get("stack")
    keys = StackBase.model_fields.keys() - {"controller_frequency"}
    common = {key: stack[key] for key in sorted(keys) if key in stack} if isinstance(stack, Mapping) else {}
    return {**{key: value for key, value in entry.items() if key not in ("stack", "extends")}, "stack": common}


DEFINING_SUFFIXES = (".world.yaml", ".robot.yaml", ".sdf", ".world")
"""Suffixes of the text files (worlds and robots) that are part of the digest `definition`."""


def _run_inputs(loaded: LoadedScenario) -> dict[str, object]:
    """Return everything that affects a run, except files and the seed."""
    return {
        "versions": software_versions(),
        "code": source_digest(),
        "machine": platform.machine(),
        "cpu_flags": cpu_flags(),
        "arithmetic": arithmetic_fingerprints(),
        "lenient": loaded.lenient,
        "plugins": plugin_fingerprints(plugins_of(loaded)),
        **({"scenario": loaded.tree.plain} if loaded.variation else {}),
        **_chosen_stacks(loaded),
    }


def _chosen_stacks(loaded: LoadedScenario) -> dict[str, object]:
    """Return the stacks that were chosen on the command line or in the user's configuration, by robot."""
    return {
        **({} if loaded.choice is None else {"stack": loaded.tree.plain.get("stack")}),
        **({} if loaded.external_command is None else {"runs": loaded.external_command.digest}),
        **({"robots": {name: _chosen_stacks(view) for name, view in loaded.robots.items()}} if loaded.robots else {}),
    }


def referenced_files(loaded: LoadedScenario) -> list[Path]:
    """Return the map images, SDF files, and URDF files of a scenario."""
    views = list(loaded.robot_views.values())
    maps = [loaded.world.map, *(view.map for view in views if view.map != "none")]
    return [
        *(found.image for found in maps if isinstance(found, LoadedMap)),
        *(file for file in (loaded.world.sdf, *(view.robot.urdf for view in views)) if file),
    ]


def _portable_name(file: Path, loaded: LoadedScenario) -> str:
    """Return the path of a file relative to the scenario's root folder; the absolute path of a file outside of it."""
    return file.relative_to(loaded.root).as_posix() if file.is_relative_to(loaded.root) else str(file)


def _hash_file(sha: "hashlib._Hash", name: str, data: bytes) -> None:
    sha.update(f"{name}\0{len(data)}\0".encode())
    sha.update(data)


def scenario_files(loaded: LoadedScenario) -> set[Path]:
    """Return all files that a scenario depends on, including programs of external stacks and plug-ins.

    Includes `defaults.yaml` next to the scenario even if it does not exist.
    """
    choice = loaded.choice
    programs = [
        part
        for view in loaded.robot_views.values()
        if view.external_command is not None
        for part in _files_in_command(view)
    ]
    return {
        loaded.file,
        loaded.file.with_name(DEFAULTS_FILE),
        *loaded.files.values(),
        *loaded.read_files,
        *referenced_files(loaded),
        *plugin_files(plugins_of(loaded)),
        *(() if choice is None else choice.files.values()),
        *programs,
    }


def _files_in_command(loaded: LoadedScenario) -> list[Path]:
    """Return the files among the arguments of an external stack's command."""
    assert loaded.external_command is not None
    paths = [Path(loaded.external_command.cwd, argument) for argument in loaded.external_command.argv]
    return [path for path in paths if path.is_file()]
