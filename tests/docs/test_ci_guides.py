"""Tests of hooks, pipelines, the action, and the Dockerfile against the schemas of their systems."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[2]
BIN = Path(sys.executable).parent
GUIDES = ROOT / "docs/guides"
GOOD = """\
simscen: 1
world: room.world.yaml
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 5, y: 3}}]
pass: [{collisions: {max: 0}}]
"""
WORLD = "simscen: 1\nwalls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]\n"


def blocks(page: str, language: str) -> list[str]:
    text = (GUIDES / page).read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    """Create a Git repository with a valid scenario."""
    subprocess.run(["git", "init", "--quiet", str(tmp_path)], check=True)
    (tmp_path / "scenarios").mkdir()
    (tmp_path / "scenarios/good.scenario.yaml").write_text(GOOD)
    (tmp_path / "scenarios/room.world.yaml").write_text(WORLD)
    return tmp_path


def pre_commit(folder: Path, *arguments: str) -> tuple[int, str]:
    environ = {**os.environ, "PRE_COMMIT_HOME": str(folder / ".home"), "PATH": f"{BIN}:{os.environ['PATH']}"}
    subprocess.run(["git", "-C", str(folder), "add", "scenarios", "*.yaml"], check=True)
    command = [str(BIN / "pre-commit"), *arguments]
    done = subprocess.run(command, cwd=folder, env=environ, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


def test_pre_commit_hooks_find_mistakes(repository: Path) -> None:
    manifest = ROOT / ".pre-commit-hooks.yaml"
    assert pre_commit(repository, "validate-manifest", str(manifest)) == (0, "")
    hooks = [{**hook, "language": "system"} for hook in yaml.safe_load(manifest.read_text())]
    config = repository / ".pre-commit-config.yaml"
    config.write_text(yaml.safe_dump({"repos": [{"repo": "local", "hooks": hooks}]}))
    code, output = pre_commit(repository, "run", "--all-files")
    assert (code, output.count("Passed")) == (0, 2), output
    (repository / "scenarios/room.world.yaml").write_text(WORLD.replace("walls", "wals"))
    code, output = pre_commit(repository, "run", "--all-files")
    assert (code, output.count("Failed")) == (1, 2), output
    assert "scenarios/room.world.yaml:2:1: error[SC012]" in output


def test_pre_commit_configurations_in_the_guide_are_valid(tmp_path: Path) -> None:
    for number, block in enumerate(blocks("pre-commit.md", "yaml")):
        (tmp_path / f"{number}.yaml").write_text(block)
    files = sorted(map(str, tmp_path.iterdir()))
    assert len(files) == 2
    done = subprocess.run(
        [BIN / "pre-commit", "validate-config", *files], capture_output=True, text=True, check=False, cwd=tmp_path
    )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize(
    ("schema", "page", "count"),
    [("vendor.gitlab-ci", "gitlab.md", 2), ("vendor.github-workflows", "github-actions.md", 4)],
)
def test_pipelines_in_the_guides_match_their_schemas(tmp_path: Path, schema: str, page: str, count: int) -> None:
    for number, block in enumerate(blocks(page, "yaml")):
        (tmp_path / f"{number}.yml").write_text(block)
    files = sorted(tmp_path.iterdir())
    assert len(files) == count
    _check_schema(schema, *files)


def test_the_action_fits_githubs_schema() -> None:
    _check_schema("vendor.github-actions", ROOT / "action.yml")


def _check_schema(schema: str, *files: Path) -> None:
    command = [BIN / "check-jsonschema", "--builtin-schema", schema, *files]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_jenkins_pipeline_has_balanced_brackets() -> None:
    (block,) = blocks("jenkins.md", "groovy")
    unquoted = re.sub(r"'[^']*'|\"[^\"]*\"", "", block)
    for opened, closed in ("{}", "()"):
        assert unquoted.count(opened) == unquoted.count(closed)
    assert {"agent", "options", "environment", "stages", "post"} <= set(re.findall(r"^  (\w+) ", block, re.MULTILINE))


def test_dockerfile_is_valid_and_copies_existing_files() -> None:
    done = subprocess.run([BIN / "hadolint", ROOT / "Dockerfile"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "")
    not_ignored = set(re.findall(r"^!(\S+)$", (ROOT / ".dockerignore").read_text(), re.MULTILINE))
    copied = [
        name
        for line in re.findall(r"^COPY (?!--)(.*) \S+$", (ROOT / "Dockerfile").read_text(), re.MULTILINE)
        for name in line.split()
    ]
    assert set(copied) == not_ignored
    assert all((ROOT / name).exists() for name in copied)


def test_docs_do_not_install_simscen_from_pypi() -> None:
    pages = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md"), *(ROOT / "simscen").rglob("*.py")]
    command = re.compile(r"pip3? install (?:-\S+ )*['\"]?simscen\b(?!/)")
    assert [str(page) for page in pages if command.search(page.read_text(encoding="utf-8"))] == []
