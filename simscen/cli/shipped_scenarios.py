"""Location of the shipped scenarios: beside the package in a checkout, inside the package when installed."""

from pathlib import Path

from simscen.core.version import PACKAGE

SUFFIX = ".scenario.yaml"
_PLACES = (PACKAGE / "data" / "library", PACKAGE.parent)


def shipped_scenarios() -> dict[str, Path]:
    """Return the files by id, such as "navigation/goal"; empty if the installation does not contain them."""
    home = next((place / "scenarios" for place in _PLACES if (place / "scenarios").is_dir()), None)
    if home is None:
        return {}
    return {path.relative_to(home).as_posix().removesuffix(SUFFIX): path for path in sorted(home.rglob(f"*{SUFFIX}"))}
