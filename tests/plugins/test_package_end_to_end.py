"""End-to-end tests of an installed package: files, schema, explain, runs, reports, and uninstallation."""

import json
import os
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import jsonschema
import pytest
import yaml

from simscen.record.log_reader import read_log

SIMSCEN = [sys.executable, "-c", "import sys; from simscen.cli.start import start; sys.exit(start())"]
ROBOT = """\
simscen: 1
name: yard robot
mass: 8 kg
radius: 0.2
body: [{cylinder: [0.2, 0.25], z: 0.05}]
drive: {type: differential, wheel_radius: 0.05, wheel_separation: 0.3}
limits: {linear: 0.6, angular: 1.5, linear_acceleration: 1.5, angular_acceleration: 3}
sensors:
  lidar: {lidar: {}}
  odom: {odometry: {}}
  imu: {imu: {}}
  ring: {sonar: {sensors: 6, mount: {z: 0.15}}}
"""
SCENARIO = """\
simscen: 1
name: doorway
world:
  simscen: 1
  walls:
    - {points: [[0, 0], [6, 0], [6, 3], [0, 3], [0, 0]]}
  regions: {doorway: [[2.5, 0], [3.5, 0], [3.5, 3], [2.5, 3]]}
robot: {model: yard.robot.yaml, pose: {x: 1, y: 1.5}}
goals: [{pose: {x: 5, y: 1.5}}]
time_limit: 60 s
events:
  - {name: bumped, when: {travelled: 1 m}, do: {turn_robot: {by: 20 deg}}}
  - {name: backwards, when: {reversing: 0.3 m/s}, do: {push: {impulse: [0, 1]}}, required: false}
faults:
  - {sensor: lidar, crosstalk: {width: 10 deg}, when: {time: 2 s}, for: 3 s}
pass:
  - goals_reached: {}
  - dwell: {region: doorway, max: 30 s}
metrics:
  - reversed_length: {}
"""


def create_folder(folder: Path) -> Path:
    """Create a folder with a scenario that uses all types of the package."""
    folder.mkdir()
    (folder / "yard.robot.yaml").write_text(ROBOT)
    (folder / "door.scenario.yaml").write_text(SCENARIO)
    return folder


@pytest.fixture
def yard(tmp_path, monkeypatch, yardwork) -> Path:
    """Change into such a folder, with the package on PYTHONPATH; return the folder."""
    monkeypatch.chdir(create_folder(tmp_path / "work"))
    monkeypatch.setenv("PYTHONPATH", str(yardwork))
    return tmp_path / "work"


def simscen(*arguments: str, cwd: Path | None = None, **more: str) -> subprocess.CompletedProcess[str]:
    """Run the command in a new process."""
    env = {**os.environ, "COLUMNS": "100", **more}
    return subprocess.run([*SIMSCEN, *arguments], cwd=cwd, capture_output=True, text=True, check=False, env=env)


@pytest.fixture(scope="module")
def shared_out(tmp_path_factory, install_folder) -> Path:
    """Return the output folder of a run of the scenario, for tests that do not change it."""
    top = tmp_path_factory.mktemp("yard")
    site = install_folder(Path(__file__).with_name("yardwork"), top / "site")
    done = simscen("run", "door.scenario.yaml", "--out", "out", cwd=create_folder(top / "work"), PYTHONPATH=str(site))
    assert done.returncode == 0, done.stdout + done.stderr
    return top / "work" / "out"


@pytest.fixture
def finished_yard(yard, shared_out) -> Path:
    """Return the folder of `yard` with a copy of the run's output."""
    shutil.copytree(shared_out, yard / "out")
    return yard


