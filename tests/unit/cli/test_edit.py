"""Tests of `simscen edit` as a process with its HTTP server."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[3]
SCENARIO = "simscen: 1\nworld: {simscen: 1}\nrobot: {pose: {x: 1, y: 1}}\ngoals: [{pose: {x: 3, y: 1}}]\n"
SDF = """\
<sdf version="1.7"><world name="yard"><model name="hut"><static>true</static><pose>3 0 0.5 0 0 0</pose>
<link name="l"><collision name="c"><geometry><box><size>1 1 1</size></box></geometry></collision></link></model>
<model name="far"><static>true</static><pose>-3 4 0.5 0 0 0</pose>
<link name="l"><collision name="c"><geometry><box><size>1 1 1</size></box></geometry></collision></link></model>
</world></sdf>
"""


@contextmanager
def editor(folder: Path, *arguments: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Start `simscen edit ARGUMENTS` in a folder; yield its process and the URL of its page."""
    command = [sys.executable, "-m", "simscen", "edit", *arguments, "--no-browser"]
    process = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None and process.stderr is not None
        line = process.stdout.readline()
        url = re.search(r"http://127\.0\.0\.1:\d+/[\w-]+/", line)
        assert url, line + process.stderr.read()
        yield process, url[0]
    finally:
        process.kill()
        process.communicate()


def ask(url: str, name: str, **data: Any) -> Any:
    """Return the answer of the server to the request `name`."""
    request = urllib.request.Request(
        f"{url}api/{name}", json.dumps(data).encode(), {"Content-Type": "application/json"}
    )
    with urllib.request.urlopen(request, timeout=30) as answer:
        return json.load(answer)


def test_editor_serves_the_page_until_ctrl_c_and_leaves_no_files(tmp_path: Path) -> None:
    (tmp_path / "a.scenario.yaml").write_text(SCENARIO)
    with editor(tmp_path, "a.scenario.yaml") as (process, url):
        with urllib.request.urlopen(url, timeout=30) as page:
            assert b"<canvas" in page.read()
        assert ask(url, "open")["text"] == SCENARIO
        process.send_signal(signal.SIGINT)
        assert process.communicate(timeout=30)[1] == ""
        assert process.returncode == 0
    assert [file.name for file in tmp_path.iterdir()] == ["a.scenario.yaml"]
    with pytest.raises(urllib.error.URLError):
        urllib.request.urlopen(url, timeout=5)


def test_a_browser_that_runs_in_the_terminal_gets_the_page(tmp_path: Path) -> None:
    (tmp_path / "a.scenario.yaml").write_text(SCENARIO)
    browser = tmp_path / "browser.py"
    browser.write_text(
        "import sys, urllib.request\n"
        "page = urllib.request.urlopen(sys.argv[1], timeout=5).read()\n"
        "open('page.tmp', 'wb').write(page)\n"
        "import os; os.rename('page.tmp', 'page.html')\n"
    )
    command = [sys.executable, "-m", "simscen", "edit", "a.scenario.yaml"]
    environment = {**os.environ, "BROWSER": f"{sys.executable} {browser} %s"}
    process = subprocess.Popen(command, cwd=tmp_path, env=environment, stdout=subprocess.DEVNULL)
    try:
        end = time.monotonic() + 30
        while not (tmp_path / "page.html").exists() and time.monotonic() < end:
            time.sleep(0.05)
        assert "<canvas" in (tmp_path / "page.html").read_text()
    finally:
        process.kill()
        process.wait()


@pytest.mark.sample(1)
@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129)])
def test_signal_ends_the_editor_and_deletes_the_files_of_its_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: signal.Signals, code: int
) -> None:
    (tmp_path / "a.scenario.yaml").write_text(SCENARIO)
    (tmp_path / "temporary").mkdir()
    monkeypatch.setenv("TMPDIR", str(tmp_path / "temporary"))
    with editor(tmp_path, "a.scenario.yaml") as (process, url):
        walls = "{simscen: 1, walls: [{points: [[0, 0], [9, 0], [9, 5], [0, 5], [0, 0]]}]}"
        ask(url, "run", text=SCENARIO.replace("{simscen: 1}", walls) + "pass: [{collisions: {max: 0}}]\n")
        process.send_signal(number)
        assert process.communicate(timeout=30)[1] == ""
        assert process.returncode == code
    assert not list((tmp_path / "temporary").glob("simscen-edit-*"))


