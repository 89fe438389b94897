"""Shell completion of arguments. Imports happen inside the functions, so that commands do not pay for them."""

from collections.abc import Iterator
from pathlib import Path

from simscen.core.version import PACKAGE


def scenarios(incomplete: str) -> list[str]:
    """Complete scenario files and folders."""
    from simscen.loading.files.discovery import SCENARIO_SUFFIXES

    return list(_files(incomplete, SCENARIO_SUFFIXES))


def logs(incomplete: str) -> list[str]:
    """Complete logs and folders."""
    return list(_files(incomplete, (".mcap",)))


def files(incomplete: str) -> list[str]:
    """Complete YAML files and folders."""
    return list(_files(incomplete, (".yaml", ".yml")))


def topics(incomplete: str) -> list[str]:
    """Complete topics of `explain`; after a name and a dot, the keys of that topic."""
    from simscen.cli.catalog.reference_topics import known_names

    names = known_names(keys="." in incomplete)
    return [name for name in names if name.startswith(incomplete)]


def shipped(incomplete: str) -> list[str]:
    """Complete ids of shipped scenarios and scenario files."""

    return [*(name for name in shipped_scenarios() if name.startswith(incomplete)), *scenarios(incomplete)]


def stacks(incomplete: str) -> list[str]:
    """Complete names of stacks: shipped, installed, and configured by the user."""
    from simscen.cli.process import config_file
    from simscen.core.errors import SimscenError
    from simscen.loading.stacks.userconfig import load_config
    from simscen.spec.registry import entries

    try:
        configured = list(load_config(config_file()).spec.stacks)
    except SimscenError:  # the command itself reports what is wrong with the file
        configured = []
    names = dict.fromkeys([*(entry.name for entry in entries("stack")), *configured])
    return [name for name in names if name.startswith(incomplete)]


def _files(incomplete: str, suffixes: tuple[str, ...]) -> Iterator[str]:
    """Yield folders, with a slash appended, and files with one of the suffixes."""
    parent, slash, start = incomplete.rpartition("/")
    folder = Path(parent + slash or ".").expanduser()
    try:
        found = sorted(folder.iterdir())
    except OSError:
        return
    for path in found:
        if path.name.startswith(start) and (start.startswith(".") or not path.name.startswith(".")):
            if path.is_dir():
                yield f"{parent}{slash}{path.name}/"
            elif path.name.endswith(suffixes):
                yield f"{parent}{slash}{path.name}"


SUFFIX = ".scenario.yaml"
_SHIPPED_ROOTS = (PACKAGE / "data" / "library", PACKAGE.parent)
"""Folders of the shipped scenarios: in an installed package, and in a checkout."""


def shipped_scenarios() -> dict[str, Path]:
    """Return the files by id, such as "navigation/goal"; empty if the installation does not contain them."""
    scenario_folder = next((root / "scenarios" for root in _SHIPPED_ROOTS if (root / "scenarios").is_dir()), None)
    if scenario_folder is None:
        return {}
    return {
        path.relative_to(scenario_folder).as_posix().removesuffix(SUFFIX): path
        for path in sorted(scenario_folder.rglob(f"*{SUFFIX}"))
    }