def test_run_uses_types_of_the_package_and_reports_show_them(finished_yard) -> None:
    yard = finished_yard
    log = read_log(yard / "out/runs/door/seed-1/run.mcap")
    result = json.loads((yard / "out/runs/door/seed-1/result.json").read_text())
    facts = {name: fact for name, fact in log.header.facts.items() if name.startswith("plugin.")}
    kinds = ["action.turn_robot", "criterion.dwell", "fault.crosstalk", "metric.reversed_length", "sensor.sonar"]
    kinds.append("trigger.reversing")
    assert facts == {f"plugin.{kind}": "yardwork==1.2" for kind in kinds}
    packages = json.loads((yard / "out/run.json").read_text())["plugins"]
    used = [kind.replace(".", " ") for kind in kinds]
    assert packages == {"yardwork": {"version": "1.2", "used": used}}
    assert result["metrics"]["reversed_length"] == pytest.approx(0.0, abs=0.2)
    assert [one["happened"] for one in result["disturbances"]] == [True, False, True]
    dwell = next(verdict for verdict in result["verdicts"] if verdict["criterion"] == "dwell")
    assert dwell["status"] == "pass" and 1.0 < dwell["findings"][0]["value"] < 30.0
    judged = json.loads(simscen("judge", "out/runs/door/seed-1/run.mcap", "--json").stdout)
    assert judged["metrics"] == result["metrics"]
    assert [one["findings"] for one in judged["verdicts"]] == [one["findings"] for one in result["verdicts"]]


@pytest.mark.slow
def test_criterion_of_the_package_can_fail_with_a_margin(yard) -> None:
    (yard / "door.scenario.yaml").write_text(SCENARIO.replace("max: 30 s", "max: 0.5 s"))
    assert simscen("run", "door.scenario.yaml", "--out", "out").returncode == 1
    (failure,) = ET.parse(yard / "out/junit.xml").getroot().iter("failure")
    assert re.search(r"dwell: doorway: \d\.\d\d s > 0\.50 s", failure.get("message", "")), failure.attrib


def test_readings_of_the_package_sensor_are_in_the_log(shared_out) -> None:
    from mcap.reader import make_reader

    with (shared_out / "runs/door/seed-1/run.mcap").open("rb") as stream:
        summary = make_reader(stream).get_summary()
        assert summary is not None
        topics = {channel.topic for channel in summary.channels.values()}
    assert "/scan" in topics and any("ring" in topic for topic in topics)


@pytest.mark.sample(3)
@pytest.mark.parametrize(
    ("old", "new", "wrong", "message", "hint"),
    [
        ("max: 30 s", "max: 30 m", "30 m", "`m` is a unit of length, but this is a duration", "units: s, ms"),
        ("region: doorway,", "region: dorway,", "dorway,", "no region of the world is called `dorway`", "`doorway`?"),
        ("dwell:", "dwel:", "dwel:", "unknown key `dwel` in `pass[1]`", "did you mean `dwell`?"),
        (
            "lidar, cross",
            "imu, cross",
            "crosstalk",
            "fault `crosstalk` cannot affect an imu (`imu`)",
            "lidar, ring",
        ),
        ("reversing: 0.3 m/s", "reversing: -1", "-1", "must be greater than 0, got `-1`", ""),
        ("{by: 20 deg}", "{bye: 20 deg}", "bye", "unknown key `bye`", "did you mean `by`?"),
        ("reversed_length:", "reversed_lenght:", "reversed_lenght", "unknown key", "did you mean `reversed_length`?"),
    ],
)
def test_mistake_is_reported_at_its_position_with_a_suggestion(yard, old, new, wrong, message, hint) -> None:
    text = SCENARIO.replace(old, new)
    (yard / "door.scenario.yaml").write_text(text)
    done = simscen("validate", "door.scenario.yaml")
    line = next(number for number, line in enumerate(text.splitlines(), 1) if new in line)
    row = text.splitlines()[line - 1]
    place = f"{line}:{row.index(wrong, row.index(new) if wrong in new else 0) + 1}"
    assert (done.returncode, done.stderr) == (2, "")
    assert f"door.scenario.yaml:{place}: error" in done.stdout, done.stdout
    assert message in done.stdout and hint in done.stdout


