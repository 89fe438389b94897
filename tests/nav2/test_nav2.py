"""A real Nav2 with the parameters of nav2_bringup drives scenarios of the library, without a warm-up."""

import os
import shlex
import signal
import threading
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow
GOAL = "navigation/goal.scenario.yaml"


def processes(word: str) -> list[int]:
    """Return the processes whose command line contains `word`."""
    found = []
    for process in Path("/proc").iterdir():
        if process.name.isdigit() and int(process.name) != os.getpid():
            try:
                words = (process / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
            except OSError:
                continue
            if word in words:
                found.append(int(process.name))
    return sorted(found)


def test_nav2_reaches_a_goal_in_lockstep(run, nav2) -> None:
    ended = run(GOAL)
    assert ended.code == 0, ended.said
    about = ended.about
    assert about["goals"] == "/navigate_to_pose"
    assert {"/amcl", "/bt_navigator", "/controller_server", "/planner_server"} <= set(about["nodes"])
    assert "Traceback" not in ended.stack_log
    assert processes(str(nav2.params)) == []


def test_a_wrong_frame_is_named_with_its_node(run, nav2, tmp_path: Path) -> None:
    params = tmp_path / "nav2_params.yaml"
    params.write_text(nav2.params.read_text().replace("base_frame_id: base_footprint", "base_frame_id: base_fotprint"))
    ended = run(GOAL, "--ready", "10", launch=nav2.launch.replace(str(nav2.params), shlex.quote(str(params))))
    assert ended.code == 3
    assert "amcl: base_frame_id is 'base_fotprint'" in ended.said
    assert processes(str(params)) == []


def test_a_server_that_is_killed_during_the_run_is_named(run, nav2) -> None:
    """Kill the planner server some time after the controller server has its goal."""
    params = str(nav2.params)

    def kill() -> None:
        while not (found := processes(f"planner_server --ros-args --params-file {params}")):
            time.sleep(0.1)
        time.sleep(25)
        os.kill(found[0], signal.SIGKILL)

    threading.Thread(target=kill, daemon=True).start()
    ended = run(GOAL)
    assert ended.code == 3, ended.said
    assert "planner_server" in ended.said
    assert processes(params) == []
