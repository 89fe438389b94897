"""Unmet requirements of the installation are reported before any run."""

import importlib.metadata
import re
import sys
from pathlib import Path

import pytest
import typer

from simscen.cli import requirements
from simscen.cli.start import start

PYPROJECT = (Path(__file__).parents[3] / "pyproject.toml").read_text()


@pytest.fixture
def installed(monkeypatch):
    """Return a function that fakes installed package versions and the requirements of simscen."""

    def installed(requirement_texts, **versions):
        def version(name):
            if name not in versions:
                raise importlib.metadata.PackageNotFoundError(name)
            return versions[name]

        monkeypatch.setattr(importlib.metadata, "requires", lambda _: requirement_texts)
        monkeypatch.setattr(importlib.metadata, "version", version)

    return installed


def test_this_installation_meets_its_requirements() -> None:
    assert requirements.unmet_requirements() == []
    assert requirements.unmet_typer() == []


@pytest.mark.parametrize(
    ("requirement", "version", "is_met"),
    [
        ("numpy<3,>=1.26", "1.26", True),
        ("numpy<3,>=1.26", "1.26.0", True),
        ("numpy<3,>=1.26", "2.4.6", True),
        ("numpy<3,>=1.26", "1.25.9", False),
        ("numpy<3,>=1.26", "3.0", False),
        ("numpy<3,>=1.26", "3.0rc1", False),
        ("numpy>=2.17.7.post6", "2.17.7", False),
        ("numpy>=2.17.7.post6", "2.17.7.post6", True),
        ("numpy!=1.5,>=1", "1.5", False),
        ("numpy (>=1.26)", "1.27+local", True),
        ("numpy", "0", True),
        ('numpy>=9; extra == "more"', "1", True),
    ],
)
def test_versions_are_compared(installed, requirement, version, is_met) -> None:
    installed([requirement], numpy=version)
    assert (requirements.unmet_requirements() == []) is is_met


def test_unmet_requirements_have_a_hint(installed) -> None:
    installed(["typer<1,>=0.20", "ompl>=2"], typer="0.12.5")
    assert requirements.unmet_requirements() == [
        "typer 0.12.5 is installed, but simscen needs typer>=0.20,<1: pip install 'typer>=0.20,<1'",
        "ompl is not installed: pip install 'ompl'",
    ]


def test_run_does_not_start_with_unmet_requirements(installed, monkeypatch, capsys) -> None:
    installed(["pybullet>=3.2.7"], pybullet="3.2.6")
    monkeypatch.setattr(sys, "argv", ["simscen", "run", "nothing"])
    with pytest.raises(SystemExit) as end:
        start()
    assert end.value.code == 3
    assert capsys.readouterr().err == (
        "simscen: this installation does not work: pybullet 3.2.6 is installed, but simscen needs pybullet>=3.2.7: "
        "pip install 'pybullet>=3.2.7'\n"
    )


@pytest.mark.parametrize("command", ["validate", "doctor", "--version"])
def test_unsupported_typer_stops_every_command(monkeypatch, capsys, command) -> None:
    monkeypatch.setattr(typer, "__version__", "0.12.5")
    monkeypatch.setattr(sys, "argv", ["simscen", command])
    with pytest.raises(SystemExit) as end:
        start()
    assert end.value.code == 3
    assert "typer 0.12.5 is installed, but simscen needs typer>=0.20" in capsys.readouterr().err


def test_minimum_typer_matches_pyproject() -> None:
    (oldest,) = re.findall(r'"typer>=([\d.]+),', PYPROJECT)
    assert tuple(map(int, oldest.split("."))) == requirements.MIN_TYPER


def test_every_dependency_has_readable_bounds() -> None:
    block = PYPROJECT.split("dependencies = [", 1)[1].split("\n]", 1)[0]
    for line in re.findall(r'"([^"]+)"', block):
        assert re.fullmatch(r"[\w-]+>=[\w.]+(,<\d+)?", line), line
