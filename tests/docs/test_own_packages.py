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
    # Load the plug-in explicitly, because the entry points of an old installation may lack it.
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
                _check(command, shown, _run(command, work, site))
        else:
            file = work / text.partition("\n")[0].removeprefix("# ")
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text, encoding="utf-8")


def _run(command: str, work: Path, site: Path) -> str:
    """Run a command and return its output. Packages are installed into `site` without the network."""
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
    """Check that a command prints exactly the shown text; `…` matches any text."""
    pattern = "".join(re.escape(part) if part != "…" else ".*?" for part in re.split("(…)", shown.strip()))
    assert re.fullmatch(pattern, printed.strip(), re.DOTALL) or not shown, f"$ {command}\n{printed}\nshown:\n{shown}"
