"""Tests of action.yml: run its steps like the GitHub runner, in the checkout of another repository."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from composite import Composite

ROOT = Path(__file__).parents[2]
BIN = Path(sys.executable).parent
ROOM = """\
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]}
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 5, y: 3}}]
time_limit: 0.5 s
pass: [{collisions: {max: 0}}]
"""
PYTHON = """\
#!/bin/sh
{python} "$@" || exit
if [ "$2" = venv ]; then printf '{packages}\\n' > "$(echo "$3"/lib/python*/site-packages)/packages.pth"; fi
"""
PACKAGES = [path for path in sys.path if path.endswith("site-packages")]
FAILING = ROOM.replace("collisions: {max: 0}", "clearance: {min: 2}")


@pytest.fixture(scope="module")
def clone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Copy the files that `uses: simscen/simscen@main` installs; return the folder."""
    folder = tmp_path_factory.mktemp("actions") / "simscen"
    folder.mkdir()
    for name in ("action.yml", "pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, folder / name)
    shutil.copytree(ROOT / "simscen", folder / "simscen", ignore=shutil.ignore_patterns("__pycache__"))
    return folder


@pytest.fixture
def action(clone: Path, tmp_path: Path):
    """Return a function that runs the action in a checkout with a scenario that passes and one that fails.

    Nothing is downloaded: virtual environments of the runner's Python get the packages of this one.
    """
    workspace, temp, server = (tmp_path / name for name in ("work", "temp", "server"))
    (workspace / "scenarios").mkdir(parents=True)
    (workspace / "scenarios/good.scenario.yaml").write_text(ROOM)
    (workspace / "scenarios/a bad one.scenario.yaml").write_text(FAILING)
    temp.mkdir()
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin/python").write_text(PYTHON.format(python=sys.executable, packages="\\n".join(PACKAGES)))
    (tmp_path / "bin/python").chmod(0o755)
    subprocess.run(["git", "init", "--quiet", "--bare", str(server / "team/robot")], check=True)
    environ = {
        "HOME": str(tmp_path), "PATH": f"{tmp_path / 'bin'}:{os.environ['PATH']}", "CI": "true",
        "PIP_NO_INDEX": "1", "PIP_NO_DEPS": "1", "PIP_NO_BUILD_ISOLATION": "0", "PIP_CACHE_DIR": str(temp / "pip"),
        "GITHUB_WORKSPACE": str(workspace), "RUNNER_TEMP": str(temp), "GITHUB_RUN_ID": "41", "GITHUB_RUN_ATTEMPT": "2",
        "GITHUB_JOB": "scenarios", "GITHUB_SERVER_URL": f"file://{server}", "GITHUB_REPOSITORY": "team/robot",
        "LANG": "C.UTF-8",
    }  # fmt: skip
    return lambda **inputs: Composite(clone, workspace, temp, environ).run(**inputs)


@pytest.mark.slow
def test_failure_gets_annotation_summary_picture_and_artifact(action, tmp_path: Path) -> None:
    ran = action(**{"pictures-branch": "pictures", "arguments": '-k "good or bad" -j 1'})
    assert ran.failed and ran.outcomes.pop("run") == "failure", ran.printed
    assert set(ran.outcomes.values()) == {"success"}, ran.printed
    assert ran.outputs["exit-code"] == "1"
    assert re.search(r"^::error file=scenarios/a bad one.scenario.yaml,line=6,", ran.printed, re.MULTILINE)
    assert ran.summary.startswith("### simscen: 1 passed, 1 failed, 0 errors\n")
    assert "[Logs, pictures and pages](https://example.org/artifact)" in ran.summary
    (address,) = re.findall(r"!\[map of the run\]\((.*)\)", ran.summary)
    place = "41-2-scenarios/runs/scenarios/a bad one/seed-1/map.png"
    server = tmp_path / "server/team/robot"
    assert address == f"file://{server}/raw/pictures/{place.replace(' ', '%20')}"
    pushed = subprocess.run(["git", "-C", str(server), "show", f"pictures:{place}"], capture_output=True, check=True)
    assert pushed.stdout.startswith(b"\x89PNG")
    upload = ran.used["actions/upload-artifact@v4"]
    assert upload == {
        "name": "simscen", "path": "simscen-out/github", "retention-days": "0", "if-no-files-found": "ignore"
    }  # fmt: skip
    assert (tmp_path / "work" / upload["path"] / "junit.xml").is_file()
    cache = ran.used["actions/cache@v4"]
    assert cache["path"] == str(tmp_path / "temp/pip")
    assert re.fullmatch(r"simscen-Linux-X64-3.11-[0-9a-f]{16}", cache["key"])
    assert "secret-token" not in ran.printed + ran.summary


@pytest.mark.slow
def test_invalid_file_fails_the_job_without_reports(action, tmp_path: Path) -> None:
    (tmp_path / "work/scenarios/wrong.scenario.yaml").write_text(ROOM.replace("goals", "gaols"))
    ran = action(artifact="")
    assert ran.outputs["exit-code"] == "2"
    assert "wrong.scenario.yaml:4:1: error[SC012]" in ran.printed
    assert "actions/upload-artifact@v4" not in ran.used
    assert ran.outcomes["reports"] == "success"


def test_actionlint_accepts_action_workflows_and_guide(tmp_path: Path) -> None:
    (tmp_path / ".github/workflows").mkdir(parents=True)
    shutil.copy(ROOT / "action.yml", tmp_path)
    workflows = sorted((ROOT / ".github/workflows").glob("*.yml"))
    for file in workflows:
        shutil.copy(file, tmp_path / ".github/workflows")
    for number, block in enumerate(workflows_in_the_guide()):
        text = block.replace("uses: simscen/simscen@main", "uses: ./")
        assert text != block or "simscen/simscen" not in block
        (tmp_path / f".github/workflows/shown-{number}.yml").write_text(text)
    (tmp_path / ".github/workflows/steps.yml").write_text(yaml.safe_dump(as_workflow()))
    subprocess.run(["git", "init", "--quiet", str(tmp_path)], check=True)
    command = [str(BIN / "actionlint"), "-oneline", "-no-color"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout + done.stderr) == (0, "")


def as_workflow() -> dict[str, object]:
    """Return a workflow with the steps of the action, because actionlint does not check steps in action.yml."""
    action = yaml.safe_load((ROOT / "action.yml").read_text())
    inputs = {name: {"type": "string", "default": one["default"]} for name, one in action["inputs"].items()}
    job = {"runs-on": "ubuntu-latest", "steps": action["runs"]["steps"]}
    return {"on": {"workflow_call": {"inputs": inputs}}, "jobs": {"steps": job}}


def workflows_in_the_guide() -> list[str]:
    """Return the complete workflows in the guide."""
    text = (ROOT / "docs/guides/github-actions.md").read_text()
    found = [block for block in re.findall(r"^```yaml\n(.*?)^```", text, re.MULTILINE | re.DOTALL) if "jobs:" in block]
    assert found
    return found


def test_the_guide_lists_every_input_and_output() -> None:
    action = yaml.safe_load((ROOT / "action.yml").read_text())
    rows = re.findall(r"^\| `([\w-]+)` \|", (ROOT / "docs/guides/github-actions.md").read_text(), re.MULTILINE)
    assert rows == [*action["inputs"], *action["outputs"]]
