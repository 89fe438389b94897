"""Packages that add to simscen, laid out as an installer leaves them, without installing anything."""

import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import pytest

from simscen.spec import choice, registry

Lay = Callable[..., Path]


def lay(site: Path, name: str, version: str, points: Mapping[str, Mapping[str, str]], **modules: str) -> Path:
    """Write modules and the package's dist-info into a folder: `points` are entry points by kind, then by name."""
    site.mkdir(parents=True, exist_ok=True)
    about = site / f"{name.replace('-', '_')}-{version}.dist-info"
    about.mkdir()
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    groups = [
        f"[simscen.{kind}]\n" + "".join(f"{key} = {value}\n" for key, value in those.items())
        for kind, those in points.items()
    ]
    (about / "entry_points.txt").write_text("\n".join(groups))
    for module, text in modules.items():
        (site / f"{module}.py").write_text(text)
    return site


def forget() -> None:
    """Let the next look for packages see what is there then."""
    for known in (registry._scanned, registry._loaded, choice.widened):
        known.cache_clear()


@pytest.fixture
def packages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Lay]:
    """`packages(name, version, points, module="…")` installs a package for this test, in a folder that it returns."""
    site, before = tmp_path / "site", set(sys.modules)
    site.mkdir()
    monkeypatch.syspath_prepend(str(site))
    forget()

    def add(name: str, version: str, points: Mapping[str, Mapping[str, str]], **modules: str) -> Path:
        forget()
        return lay(site, name, version, points, **modules)

    yield add
    for module in set(sys.modules) - before:
        if str(getattr(sys.modules[module], "__file__", "")).startswith(str(site)):
            del sys.modules[module]
    forget()
