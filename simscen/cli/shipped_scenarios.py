"""The scenarios that ship with simscen: beside its package in a checkout, within it where it is installed."""

from pathlib import Path

from simscen.core.version import PACKAGE

SUFFIX = ".scenario.yaml"
_PLACES = (PACKAGE / "data" / "library", PACKAGE.parent)


def shipped_scenarios() -> dict[str, Path]:
    """Name → file, e.g. "navigation/goal"; none where they were left out of the installation."""
    home = next((place / "scenarios" for place in _PLACES if (place / "scenarios").is_dir()), None)
    if home is None:
        return {}
    return {path.relative_to(home).as_posix().removesuffix(SUFFIX): path for path in sorted(home.rglob(f"*{SUFFIX}"))}