@pytest.mark.sample(1)
@pytest.mark.parametrize("kind", ["ros map", "world", "sdf"])
def test_new_scenario_on_a_map_is_valid_and_has_a_reachable_goal(tmp_path: Path, kind: str) -> None:
    if kind == "ros map":
        for file in ("house_last_year.yaml", "house_last_year.pgm"):
            shutil.copy(ROOT / "worlds" / file, tmp_path)
        map_, world = "house_last_year.yaml", "world:\n  simscen: 1\n  map: house_last_year.yaml\n"
    elif kind == "world":
        shutil.copy(ROOT / "worlds" / "office.world.yaml", tmp_path)
        map_, world = "office.world.yaml", "world: office.world.yaml\n"
    else:
        (tmp_path / "yard.sdf").write_text(SDF)
        map_, world = "yard.sdf", "world:\n  simscen: 1\n  sdf: yard.sdf\n"
    name = f"{map_.split('.')[0]}.scenario.yaml"
    with editor(tmp_path, "--new", "--map", map_) as (_, url):
        opened = ask(url, "open")
        assert opened["is_new"] and opened["name"] == name and world in opened["text"]
        assert not (tmp_path / name).exists(), "the file is written only when the scenario is saved"
        errors = [
            problem
            for problem in ask(url, "problems", text=opened["text"])["problems"]
            if problem["severity"] == "error"
        ]
        assert errors == []
        (leg,) = ask(url, "preview", text=opened["text"], edits=[])["robots"]["robot"]["legs"]
        assert leg["length"] > 2
        ask(url, "save", text=opened["text"], version=opened["version"])
    assert (tmp_path / name).read_text() == opened["text"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "name the file to edit"),
        (("--new",), "--new and --map belong together"),
        (("a.scenario.yaml", "--map", "b.yaml"), "--new and --map belong together"),
        (("missing.scenario.yaml",), "missing.scenario.yaml: error[SC001]"),
        (("folder",), "not a regular file"),
        (("r.robot.yaml",), "is a robot file"),
        (("w.sdf",), "is a Gazebo world"),
        (("--new", "--map", "none.yaml"), "none.yaml: error[SC001]"),
        (("--new", "--map", "w.sdf", "a.scenario.yaml"), "already exists"),
        (("--new", "--map", "w.sdf", "a.yaml"), "a.scenario.yaml already exists"),
        (("--new", "--map", "w.sdf", "nowhere/a"), "nowhere is not a folder"),
        (("--root", "folder", "a.scenario.yaml"), "outside the scenario root"),
        (("a.scenario.yaml", "--stack", "unheard_of"), "cannot read --stack unheard_of"),
        (("w.world.yaml", "--stack", "reference"), "--stack has no effect on a world"),
    ],
)
def test_files_that_cannot_be_edited_are_errors_with_exit_code_2(
    simscen: Any, tmp_path: Path, arguments: tuple[str, ...], message: str
) -> None:
    (tmp_path / "a.scenario.yaml").write_text(SCENARIO)
    (tmp_path / "r.robot.yaml").write_text("simscen: 1\ndrive: {}\n")
    (tmp_path / "w.sdf").write_text(SDF)
    (tmp_path / "w.world.yaml").write_text("simscen: 1\n")
    (tmp_path / "folder").mkdir()
    result = simscen("edit", *arguments, "--no-browser")
    assert result.code == 2
    assert message in result.err and "Traceback" not in result.err


def test_binary_file_is_refused(simscen: Any, tmp_path: Path) -> None:
    (tmp_path / "a.scenario.yaml").write_bytes(b"\xff\xfe")
    result = simscen("edit", "a.scenario.yaml", "--no-browser")
    assert result.code == 2 and "not valid UTF-8" in result.err
