"""Every file that a scenario's runs depend on, for whoever waits until one of them is saved."""

from pathlib import Path

from simscen.loading.loaded import LoadedScenario
from simscen.loading.plugins import plugins_of
from simscen.loading.yaml.library import DEFAULTS_FILE
from simscen.run.digest import named_files
from simscen.run.plugincode import files_of as plugin_files


def files_of(loaded: LoadedScenario) -> set[Path]:
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
        *named_files(loaded),
        *plugin_files(plugins_of(loaded)),
        *(() if choice is None else choice.files.values()),
        *programs,
    }


def _program(loaded: LoadedScenario) -> list[Path]:
    """The files among the words of an external stack's command."""
    assert loaded.runs is not None
    words = [Path(loaded.runs.cwd, word) for word in loaded.runs.argv]
    return [word for word in words if word.is_file()]
