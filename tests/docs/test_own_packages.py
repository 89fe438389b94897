"""Tests of the tutorials on packages: their steps in order, in an empty folder."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

TUTORIALS = Path(__file__).parents[2] / "docs" / "tutorials"
PIP = ["-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation", "--no-index"]
PROGRAMS = {
    "simscen": ["-c", "import sys; from simscen.cli.start import start; sys.exit(start())"],
    # A working copy that was not installed anew knows the plug-in of pytest only by name.
    "pytest": ["-m", "pytest", "-p", "no:xdist", "-p", "no:simscen", "-p", "simscen.testing.plugin"],
}


@pytest.mark.slow
@pytest.mark.sample(1)
@pytest.mark.parametrize("page", ["own-criterion", "own-planner-and-stack"])
def test_every_step_of_the_tutorial_works(tmp_path: Path, page: str) -> None:
    shown_text = (TUTORIALS / f"{page}.md").read_text(encoding="utf-8")
    site, work = tmp_path / "site", tmp_path / "work"
    work.mkdir()
    for language, text in re.findall(r"^```(\w+)\n(.*?)^```", shown_text, re.MULTILINE | re.DOTALL):
        if language == "console":
            for command, shown in re.findall(r"^\$ (.*)\n((?:(?!\$ ).*\n)*)", text, re.MULTILINE):
                _check(command, shown, _done(command, work, site))
        else:
            file = work / text.partition("\n")[0].removeprefix("# ")
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text, encoding="utf-8")


def _done(command: str, work: Path, site: Path) -> str:
    """What a command prints. Packages are installed into a folder of their own, without asking the network."""
    program, *arguments = shlex.split(command)
    if program == "pip" and arguments[0] == "uninstall":
        shutil.rmtree(site)
        return ""
    call = [*PIP, "--target", str(site), *arguments[1:]] if program == "pip" else [*PROGRAMS[program], *arguments]
    env = {**os.environ, "PYTHONPATH": str(site), "COLUMNS": "100", "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(
        [sys.executable, *call],
        cwd=work,
        env=env,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    return done.stdout


def _check(command: str, shown: str, printed: str) -> None:
    """All of it is shown, line by line; `…` stands for whatever is there."""
    pattern = "".join(re.escape(part) if part != "…" else ".*?" for part in re.split("(…)", shown.strip()))
    assert re.fullmatch(pattern, printed.strip(), re.DOTALL) or not shown, f"$ {command}\n{printed}\nshown:\n{shown}"
