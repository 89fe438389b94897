"""Tests of killing the child processes of a run."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from simscen.ros2.launch import descendants

NAME = 9 * "\u00df"
"""Name of a program: 18 bytes in UTF-8. The kernel keeps 15 bytes, which end within a character."""
KILL = """
import subprocess, sys
from simscen.run.process.isolation import kill_children_except
child = subprocess.Popen([sys.argv[1], "60"])
kill_children_except(())
print(child.poll() is not None)
"""
KILL_AS_NOBODY = """
import os, subprocess
from simscen.run.process.isolation import kill_children_except
foreign = subprocess.Popen(["sleep", "5"])
os.setresuid(65534, 65534, 0)
own = subprocess.Popen(["sleep", "60"])
kill_children_except(())
completed = foreign.poll() is not None, own.poll() is not None
os.setresuid(0, 0, 0)
foreign.kill()
foreign.wait()
print(*completed)
"""
"""Starts a program as root, and then kills the children as another user."""


def copy_of_sleep(folder: Path) -> str:
    program = shutil.which("sleep")
    assert program is not None
    return shutil.copy(program, folder / NAME)


def test_children_with_a_name_that_is_cut_within_a_character_are_killed(tmp_path: Path) -> None:
    argv = [sys.executable, "-c", KILL, copy_of_sleep(tmp_path)]
    completed = subprocess.run(argv, capture_output=True, text=True, check=False)
    assert (completed.stdout, completed.stderr) == ("True\n", "")


@pytest.mark.skipif(os.getuid() != 0, reason="only root can start a program of another user without a password")
def test_a_child_of_another_user_does_not_prevent_the_killing_of_others() -> None:
    completed = subprocess.run([sys.executable, "-c", KILL_AS_NOBODY], capture_output=True, text=True, check=False)
    assert (completed.stdout, completed.stderr) == ("False True\n", "")


def test_descendants_with_a_name_that_is_cut_within_a_character_are_found(tmp_path: Path) -> None:
    with subprocess.Popen([copy_of_sleep(tmp_path), "60"]) as child:
        try:
            assert descendants(child.pid) == []
        finally:
            child.kill()
