"""Whether a scenario is still what it was: all that its runs depend on, as one number."""

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
    plugin_fingerprints,
    software_versions,
    source_digest,
)
from simscen.run.reproducibility.environment import plugin_files as plugin_files


def scenario_digest(loaded: LoadedScenario) -> str:
    """SHA-256 over the files that were read, the options that change a run, and what it is computed with.

    Files are those of the language (`extends`, `defaults.yaml`, world, map and robot) and those their content names:
    map images, SDF and URDF files, what these include, meshes, heightmaps, xacro's includes. A file that moves, or that
    another folder of --world-path now offers first, changes it too, and so does an installed package whose types the
    scenario uses. Raises OSError.
    """
    sha = hashlib.sha256(json.dumps(_circumstances(loaded), sort_keys=True).encode())
    for name, text in sorted(loaded.sources.items()):
        _take(sha, name, text.encode())
    for file in sorted({*referenced_files(loaded), *loaded.read}):
        _take(sha, _name(file, loaded), file.read_bytes())
    return sha.hexdigest()


def _circumstances(loaded: LoadedScenario) -> dict[str, object]:
    """What besides files decides how a run goes. The seed is part of a run's key."""
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
    """What drives otherwise than the files say, or what they do not say."""
    return {
        **({} if loaded.choice is None else {"stack": loaded.tree.plain.get("stack")}),
        **({} if loaded.runs is None else {"runs": loaded.runs.digest}),
        **({"robots": {name: _stacks(view) for name, view in loaded.robots.items()}} if loaded.robots else {}),
    }


def referenced_files(loaded: LoadedScenario) -> list[Path]:
    """Map images, SDF and URDF files."""
    views = list(loaded.each.values())
    maps = [loaded.world.map, *(view.map for view in views if view.map != "none")]
    return [
        *(found.image for found in maps if isinstance(found, LoadedMap)),
        *(file for file in (loaded.world.sdf, *(view.robot.urdf for view in views)) if file),
    ]


def _name(file: Path, loaded: LoadedScenario) -> str:
    """The file within the root, so that a project that is moved as a whole stays what it was."""
    return file.relative_to(loaded.root).as_posix() if file.is_relative_to(loaded.root) else str(file)


def _take(sha: "hashlib._Hash", name: str, data: bytes) -> None:
    sha.update(f"{name}\0{len(data)}\0".encode())
    sha.update(data)


# MERGED: Every file that a scenario's runs depend on, for whoever waits until one of them is saved.
def scenario_files(loaded: LoadedScenario) -> set[Path]:
    """Its own file and what it extends, world, map, meshes, robot, stack files, the programs of its stacks, plug-ins.

    A `defaults.yaml` that could stand beside it is among them, whether or not it is there.
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
    """The files among the words of an external stack's command."""
    assert loaded.runs is not None
    words = [Path(loaded.runs.cwd, word) for word in loaded.runs.argv]
    return [word for word in words if word.is_file()]
