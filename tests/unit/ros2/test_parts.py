"""Tests of the parts of the adapter that work without ROS: topic names, domains, messages, and launching."""

import ast
import os
import struct
import subprocess
import sys
import time
from pathlib import Path

import pytest

import simscen.ros2
from simscen.core.geometry.kinematics import Twist
from simscen.peer import messages as peer_messages
from simscen.peer.cdr import HEADER
from simscen.record.messages import message_templates
from simscen.ros2 import messages
from simscen.ros2.graph_names import TopicNames
from simscen.ros2.launch import LaunchedCommand
from simscen.ros2.options import AdapterError
from simscen.ros2.ros_domain import claim_domain, ros_environment, user_domain

FOLDER = Path(simscen.ros2.__file__).parent


@pytest.mark.parametrize("file", sorted(path.name for path in FOLDER.glob("*.py")))
def test_the_adapter_is_python_3_8_and_imports_only_itself_and_the_peer(file: str) -> None:
    tree = ast.parse((FOLDER / file).read_text(), feature_version=(3, 8))
    imported = {name.name for node in ast.walk(tree) if isinstance(node, ast.Import) for name in node.names}
    imported |= {node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    allowed = {"simscen.ros2", "simscen.peer", "rclpy"}
    foreign = {name for name in imported if name.partition(".")[0] not in sys.stdlib_module_names}
    assert all(any(name == root or name.startswith(root + ".") for root in allowed) for name in foreign), foreign


@pytest.mark.parametrize(
    ("namespace", "remappings", "topic", "name"),
    [
        ("", [], "/scan", "/scan"),
        ("robot1", [], "/scan", "/robot1/scan"),
        ("/robot1/", [], "/tf", "/robot1/tf"),
        ("robot1", [], "/clock", "/clock"),
        ("", ["/scan:=/front/scan"], "/scan", "/front/scan"),
        ("robot1", ["scan:=front/scan"], "/scan", "/robot1/front/scan"),
        ("robot1", ["/tf:=/tf"], "/tf", "/tf"),
    ],
)
def test_topics_are_moved_to_the_namespace_and_remapped_as_in_ros(
    namespace: str, remappings: list[str], topic: str, name: str
) -> None:
    assert TopicNames(namespace, remappings)(topic) == name


@pytest.mark.parametrize("text", ["/scan=/front", ":=/front", "/scan:="])
def test_an_invalid_remapping_is_an_error(text: str) -> None:
    with pytest.raises(AdapterError, match="not of the form /from:=/to"):
        TopicNames("", [text])


def test_two_runs_get_different_domains(tmp_path: Path) -> None:
    environment = {"XDG_RUNTIME_DIR": str(tmp_path)}
    first, second = claim_domain(None, environment), claim_domain(None, environment)
    assert (first.number, second.number) == (1, 2)
    first.release()
    assert claim_domain(None, environment).number == 1


def test_a_domain_in_use_cannot_be_claimed_by_number(tmp_path: Path) -> None:
    environment = {"XDG_RUNTIME_DIR": str(tmp_path)}
    held = claim_domain(42, environment)
    with pytest.raises(AdapterError, match=r"another run is using ROS domain 42: .* --jobs 1"):
        claim_domain(42, environment)
    with pytest.raises(AdapterError, match=r"another robot or run is using ROS domain 42: with several robots"):
        claim_domain(42, {**environment, "SIMSCEN_ROBOT": "b"})
    held.release()
    assert claim_domain(42, environment).number == 42


def test_the_lock_of_a_domain_ends_with_its_process(tmp_path: Path) -> None:
    code = (
        "import os; from simscen.ros2.ros_domain import claim_domain; "
        "held = claim_domain(7, os.environ); print(flush=True); input()"
    )
    environment = {**os.environ, "XDG_RUNTIME_DIR": str(tmp_path)}
    holder = subprocess.Popen(
        [sys.executable, "-c", code], env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    assert holder.stdout is not None
    holder.stdout.readline()
    with pytest.raises(AdapterError):
        claim_domain(7, environment)
    holder.kill()
    holder.wait()
    assert claim_domain(7, environment).number == 7


@pytest.mark.parametrize(("distro", "old"), [("humble", "1"), ("jazzy", None), ("", None)])
def test_discovery_is_restricted_to_this_machine_in_every_distribution(distro: str, old: str | None) -> None:
    expected = ros_environment(5, "/tmp/logs", {"ROS_DISTRO": distro, "ROS_LOCALHOST_ONLY": "0"})
    assert expected["ROS_DOMAIN_ID"] == "5"
    assert expected["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "LOCALHOST"
    assert expected.get("ROS_LOCALHOST_ONLY") == old


def test_a_stamped_twist_is_read_for_any_length_of_its_frame() -> None:
    numbers = (0.5, 0.0, 0.0, 0.0, 0.0, -0.25)
    for frame in ("", "b", "base_link", "base_footprint", "robot_1/base_link"):
        text = frame.encode() + b"\0"
        body = struct.pack("<iII", 12, 500_000_000, len(text)) + text
        stamped = HEADER + body + b"\0" * (-len(body) % 8) + struct.pack("<6d", *numbers)
        assert messages.read_twist(stamped, is_stamped=True) == numbers
        assert messages.read_header(stamped) == (12_500_000_000, frame)


def test_a_big_endian_twist_is_read() -> None:
    message = b"\0\0\0\0" + struct.pack(">6d", 1, 2, 3, 4, 5, 6)
    assert messages.read_twist(message, is_stamped=False) == (1, 2, 3, 4, 5, 6)


def test_a_twist_has_the_same_bytes_as_in_the_log() -> None:
    assert messages.write_twist((0.3, 0.1, 0, 0, 0, -0.7)) == message_templates.twist().packer()(Twist(0.3, 0.1, -0.7))


def _alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.sample(1)
@pytest.mark.parametrize("stubborn", [False, True])
def test_all_launched_processes_end_with_the_adapter(tmp_path: Path, stubborn: bool) -> None:
    """The process has its own session and no parent. A stubborn process also ignores SIGINT and SIGTERM."""
    pid_file = tmp_path / "pid"
    trap = "trap '' INT TERM; " if stubborn else ""
    command = f"setsid sh -c '{trap}echo $$ > {pid_file}; while :; do sleep 0.05; done' & sleep 600"
    if stubborn:
        command = f'setsid sh -c "{trap}echo \\$\\$ > {pid_file}; while :; do sleep 0.05; done" & sleep 600'
    launcher = subprocess.Popen([sys.executable, str(FOLDER / "launch.py"), command], stdin=subprocess.PIPE)
    while not pid_file.exists() or not pid_file.read_text():
        time.sleep(0.02)
    pid = int(pid_file.read_text())
    assert _alive(pid)
    assert launcher.stdin is not None
    launcher.stdin.close()
    launcher.wait(30)
    assert not _alive(pid)


def test_the_launcher_exits_with_the_code_of_its_command() -> None:
    for command, code in (("exit 3", 3), ("kill -9 $$", 137)):
        launcher = subprocess.Popen([sys.executable, str(FOLDER / "launch.py"), command], stdin=subprocess.PIPE)
        assert launcher.wait(30) == code


@pytest.mark.parametrize(
    ("command", "reason"),
    [
        ("exit 255", "ended with exit code 255"),
        ("exit 3", "ended with exit code 3"),
        ("kill -9 $$", "ended by signal 9"),
    ],
)
def test_the_reason_for_the_end_of_a_command_is_its_exit_code_or_signal(command: str, reason: str) -> None:
    launched = LaunchedCommand(command, os.environ)
    while (found := launched.end_reason) is None:
        time.sleep(0.02)
    launched.end()
    assert found == reason


def test_poses_are_composed() -> None:
    assert messages.compose((1.0, 2.0, 0.0), (0.5, 0.0, 0.1)) == pytest.approx((1.5, 2.0, 0.1))


def test_all_stamps_of_a_plan_and_of_transforms_are_shifted() -> None:
    poses = [(1.0, 2.0, 0.5), (3.0, 4.0, 0.0)]
    shifted = messages.shift_stamps("nav_msgs/msg/Path", peer_messages.path((5, 900_000_000), poses), 1_300_000_000)
    assert shifted == peer_messages.path((7, 200_000_000), poses)

    def transforms(first: tuple[int, int], second: tuple[int, int]) -> bytes:
        return peer_messages.transforms(
            [(first, "map", "odom", (1.0, 2.0, 0.5)), (second, "odom", "base_link", (0.0, 0.0, 0.0))]
        )

    type_name = "tf2_msgs/msg/TFMessage"
    assert messages.shift_stamps(type_name, transforms((3, 0), (4, 5)), -2 * 10**9) == transforms((1, 0), (2, 5))
    clamped = messages.shift_stamps(type_name, transforms((1, 0), (4, 5)), -2 * 10**9)
    assert clamped == transforms((0, 0), (2, 5)), "stamps do not become negative"


@pytest.mark.parametrize(("text", "number"), [("", 0), ("7", 7)])
def test_the_domain_of_the_user_is_ros_domain_id(text: str, number: int) -> None:
    assert user_domain({"ROS_DOMAIN_ID": text}) == number
    assert user_domain({}) == 0


@pytest.mark.parametrize("text", ["x", "-1", "1.5", "²"])
def test_a_domain_that_is_not_a_number_is_refused(text: str) -> None:
    with pytest.raises(AdapterError, match=r"ROS_DOMAIN_ID is '.*', not a number"):
        user_domain({"ROS_DOMAIN_ID": text})
