"""Tests that the isolated fork server finds the installed packages."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from simscen.run.process.isolation import plugin_path
from simscen.spec.registry import RegisteredType, installed_types

ROOT = Path(__file__).parents[2]
ISOLATED = (
    f"import sys; sys.path.insert(0, {str(ROOT)!r});"
    "from simscen.run.process.isolation import apply_plugin_path; apply_plugin_path(sys.argv[1]);"
    "from simscen.spec.registry import installed_types;"
    "print([(entry.version, entry.load().__module__) for entry in installed_types('criterion')], sys.path.index({0!r}))"
)


def isolated(path: str, folder: Path) -> str:
    """Return the criteria and the index of `folder` in sys.path in an isolated process with this plugin path."""
    code = ISOLATED.replace("{0!r}", repr(str(folder)))
    done = subprocess.run([sys.executable, "-I", "-c", code, path], capture_output=True, text=True, check=False, env={})
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_package_folders_are_appended_to_the_path(yardwork) -> None:
    argument = plugin_path(installed_types("criterion"))
    found, index = isolated(argument, yardwork).rsplit(" ", 1)
    assert found == "[('1.2', 'yardwork.dwell')]"
    assert int(index) > 2


def test_user_site_packages_and_pth_files_are_found(tmp_path, packages) -> None:
    """Editable installations in the user's site-packages consist of .pth files."""
    from_home, source = tmp_path / "home", tmp_path / "source"
    install = packages.install  # type: ignore[attr-defined]
    text = "from simscen.core.records.verdict import Finding\nfrom simscen.criteria.base import Criterion\n"
    text += "from simscen.spec.base import Spec\n"
    text += "class Mine(Spec, Criterion):\n    def judge(self, trace, case): return []\n"
    install(source, "elsewhere", "0", {}, mine=text)
    install(from_home, "mine", "3.0", {"criterion": {"mine": "mine:Mine"}})
    (from_home / "mine.pth").write_text(f"{source}\n")
    used = [["mine", str(from_home)]]
    argument = json.dumps({"path": [str(from_home)], "user": str(from_home), "packages": used})
    assert isolated(argument, from_home).startswith("[('3.0', 'mine')]")


def test_validated_version_of_a_package_is_used(tmp_path, packages) -> None:
    install, old, new = packages.install, tmp_path / "old", tmp_path / "new"  # type: ignore[attr-defined]
    for folder, version in ((old, "1.0"), (new, "2.0")):
        text = (ROOT / "tests/plugins/yardwork/yardwork/dwell.py").read_text()
        install(folder, "yard", version, {"criterion": {"dwell": "dwell:Dwell"}}, dwell=text)
    argument = json.dumps({"path": [str(old), str(new)], "user": "", "packages": [["yard", str(new)]]})
    assert isolated(argument, new) == "[('2.0', 'dwell')] 0"


def test_working_folder_is_not_on_the_worker_path(yardwork, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [str(tmp_path), "", *sys.path])
    argument = plugin_path(
        [RegisteredType("criterion", "dwell", "yardwork.dwell:Dwell", "yardwork", "1.2", folder=str(yardwork))]
    )
    assert str(tmp_path) not in json.loads(argument)["path"]
    assert str(yardwork) in json.loads(argument)["path"]


@pytest.mark.slow
def test_pip_installs_the_same_files_as_the_fixture(tmp_path, yardwork) -> None:
    """The fixture `install_folder` writes the same files as pip."""
    call = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation", "--no-index"]
    folder, target = ROOT / "tests/plugins/yardwork", tmp_path / "target"
    done = subprocess.run([*call, "--target", str(target), str(folder)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    groups = ("criterion", "fault", "trigger", "action", "sensor", "metric")  # the others have types of simscen itself
    code = (
        "from simscen.spec.registry import installed_types;"
        f"print(*(e.value for g in {groups} for e in installed_types(g)))"
    )
    env = {**os.environ, "PYTHONPATH": f"{target}{os.pathsep}{ROOT}"}
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=env).stdout
    assert found.split() == [entry.value for group in groups for entry in installed_types(group)]
