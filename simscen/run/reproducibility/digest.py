"""Digest of everything that the runs of a scenario depend on, and the files among it."""

import hashlib
import json
import platform
from pathlib import Path

from simscen.loading.loaded import LoadedMap, LoadedScenario
from simscen.loading.plugins import plugins_of
from simscen.loading.yaml.library import DEFAULTS_FILE
from simscen.run.reproducibility.environment import (
    arithmetic_fingerprints,
    cpu_flags,
    plugin_files,
    plugin_fingerprints,
    software_versions,
    source_digest,
)


def scenario_digest(loaded: LoadedScenario) -> str:
    """Return the SHA-256 of all files, options, versions, and processor features that affect a run.

    The files are the scenario with `extends`, `defaults.yaml`, world, map, and robot, and all files that these refer
    to, such as map images, SDF and URDF files, meshes, heightmaps, and xacro includes. Moving a file changes the
    digest, and so does a change of an installed package that the scenario uses. Raises OSError.
    """
    sha = hashlib.sha256(json.dumps(_circumstances(loaded), sort_keys=True).encode())
    for name, text in sorted(loaded.sources.items()):
        _take(sha, name, text.encode())
    for file in sorted({*referenced_files(loaded), *loaded.read}):
        _take(sha, _name(file, loaded), file.read_bytes())
    return sha.hexdigest()


def _circumstances(loaded: LoadedScenario) -> dict[str, object]:
    """Return everything besides files that affects a run. The seed is not included: it is part of the run's key."""
    return {
        "versions": software_versions(),
        "code": source_digest(),
        "machine": platform.machine(),
        "cpu_flags": cpu_flags(),
        "arithmetic": arithmetic_fingerprints(),
        "lenient": loaded.lenient,
        "plugins": plugin_fingerprints(plugins_of(loaded)),
        **({"scenario": loaded.tree.plain} if loaded.variation else {}),
        **_stacks(loaded),
    }


def _stacks(loaded: LoadedScenario) -> dict[str, object]:
    """Return stacks that were chosen on the command line or in the user's configuration."""
    return {
        **({} if loaded.choice is None else {"stack": loaded.tree.plain.get("stack")}),
        **({} if loaded.runs is None else {"runs": loaded.runs.digest}),
        **({"robots": {name: _stacks(view) for name, view in loaded.robots.items()}} if loaded.robots else {}),
    }


def referenced_files(loaded: LoadedScenario) -> list[Path]:
    """Return the map images, SDF files, and URDF files of a scenario."""
    views = list(loaded.each.values())
    maps = [loaded.world.map, *(view.map for view in views if view.map != "none")]
    return [
        *(found.image for found in maps if isinstance(found, LoadedMap)),
        *(file for file in (loaded.world.sdf, *(view.robot.urdf for view in views)) if file),
    ]


def _name(file: Path, loaded: LoadedScenario) -> str:
    """Return the path relative to the root, so that moving a whole project does not change the digest."""
    return file.relative_to(loaded.root).as_posix() if file.is_relative_to(loaded.root) else str(file)


def _take(sha: "hashlib._Hash", name: str, data: bytes) -> None:
    sha.update(f"{name}\0{len(data)}\0".encode())
    sha.update(data)


def scenario_files(loaded: LoadedScenario) -> set[Path]:
    """Return all files that a scenario depends on, including programs of external stacks and plug-ins.

    A `defaults.yaml` next to the scenario is included even if it does not exist yet.
    """
    choice = loaded.choice
    programs = [part for view in loaded.each.values() if view.runs is not None for part in _program(view)]
    return {
        loaded.file,
        loaded.file.with_name(DEFAULTS_FILE),
        *loaded.files.values(),
        *loaded.read,
        *referenced_files(loaded),
        *plugin_files(plugins_of(loaded)),
        *(() if choice is None else choice.files.values()),
        *programs,
    }


def _program(loaded: LoadedScenario) -> list[Path]:
    """Return the files among the arguments of an external stack's command."""
    assert loaded.runs is not None
    words = [Path(loaded.runs.cwd, word) for word in loaded.runs.argv]
    return [word for word in words if word.is_file()]
