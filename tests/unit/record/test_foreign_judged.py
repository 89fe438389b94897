"""Tests of `simscen judge` on logs of real robots: missing data never passes."""

import inspect
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from foreign_logs import (
    BEGIN,
    SECOND,
    SPEED,
    Message,
    drive,
    link,
    stamped_pose,
    statuses,
    write_bag,
    write_mcap,
)  # fmt: skip
from rosbags.rosbag2 import StoragePlugin

from simscen.cli.main import main
from simscen.core.geometry import Pose2
from simscen.core.messages.goals import Goal
from simscen.core.records.case import Case
from simscen.core.records.verdict import Evidence, LogCoverage, Status
from simscen.criteria.registry import AnyCriterion
from simscen.judge.evaluation import judge, required_evidence
from simscen.loading.yaml.parser import parse_yaml
from simscen.record.foreign.options import ForeignLogOptions
from simscen.record.foreign.read import read_foreign_log

STATUS = "/navigate_to_pose/_action/status"


class Completed(NamedTuple):
    """Result of a command."""

    code: int
    out: str
    err: str


@pytest.fixture
def simscen(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> Callable[..., Completed]:
    """Return a function that runs `simscen judge ARGUMENTS` in a fresh folder."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments: str) -> Completed:
        monkeypatch.setattr(sys, "argv", ["simscen", "judge", *arguments])
        with pytest.raises(SystemExit) as end:
            main()
        output = capsys.readouterr()
        return Completed(int(end.value.code or 0), output.out, output.err)

    return call


@pytest.fixture
def limits(tmp_path: Path) -> Callable[..., str]:
    """Return a function that writes a criteria file with the given criteria and further keys."""

    def write(*criteria: str, keys: str = "") -> str:
        (tmp_path / "limits.yaml").write_text(
            keys + "pass:\n" + "".join(f"  - {criterion}\n" for criterion in criteria)
        )
        return "limits.yaml"

    return write


def _examples() -> list[Any]:
    """Return the example of each criterion, from its docstring, as plain data."""
    examples = []
    for name, field in AnyCriterion.model_fields.items():
        if name in AnyCriterion.modifiers or name == "then":
            continue
        for component in field.metadata:
            if not hasattr(component, "load"):
                continue
            text = re.search(r"Example: `(.*)`$", inspect.getdoc(component.load()) or "", re.MULTILINE)
            assert text, name
            tree, problems = parse_yaml(text[1], name)
            assert tree is not None and not problems
            examples.append(pytest.param(tree.plain, id=name))
    return examples


@pytest.mark.parametrize("example", _examples())
def test_no_criterion_passes_without_its_evidence(tmp_path: Path, example: dict[str, Any]) -> None:
    """The log has the ground truth and goals, but lacks one kind of evidence."""
    entry = AnyCriterion.model_validate(example)
    goals = (Goal("shelf", Pose2(SPEED * 10, 0.0)),)
    case = Case(Pose2(0.0, 0.0), goals, {"shelf": SPEED * 10}, {"aisle": ((50, 50), (51, 50), (51, 51))})
    log = read_foreign_log(
        write_mcap(tmp_path / "a.mcap", drive()), ForeignLogOptions(truth="/mocap", goals=("shelf",))
    )
    assert required_evidence(entry), "a criterion needs evidence"
    for evidence in required_evidence(entry):
        (verdict,) = judge([entry], log.trace, case, LogCoverage({evidence: "taken away"}))
        assert verdict.status is Status.INCONCLUSIVE
        assert evidence.value in verdict.findings[0].measured
    (verdict,) = judge([entry], log.trace, case, log.coverage)
    assert verdict.status is not Status.ERROR
    assert verdict.status is Status.INCONCLUSIVE or not required_evidence(entry) & log.coverage.missing.keys()


def test_log_is_judged_with_a_criteria_file(simscen, limits, tmp_path: Path) -> None:
    write_mcap(tmp_path / "drive.mcap", drive())
    file = limits("speed: {max: 0.6 m/s}", "localization_error: {max: 0.1 m}", "path_length: {max: 6 m}")
    completed = simscen("drive.mcap", "--scenario", file, "--truth", "/mocap")
    assert (completed.code, completed.err) == (0, "")
    assert completed.out.startswith("  ✓ drive.mcap   10.1 s recorded   tightest: ")
    strict = simscen("drive.mcap", "--scenario", limits("speed: {max: 0.4 m/s}"), "--truth", "/mocap")
    assert strict.code == 1
    assert "speed: 0.50 m/s > 0.40 m/s, at t = " in strict.out
    assert "limits.yaml:2" in strict.out


def test_judging_a_log_imports_no_engine(limits, tmp_path: Path) -> None:
    write_mcap(tmp_path / "drive.mcap", drive())
    arguments = ["judge", "drive.mcap", "--scenario", limits("speed: {max: 0.6 m/s}"), "--truth", "/mocap"]
    code = (
        "import sys; from simscen.cli.main import main\n"
        f"sys.argv = ['simscen', *{arguments}]\n"
        "try: main()\n"
        "except SystemExit as end: assert not end.code, end.code\n"
        "print({'pybullet', 'ompl', 'filterpy'} & set(sys.modules))"
    )
    run = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=True, capture_output=True, text=True)
    assert run.stdout.splitlines()[-1] == "set()"


def test_filter_masks_of_a_criteria_file_are_used(simscen, limits, tmp_path: Path) -> None:
    write_mcap(tmp_path / "drive.mcap", drive())
    (tmp_path / "slow.pgm").write_bytes(b"P5\n20 2\n255\n" + b"\x1e" * 40)
    yaml = "image: slow.pgm\nmode: raw\nresolution: 1\norigin: [-5, -1, 0]\n"
    (tmp_path / "slow.yaml").write_text(f"{yaml}negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.25\n")
    file = limits("speed: {mask: {file: slow.yaml, type: absolute, multiplier: 0.01}}")
    completed = simscen("drive.mcap", "--scenario", file, "--truth", "/mocap")
    assert completed.code == 1
    assert "speed: 0.50 m/s > 0.35 m/s by slow.yaml (tolerance 0.05 m/s), at t = " in completed.out


def test_position_limits_need_a_ground_truth_in_the_map_frame() -> None:
    mask = {"file": "slow.yaml", "type": "absolute"}
    for limit in ({"max": 1.0, "in": "aisle"}, {"mask": mask}):
        assert Evidence.ALIGNMENT in required_evidence(AnyCriterion.model_validate({"speed": limit}))


def test_criteria_are_inconclusive_without_their_ground_truth(simscen, limits, tmp_path: Path) -> None:
    write_mcap(tmp_path / "drive.mcap", drive())
    file = limits("speed: {max: 9 m/s}", "collisions: {max: 9}", "replans: {max: 99}", "result: {status: SUCCEEDED}")
    completed = simscen("drive.mcap", "--scenario", file)
    assert completed.code == 1
    assert "speed: inconclusive: the log lacks the true pose of the robot and the true velocity" in completed.out
    assert "such as map:base_link, with --truth; topics with poses: /amcl_pose, /mocap, /odom" in completed.out
    assert "collisions: inconclusive: the log lacks the collisions of the robot" in completed.out
    assert completed.out.count("inconclusive") == 4


def test_tf_as_the_truth_needs_two_frames(simscen, limits, tmp_path: Path) -> None:
    write_mcap(tmp_path / "drive.mcap", [*drive(), Message("/tf", BEGIN, link(BEGIN, "map", "base_link", 0.0))])
    completed = simscen("drive.mcap", "--scenario", limits("speed: {max: 9 m/s}"), "--truth", "/tf")
    assert completed.code == 1
    assert "name two frames, such as map:base_link" in completed.out


def test_log_of_a_real_robot_needs_criteria(simscen, tmp_path: Path) -> None:
    write_mcap(tmp_path / "drive.mcap", drive())
    completed = simscen("drive.mcap")
    assert completed.code == 2
    assert "SC801" in completed.err and "--scenario" in completed.err


def test_a_folder_of_old_logs_gives_a_table_of_margins(simscen, limits, tmp_path: Path) -> None:
    (tmp_path / "old/monday").mkdir(parents=True)
    write_bag(tmp_path / "old/monday/bag", drive(), StoragePlugin.SQLITE3)
    write_mcap(tmp_path / "old/late.mcap", drive(off=0.15))
    write_mcap(tmp_path / "old/lost.mcap", [entry for entry in drive() if entry.topic != "/mocap"])
    (tmp_path / "old/broken.mcap").write_bytes(b"\x89MCAP0\r\n")
    file = limits("localization_error: {max: 0.1 m}", "{speed: {max: 0.6 m/s}, id: fast}")
    completed = simscen("old", "--scenario", file, "--truth", "/mocap")
    rows = [line.split() for line in completed.out.splitlines()]
    assert completed.code == 3
    assert rows[0] == ["log", "localization_error", "fast"]
    assert rows[1][:2] == ["!", "old/broken.mcap"]
    assert rows[2] == ["✗", "old/late.mcap", "-0.05", "m", "+0.10", "m/s"]
    assert rows[3] == ["✗", "old/lost.mcap", "?", "?"]
    assert rows[4] == ["✓", "old/monday/bag", "+0.05", "m", "+0.10", "m/s"]
    assert "? fast: the log lacks the true pose of the robot" in completed.out
    assert completed.out.splitlines()[-1] == "1 passed, 2 failed, 1 could not be judged"


def test_goals_are_judged_by_action_status_and_ground_truth(simscen, limits, tmp_path: Path) -> None:
    messages = [
        *drive(),
        Message(STATUS, BEGIN + SECOND, statuses((1, BEGIN + SECOND, 2))),
        Message(STATUS, BEGIN + 10 * SECOND, statuses((1, BEGIN + SECOND, 4))),
    ]
    write_mcap(tmp_path / "drive.mcap", messages)
    goals = "goals: [{name: shelf, pose: {x: 5, y: 0}, xy_tolerance: 0.3 m}]\n"
    file = limits("goals_reached: {}", "result: {status: SUCCEEDED}", "time_to_goal: {max: 10 s}", keys=goals)
    assert simscen("drive.mcap", "--scenario", file, "--truth", "/mocap").code == 0
    file = limits("goals_reached: {}", keys=goals.replace("x: 5", "x: 7"))
    assert "goal shelf: 2.0" in simscen("drive.mcap", "--scenario", file, "--truth", "/mocap").out
    file = limits("goals_reached: {}")
    assert "the log has 1 goal, the scenario 0 goals" in simscen("drive.mcap", "--scenario", file).out
    file = limits("goals_reached: {}", keys="goals: [{pose: shelf}]\n")
    completed = simscen("drive.mcap", "--scenario", file, "--truth", "/mocap")
    assert completed.code == 2
    assert completed.err.startswith("limits.yaml:1:16: error[SC030] no place of the world is called `shelf`")


def test_reported_failure_of_an_earlier_goal_is_no_false_success(simscen, limits, tmp_path: Path) -> None:
    messages = [
        *drive(),
        Message(STATUS, BEGIN + SECOND, statuses((1, BEGIN + SECOND, 2))),
        Message(STATUS, BEGIN + 2 * SECOND, statuses((1, BEGIN + SECOND, 6))),
        Message(STATUS, BEGIN + 3 * SECOND, statuses((2, BEGIN + 3 * SECOND, 2))),
        Message(STATUS, BEGIN + 10 * SECOND, statuses((2, BEGIN + 3 * SECOND, 4))),
    ]
    write_mcap(tmp_path / "drive.mcap", messages)
    goals = "goals: [{name: desk, pose: {x: 0, y: 9}}, {name: shelf, pose: {x: 5, y: 0}}]\n"
    file = limits("no_false_success: {}", "result: {status: FAILED}", keys=goals)
    assert simscen("drive.mcap", "--scenario", file, "--truth", "/mocap").code == 0
    file = limits("result: {status: SUCCEEDED}", keys=goals)
    assert "result: FAILED; expected SUCCEEDED" in simscen("drive.mcap", "--scenario", file, "--truth", "/mocap").out


def test_regions_and_footprint_are_read_from_the_criteria_file(simscen, limits, tmp_path) -> None:
    write_mcap(tmp_path / "drive.mcap", drive())
    (tmp_path / "hall.world.yaml").write_text(
        "simscen: 1\nwalls: [{points: [[-9, -9], [9, -9], [9, 9], [-9, 9], [-9, -9]]}]\n"
        "regions: {aisle: [[2, 0.5], [3, 0.5], [3, 2]]}\n"
    )
    robot = "robot: {model: turtlebot, pose: {x: 0, y: 0}}\n"
    file = limits("keepout: {region: aisle}", keys="world: hall.world.yaml\n")
    assert "the scenario has no `robot:`" in simscen("drive.mcap", "--scenario", file, "--truth", "/mocap").out
    file = limits("keepout: {region: aisle}", keys=f"world: hall.world.yaml\n{robot}")
    assert simscen("drive.mcap", "--scenario", file, "--truth", "/mocap").code == 0


def test_signals_are_judged_if_the_log_contains_them(simscen, limits, tmp_path: Path) -> None:
    write_mcap(tmp_path / "drive.mcap", drive())
    always = 'always: {{signal: {}, op: "<=", value: {}}}'
    file = limits(always.format("scan_age", "0.6 s"), always.format("collision_count", 3))
    completed = simscen("drive.mcap", "--scenario", file, "--truth", "/mocap")
    assert completed.code == 1
    assert completed.out.count("inconclusive") == 1
    assert "the log lacks the collisions of the robot" in completed.out


def test_unusual_logs_are_noted_and_truncated_logs_pass_nothing(simscen, limits, tmp_path: Path) -> None:
    data = write_mcap(tmp_path / "drive.mcap", drive()).read_bytes()
    (tmp_path / "drive.mcap").write_bytes(data[: len(data) - 400])
    completed = simscen("drive.mcap", "--scenario", limits("speed: {max: 9 m/s}"), "--truth", "/mocap")
    assert completed.code == 1
    assert completed.err == "note: drive.mcap: the log is truncated, so no criterion can pass\n"
    assert "so far, but the log stops at" in completed.out


def test_gap_in_the_ground_truth_makes_a_pass_but_no_failure_inconclusive(simscen, limits, tmp_path: Path) -> None:
    gap = (BEGIN + 4 * SECOND, BEGIN + 6 * SECOND)
    messages = [entry for entry in drive() if entry.topic != "/mocap" or not gap[0] < entry.time < gap[1]]
    write_mcap(tmp_path / "drive.mcap", messages)
    completed = simscen("drive.mcap", "--scenario", limits("speed: {max: 9 m/s}"), "--truth", "/mocap")
    assert "so far, but /mocap has no message from t = " in completed.out
    completed = simscen("drive.mcap", "--scenario", limits("speed: {max: 0.1 m/s}"), "--truth", "/mocap")
    assert "speed: 0.50 m/s > 0.10 m/s" in completed.out


@pytest.mark.parametrize("option", ["odom", "odo=/x", "odom=x", "=", "odom="])
def test_invalid_topic_option_is_refused(simscen, limits, tmp_path: Path, option: str) -> None:
    write_mcap(tmp_path / "drive.mcap", drive(1.0))
    completed = simscen("drive.mcap", "--scenario", limits("speed: {max: 9 m/s}"), "--topic", option)
    assert completed.code == 2
    assert "expected NAME=/TOPIC with one of odom, amcl_pose, " in completed.err


@pytest.mark.parametrize("truth", ["mocap", "", ":", "map:", "/amcl_pose"])
def test_invalid_ground_truth_is_refused(simscen, limits, tmp_path: Path, truth: str) -> None:
    write_mcap(tmp_path / "drive.mcap", drive(1.0))
    completed = simscen("drive.mcap", "--scenario", limits("speed: {max: 9 m/s}"), "--truth", truth)
    assert completed.code == 2
    assert "--truth" in completed.err and completed.out == ""


def test_error_for_a_database_file_names_the_bag_folder(simscen, limits, tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", drive(1.0))
    completed = simscen(str(next(bag.glob("*.db3"))), "--scenario", limits("speed: {max: 9 m/s}"))
    assert completed.code == 2
    assert "a rosbag2 is a folder with a metadata.yaml" in completed.err


def test_third_party_logs_among_several_need_criteria(simscen, tmp_path: Path) -> None:
    write_mcap(tmp_path / "a.mcap", drive(1.0))
    write_mcap(tmp_path / "b.mcap", drive(1.0))
    completed = simscen(".", "--truth", "/mocap")
    assert (completed.code, completed.err) == (3, "")
    assert completed.out.count("set criteria with --scenario") == 2


def test_metrics_without_evidence_are_null_in_the_result(simscen, limits, tmp_path: Path) -> None:
    write_mcap(tmp_path / "drive.mcap", drive())
    completed = simscen("drive.mcap", "--scenario", limits("speed: {max: 9 m/s}"), "--truth", "/mocap", "--json")
    assert re.search(r'"collisions": null', completed.out) and re.search(r'"path_length": (4\.9|5\.0)', completed.out)
    without_truth = simscen("drive.mcap", "--scenario", limits("speed: {max: 9 m/s}"), "--json")
    assert not re.search(r'"(path_length|speed_max|success|localization_max)": [0-9]', without_truth.out)


def test_nan_in_the_ground_truth_is_an_error(simscen, limits, tmp_path: Path) -> None:
    end = BEGIN + 3 * SECOND
    messages = [*drive(2.0), Message("/mocap", end, stamped_pose(end, "map", float("nan")))]
    write_mcap(tmp_path / "drive.mcap", messages)
    completed = simscen("drive.mcap", "--scenario", limits("speed: {max: 9 m/s}"), "--truth", "/mocap")
    assert completed.code == 3
    assert "is not finite at t = " in completed.out
