"""Completion of command-line arguments in the shell.

Each completion function takes the text typed so far, and returns the values that start with it.
"""

from pathlib import Path

from simscen.cli.process import config_file
from simscen.core.files import expand_home
from simscen.core.version import PACKAGE


def scenarios(incomplete: str) -> list[str]:
    """Return paths of scenario files and folders."""
    from simscen.loading.files.discovery import SCENARIO_SUFFIXES

    return _files(incomplete, SCENARIO_SUFFIXES)


def logs(incomplete: str) -> list[str]:
    """Return paths of MCAP logs and folders."""
    return _files(incomplete, (".mcap",))


def yaml_files(incomplete: str) -> list[str]:
    """Return paths of YAML files and folders."""
    return _files(incomplete, (".yaml", ".yml"))


def topics(incomplete: str) -> list[str]:
    """Return names that `simscen explain` knows; if the text has a dot, paths of keys such as `goals.pose`."""
    from simscen.cli.catalog.topic_lookup import known_names

    return [name for name in known_names(keys="." in incomplete) if name.startswith(incomplete)]


def scenarios_to_copy(incomplete: str) -> list[str]:
    """Return IDs of shipped scenarios, and paths of scenario files and folders, for `simscen new --like`."""
    return [*(name for name in shipped_scenarios() if name.startswith(incomplete)), *scenarios(incomplete)]


def stacks(incomplete: str) -> list[str]:
    """Return the names of stacks that simscen, installed packages, and the user's configuration define."""
    from simscen.core.errors import SimscenError
    from simscen.loading.stacks.userconfig import load_config
    from simscen.spec.registry import all_types

    try:
        configured = list(load_config(config_file()).spec.stacks)
    except SimscenError:  # the command itself reports what is wrong with the file
        configured = []
    names = dict.fromkeys([*(entry.name for entry in all_types("stack")), *configured])
    return [name for name in names if name.startswith(incomplete)]


def _files(incomplete: str, suffixes: tuple[str, ...]) -> list[str]:
    """Return the matching folders, with a slash appended, and the matching files with one of the suffixes."""
    parent, slash, start = incomplete.rpartition("/")
    folder = expand_home(parent + slash or ".")
    try:
        names = [f"{path.name}/" if path.is_dir() else path.name for path in sorted(folder.iterdir())]
    except OSError:
        return []
    names = [name for name in names if name.startswith(start) and (start.startswith(".") or not name.startswith("."))]
    return [f"{parent}{slash}{name}" for name in names if name.endswith(("/", *suffixes))]


def shipped_scenarios() -> dict[str, Path]:
    """Return the files of the shipped scenarios by ID, such as "navigation/goal"; {} if none are shipped."""
    suffix = ".scenario.yaml"
    for root in (PACKAGE / "data" / "library", PACKAGE.parent):  # in an installed package, and in a clone
        if (folder := root / "scenarios").is_dir():
            files = sorted(folder.rglob(f"*{suffix}"))
            return {file.relative_to(folder).as_posix().removesuffix(suffix): file for file in files}
    return {}
