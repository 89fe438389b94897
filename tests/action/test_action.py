"""Tests of action.yml: run its steps like the GitHub runner, in the checkout of another repository."""

import json
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
    server = tmp_path / "server/team/robot"
    place = address.removeprefix(f"file://{server}/raw/pictures/").replace("%20", " ")
    assert re.fullmatch(r"41-2-scenarios-\w{8}/runs/scenarios/a bad one/seed-1/map.png", place)
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


def run_step(name: str, folder: Path, **variables: str) -> subprocess.CompletedProcess[str]:
    """Run the script of a step in a folder, with a command `simscen` that writes its arguments to the file `called`."""
    steps = yaml.safe_load((ROOT / "action.yml").read_text())["runs"]["steps"]
    (folder / "bin").mkdir()
    (folder / "bin/simscen").write_text('#!/bin/sh\nprintf "%s\\n" "$@" > called\n')
    (folder / "bin/simscen").chmod(0o755)
    environ = {
        "PATH": f"{folder / 'bin'}:{BIN}:{os.environ['PATH']}", "HOME": str(folder), "RUNNER_TEMP": str(folder),
        "GITHUB_OUTPUT": str(folder / "output"), "GITHUB_SERVER_URL": f"file://{folder}", **variables,
    }  # fmt: skip
    script = next(step["run"] for step in steps if step.get("id") == name)
    command = ["bash", "--noprofile", "--norc", "-e", "-o", "pipefail", "-c", script]
    return subprocess.run(command, cwd=folder, env=environ, capture_output=True, text=True, check=False)


def test_paths_and_arguments_are_split_as_by_a_shell(tmp_path: Path) -> None:
    done = run_step("run", tmp_path, PATHS="a\n'b c'", ARGUMENTS='-k "not slow"', OUT="out", BRANCH="")
    assert done.returncode == 0, done.stderr
    called = (tmp_path / "called").read_text().splitlines()
    assert called == ["run", "a", "b c", "-k", "not slow", "--format", "github", "--out", "out"]


@pytest.mark.parametrize("inputs", [{"PATHS": "a 'b", "ARGUMENTS": ""}, {"PATHS": "a", "ARGUMENTS": '-k "not slow'}])
def test_missing_quote_fails_the_step_before_anything_runs(tmp_path: Path, inputs: dict[str, str]) -> None:
    done = run_step("run", tmp_path, OUT="out", BRANCH="", **inputs)
    assert done.returncode != 0
    assert "unmatched" in done.stderr
    assert not (tmp_path / "called").exists()


def test_pictures_that_cannot_be_pushed_to_a_new_branch_are_reported(tmp_path: Path) -> None:
    subprocess.run(["git", "init", "--quiet", "--bare", str(tmp_path / "team/robot")], check=True)
    (tmp_path / "team/robot/hooks/pre-receive").write_text("#!/bin/sh\nexit 1\n")
    (tmp_path / "team/robot/hooks/pre-receive").chmod(0o755)
    (tmp_path / "map.png").touch()
    runs = [{"outcome": "failed", "artifacts": {"picture": "map.png"}}]
    (tmp_path / "results.json").write_text(json.dumps({"runs": runs}))
    repository = {"GITHUB_REPOSITORY": "team/robot", "TOKEN": "secret-token"}
    done = run_step("pictures", tmp_path, OUT=str(tmp_path), BRANCH="pictures", PLACE="41-2-job", **repository)
    assert "::warning::the pictures could not be pushed to pictures" in done.stdout, done.stderr


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