@pytest.mark.slow
def test_schema_and_explain_include_the_package_but_committed_files_do_not(yard) -> None:
    schema = json.loads(simscen("schema", "scenario").stdout)
    jsonschema.Draft7Validator(schema).validate(yaml.safe_load(SCENARIO))
    jsonschema.Draft7Validator(json.loads(simscen("schema", "robot").stdout)).validate(yaml.safe_load(ROBOT))
    wrong = yaml.safe_load(SCENARIO.replace("max: 30 s", "maximum: 30 s"))
    assert [list(error.path) for error in jsonschema.Draft7Validator(schema).iter_errors(wrong)] != []
    explained = simscen("explain", "dwell").stdout
    assert "dwell (criterion of yardwork 1.2)" in explained and "region: text (required)" in explained
    page = simscen("explain", "--page").stdout
    assert "### `dwell`\n\nAdded by yardwork 1.2.\n\nThe robot leaves a region" in page
    assert "### `sonar`" in page and "### `reversed_length`" in page
    assert "reversed_length (metric of yardwork 1.2)" in simscen("explain", "reversed_length").stdout
    assert re.search(r"^  .*\bcrosstalk\b", simscen("explain").stdout, re.MULTILINE)
    assert "dwell" not in simscen("schema", PYTHONPATH="").stdout
    check = [sys.executable, "-m", "simscen.cli.catalog.generate", "--check"]
    assert subprocess.run(check, capture_output=True, text=True, check=False).stdout == ""


@pytest.mark.slow
def test_resume_repeats_runs_that_use_a_changed_package(yard, yardwork) -> None:
    assert simscen("run", "door.scenario.yaml", "--out", "out").returncode == 0
    journal = yard / "out/events.jsonl"
    assert simscen("run", "door.scenario.yaml", "--resume", "out").returncode == 0
    kept = journal.read_text().count('"event": "started"')
    module = yardwork / "yardwork/crosstalk.py"
    module.write_text(module.read_text() + "\nTOUCHED = True\n")
    assert simscen("run", "door.scenario.yaml", "--resume", "out").returncode == 0
    assert (kept, journal.read_text().count('"event": "started"')) == (1, 2)


def test_missing_package_is_reported_for_files_that_use_it(finished_yard, yardwork) -> None:
    shutil.rmtree(yardwork)
    done = simscen("validate", "door.scenario.yaml")
    assert done.returncode == 2
    assert "unknown key `dwell` in `pass[1]`" in done.stdout + done.stderr
    assert "`simscen plugins` lists what installed packages add" in done.stdout + done.stderr
    judged = simscen("judge", "out/runs/door/seed-1/run.mcap")
    assert judged.returncode == 2
    message = "the run was judged with criterion `dwell` of yardwork==1.2, but it is not installed"
    assert message in judged.stdout + judged.stderr
    (finished_yard / "mine.yaml").write_text("pass: [{goals_reached: {}}]\n")
    assert simscen("judge", "out/runs/door/seed-1/run.mcap", "--scenario", "mine.yaml").returncode == 0


def test_log_is_not_judged_by_another_package_version(finished_yard, yardwork) -> None:
    (yardwork / "yardwork-1.2.dist-info/METADATA").write_text("Metadata-Version: 2.1\nName: yardwork\nVersion: 2.0\n")
    judged = simscen("judge", "out/runs/door/seed-1/run.mcap")
    assert judged.returncode == 2
    assert "of yardwork==1.2, but yardwork==2.0 is installed" in judged.stdout + judged.stderr


@pytest.mark.slow
def test_log_is_judged_without_packages_needed_only_by_the_run(yard, yardwork) -> None:
    (yard / "door.scenario.yaml").write_text(
        SCENARIO.replace("  - dwell: {region: doorway, max: 30 s}\n", "").partition("metrics:")[0]
    )
    assert simscen("run", "door.scenario.yaml", "--out", "out").returncode == 0
    shutil.rmtree(yardwork)
    judged = simscen("judge", "out/runs/door/seed-1/run.mcap")
    assert (judged.returncode, judged.stderr) == (0, "")
