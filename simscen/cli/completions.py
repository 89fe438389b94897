"""What a shell offers behind Tab. Everything is imported when it is asked for: no command waits for it."""

from collections.abc import Iterator
from pathlib import Path


def scenarios(incomplete: str) -> list[str]:
    """Scenario files and folders, as far as one of them is written."""
    from simscen.loading.files.discovery import SCENARIO

    return list(_files(incomplete, SCENARIO))


def logs(incomplete: str) -> list[str]:
    """Logs and folders."""
    return list(_files(incomplete, (".mcap",)))


def files(incomplete: str) -> list[str]:
    """Whatever is checked: files of the language and folders."""
    return list(_files(incomplete, (".yaml", ".yml")))


def topics(incomplete: str) -> list[str]:
    """What `explain` knows; keys of a topic once its name and a dot are written."""
    from simscen.cli.catalog.reference_topics import known_names

    names = known_names(keys="." in incomplete)
    return [name for name in names if name.startswith(incomplete)]


def shipped(incomplete: str) -> list[str]:
    """The ids of shipped scenarios, and scenario files."""
    from simscen.cli.shipped_scenarios import shipped_scenarios

    return [*(name for name in shipped_scenarios() if name.startswith(incomplete)), *scenarios(incomplete)]


def stacks(incomplete: str) -> list[str]:
    """The names of stacks: simscen's own, those of packages, those of the user's configuration."""
    from simscen.cli.process import config_file
    from simscen.core.errors import SimscenError
    from simscen.loading.stacks.userconfig import load_config
    from simscen.spec.registry import entries

    try:
        own = list(load_config(config_file()).spec.stacks)
    except SimscenError:  # the command itself will say what is wrong with the file
        own = []
    names = dict.fromkeys([*(entry.name for entry in entries("stack")), *own])
    return [name for name in names if name.startswith(incomplete)]


def _files(incomplete: str, suffixes: tuple[str, ...]) -> Iterator[str]:
    """Folders with a slash behind them, and files with one of the suffixes, below the folder that is written."""
    written, slash, start = incomplete.rpartition("/")
    folder = Path(written + slash or ".").expanduser()
    try:
        found = sorted(folder.iterdir())
    except OSError:
        return
    for path in found:
        if path.name.startswith(start) and (start.startswith(".") or not path.name.startswith(".")):
            if path.is_dir():
                yield f"{written}{slash}{path.name}/"
            elif path.name.endswith(suffixes):
                yield f"{written}{slash}{path.name}"
