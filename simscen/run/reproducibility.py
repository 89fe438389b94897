"""Digests of the files, plug-ins, and software on which the results of a scenario depend.

The digests show whether an earlier result can be reused, and whether two results can be compared.
"""

import hashlib
import importlib.util
import json
import platform
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from pathlib import Path, PurePath
from typing import Any, NamedTuple

from simscen.loading.loaded import LoadedMap, LoadedScenario
from simscen.loading.plugins import plugins_of
from simscen.loading.yaml.library import DEFAULTS_FILE
from simscen.model.stack_base import StackBase
from simscen.run.platform_fingerprint import arithmetic_fingerprints, cpu_flags, software_versions, source_digest
from simscen.spec.registry import RegisteredType


def plugin_packages(plugins: Sequence[RegisteredType]) -> dict[str, dict[str, object]]:
    """Return the `version` and the `used` entry points of each package with plug-ins, by package name."""
    return {
        plugin.distribution: {
            "version": plugin.version,
            "used": [f"{entry.group} {entry.name}" for entry in plugins if entry.distribution == plugin.distribution],
        }
        for plugin in plugins
    }


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


def _package_files(class_path: str) -> Iterator[tuple[str, Path]]:
    """Yield name and path of each file of the top-level package that contains a class ("module:Class")."""
    spec = importlib.util.find_spec(class_path.partition(":")[0])
    if spec is None or spec.origin is None:
        return
    file = Path(spec.origin)
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

    `run` depends on the paths of files. `definition` depends neither on the folders of files nor on comments.
    """
    texts = {name: text.encode() for name, text in sorted(loaded.sources.items())}
    root = loaded.root
    files = {
        file.relative_to(root).as_posix() if file.is_relative_to(root) else str(file): file.read_bytes()
        for file in sorted({*referenced_files(loaded), *loaded.read_files})
    }
    run = hashlib.sha256(json.dumps(_run_inputs(loaded), sort_keys=True).encode())
    for name, data in (*texts.items(), *files.items()):
        _hash_file(run, name, data)
    definition_texts = {name: data for name, data in texts.items() if name.endswith(DEFINITION_SUFFIXES)}
    # Only the names of files, because the shipped robots are installed elsewhere on another machine.
    contents = sorted(
        (PurePath(name).name, hashlib.sha256(data).hexdigest()) for name, data in (definition_texts | files).items()
    )
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


DEFINITION_SUFFIXES = (".world.yaml", ".robot.yaml", ".sdf", ".world")
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
    maps = [loaded.world.map, *(view.map for view in views)]
    return [
        *(robot_map.image for robot_map in maps if isinstance(robot_map, LoadedMap)),
        *(file for file in (loaded.world.sdf, *(view.robot.urdf for view in views)) if file),
    ]


def _hash_file(sha: "hashlib._Hash", name: str, data: bytes) -> None:
    sha.update(f"{name}\0{len(data)}\0".encode())
    sha.update(data)


def scenario_files(loaded: LoadedScenario) -> set[Path]:
    """Return all files that a scenario depends on, including programs of external stacks and plug-ins.

    Includes `defaults.yaml` next to the scenario even if it does not exist.
    """
    choice = loaded.choice
    commands = [view.external_command for view in loaded.robot_views.values()]
    programs = [Path(command.cwd, argument) for command in commands if command is not None for argument in command.argv]
    return {
        loaded.file,
        loaded.file.with_name(DEFAULTS_FILE),
        *loaded.files.values(),
        *loaded.read_files,
        *referenced_files(loaded),
        *(file for entry in plugins_of(loaded) for _, file in _package_files(entry.value)),
        *(() if choice is None else choice.files.values()),
        *(path for path in programs if path.is_file()),
    }
