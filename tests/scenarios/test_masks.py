"""Tests of keepout and speed masks."""

import json
import math
import sys

import numpy as np
import pytest

import simscen
from simscen.cli.main import main
from simscen.core.errors import InvalidInput
from simscen.loading.checks.scene_runner import check_in_world
from simscen.loading.scenario import load_scenario

SCENARIO = """\
simscen: 1
world:
  simscen: 1
  name: hall
  walls: [{name: wall, points: [[0, 0], [10, 0], [10, 6], [0, 6], [0, 0]]}]
  regions: {middle: [[4.2, 0], [5.8, 0], [5.8, 3.8], [4.2, 3.8]]}
robot: {pose: {x: 1.5, y: 2}}
goals: [{pose: {x: 8.5, y: 2}}]
time_limit: 60
pass:
  - goals_reached: {}
  - collisions: {}
"""
CELL = 0.1


def mask(folder, name, gray, *, mode="trinary", origin=(0.0, 0.0, 0.0), more=""):
    """A mask whose `gray` (rows, columns) has the lowest row first, in cells of 10 cm."""
    rows, columns = gray.shape
    (folder / f"{name}.pgm").write_bytes(f"P5\n{columns} {rows}\n255\n".encode() + gray[::-1].tobytes())
    (folder / f"{name}.yaml").write_text(
        f"image: {name}.pgm\nmode: {mode}\nresolution: {CELL}\norigin: {list(origin)}\n"
        f"negate: 0\noccupied_thresh: 1.0\nfree_thresh: 0.0\n{more}"
    )


def white(height=6.0, width=10.0):
    """A mask that says nothing, over all of the hall."""
    return np.full((round(height / CELL), round(width / CELL)), 255, dtype=np.uint8)


def scenario(folder, stack, more=""):
    file = folder / "masks.scenario.yaml"
    file.write_text(f"{SCENARIO}{more}stack:\n{stack}")
    return file


@pytest.mark.parametrize("turned", [False, True])
def test_a_keepout_mask_across_the_direct_way_is_driven_around(turned, tmp_path):
    if turned:  # the same strip as an image of its own, on its side and with its corner at (6, 0)
        mask(tmp_path, "strip", np.zeros((20, 40), dtype=np.uint8), origin=(6.0, 0.0, math.pi / 2))
    else:
        gray = white()
        gray[:40, 40:60] = 0
        mask(tmp_path, "strip", gray)
    run = simscen.simulate(scenario(tmp_path, "  keepout_mask: strip.yaml\n", "  - keepout: {region: middle}\n"))
    assert run.passed, run.result.verdicts
    assert run.result.metrics["path_length"] > 7.8


def fastest(run, left, right):
    """The robot's greatest true speed in m/s between two x."""
    x, speed = run.trace.truth.values[:, 0], run.trace.velocity.values[:, 0]
    return float(speed[(x > left) & (x < right)].max())


SPEED_MASKS = {
    "percent": ("scale", 102, "type: percent, base: 100, multiplier: -1", 0.5 * 0.4),  # 60 of 100 dark: 40 percent
    "absolute": ("raw", 30, "type: absolute, multiplier: 0.01", 0.3),
}


@pytest.mark.parametrize("kind", SPEED_MASKS)
def test_a_speed_mask_caps_the_true_speed_inside_and_nowhere_else(kind, tmp_path):
    mode, value, how, limit = SPEED_MASKS[kind]
    gray = white() if mode == "scale" else np.zeros_like(white())
    gray[:, 40:60] = value
    mask(tmp_path, "slow", gray, mode=mode)
    run = simscen.simulate(scenario(tmp_path, f"  speed_mask: {{file: slow.yaml, {how}}}\n"))
    assert run.passed, run.result.verdicts
    assert 0.7 * limit < fastest(run, 4.5, 5.8) < 1.05 * limit
    assert fastest(run, 6.5, 7.5) > 1.4 * limit


def told(file):
    """What is said about a scenario before it runs: file, line, code, severity and words of each problem."""
    try:
        loaded = load_scenario(file, file.parent)
        problems = [*loaded.notes, *check_in_world(loaded)]
    except InvalidInput as error:
        problems = error.problems
    return [(p.path, p.line, p.code, p.severity, f"{p.message}; {p.hint}") for p in problems]


LINE = SCENARIO.count("\n") + 2
"""Of the first line below `stack:`."""


def test_a_missing_mask_is_refused_at_its_line(tmp_path):
    ((path, line, code, severity, text),) = told(scenario(tmp_path, "  keepout_mask: nowhere.yaml\n"))
    assert (path, line, code, severity) == ("masks.scenario.yaml", LINE, "SC023", "error")
    assert "nowhere.yaml" in text


def test_a_mask_outside_of_the_root_is_refused_at_its_line(tmp_path):
    ((_, line, code, _, _),) = told(scenario(tmp_path, "  speed_mask: {file: ../../elsewhere.yaml}\n"))
    assert (line, code) == (LINE, "SC020")


def test_invalid_map_is_refused_as_a_mask(tmp_path):
    (tmp_path / "zones.yaml").write_text("type: 1\nfilter_info_topic: /costmap_filter_info\nbase: 0.0\n")
    problems = told(scenario(tmp_path, "  keepout_mask: zones.yaml\n"))
    assert {path for path, *_ in problems} == {"zones.yaml"}
    assert any("image" in text for *_, text in problems)


def test_a_mask_with_too_many_pixels_is_refused_at_its_line(tmp_path):
    mask(tmp_path, "huge", white())
    (tmp_path / "huge.pgm").write_bytes(b"P5\n90000 90000\n255\n")
    ((path, line, code, severity, text),) = told(scenario(tmp_path, "  keepout_mask: huge.yaml\n"))
    assert (path, line, code, severity) == ("masks.scenario.yaml", LINE, "SC320", "error")
    assert "90000 x 90000 pixels" in text
    assert "huge.pgm" in text


def test_an_unknown_key_of_a_mask_is_noted_and_ignored(tmp_path):
    gray = white()
    gray[:5, :5] = 0
    mask(tmp_path, "corner", gray, more="kind: keepout\n")
    ((path, line, code, severity, text),) = told(scenario(tmp_path, "  keepout_mask: corner.yaml\n"))
    assert (path, line, code, severity) == ("corner.yaml", 8, "SC311", "warning")
    assert "`kind` has no meaning in a ROS map" in text


def test_goal_in_a_masked_cell_is_reported_with_the_error_code_of_the_stack(tmp_path):
    gray = white()
    gray[:40, 60:] = 0
    mask(tmp_path, "right", gray)
    stack = "  keepout_mask: right.yaml\n"
    ((_, line, code, severity, text),) = told(scenario(tmp_path, stack))
    assert (line, code, severity) == (LINE, "SC302", "error")
    assert "error_code: GOAL_OCCUPIED" in text
    file = scenario(tmp_path, stack)
    failing = "  - result: {status: FAILED, error_code: GOAL_OCCUPIED}\n"
    file.write_text(file.read_text().replace("  - goals_reached: {}\n", failing))
    assert told(file) == []
    assert simscen.simulate(file).passed


def test_start_in_a_masked_cell_causes_a_warning_with_the_error_code(tmp_path):
    gray = white()
    gray[:, :30] = 0
    mask(tmp_path, "left", gray)
    ((_, line, code, severity, text),) = told(scenario(tmp_path, "  keepout_mask: left.yaml\n"))
    assert (line, code, severity) == (LINE, "SC302", "warning")
    assert "error_code: START_OCCUPIED" in text
    file = scenario(tmp_path, "  keepout_mask: left.yaml\n")
    failing = "  - result: {status: FAILED, error_code: START_OCCUPIED}\n"
    file.write_text(file.read_text().replace("  - goals_reached: {}\n", failing))
    assert told(file) == []
    assert simscen.simulate(file).passed


def test_empty_masks_cause_a_warning(tmp_path):
    mask(tmp_path, "blank", white())
    stack = "  keepout_mask: blank.yaml\n  speed_mask: {file: blank.yaml, base: 100, multiplier: -1}\n"
    assert [(line, code, severity) for _, line, code, severity, _ in told(scenario(tmp_path, stack))] == [
        (LINE, "SC055", "warning"),
        (LINE + 1, "SC055", "warning"),
    ]


@pytest.mark.slow
def test_keepout_mask_applies_without_a_map(tmp_path):
    gray = white()
    gray[:40, 40:60] = 0
    mask(tmp_path, "strip", gray)
    more = "  - keepout: {region: middle}\nmap: none\n"
    run = simscen.simulate(scenario(tmp_path, "  keepout_mask: strip.yaml\n  localizer: {type: ground_truth}\n", more))
    assert run.passed, run.result.verdicts


STRIP = "  - keepout: {mask: strip.yaml}\n"
CALM = "  - speed: {mask: {file: slow.yaml, type: absolute, multiplier: 0.01}}\n"
KNOWING = "  localizer: {type: ground_truth}\n"
CRITERION = SCENARIO.count("\n") + 1
"""The line of the first criterion that `more` adds."""


def strip(folder, *, turned=False):
    if turned:
        mask(folder, "strip", np.zeros((20, 40), dtype=np.uint8), origin=(6.0, 0.0, math.pi / 2))
    else:
        gray = white()
        gray[:40, 40:60] = 0
        mask(folder, "strip", gray)


def slow(folder):
    """30 cm/s between x 4 and 6."""
    gray = np.zeros_like(white())
    gray[:, 40:60] = 30
    mask(folder, "slow", gray, mode="raw")


def findings(run, kind):
    """Status, value and margin of what a criterion found."""
    return [(f.status.value, f.value, f.margin) for v in run.result.verdicts if v.criterion == kind for f in v.findings]


@pytest.mark.sample(1)
@pytest.mark.parametrize("turned", [False, True])
def test_only_the_robot_with_the_mask_avoids_it(turned, tmp_path):
    strip(tmp_path, turned=turned)
    told_of = simscen.simulate(scenario(tmp_path, "  keepout_mask: strip.yaml\n", STRIP))
    assert told_of.passed, told_of.result.verdicts
    (region,) = findings(simscen.simulate(scenario(tmp_path, KNOWING, "  - keepout: {region: middle}\n")), "keepout")
    unaware = simscen.simulate(scenario(tmp_path, KNOWING, STRIP))
    assert not unaware.passed
    ((status, value, _),) = findings(unaware, "keepout")
    assert status == region[0] == "fail"
    assert value < -0.2


def test_only_the_robot_with_the_speed_mask_keeps_the_limit(tmp_path):
    slow(tmp_path)
    how = "{file: slow.yaml, type: absolute, multiplier: 0.01}"
    assert simscen.simulate(scenario(tmp_path, f"  speed_mask: {how}\n", CALM)).passed
    unaware = simscen.simulate(scenario(tmp_path, KNOWING, CALM))
    ((status, value, margin),) = findings(unaware, "speed")
    assert status == "fail"
    assert margin == pytest.approx(0.35 - value)


@pytest.fixture
def judge(monkeypatch, capsys, tmp_path):
    """What `simscen judge --json` says in the folder: exit code, and its document or what is wrong."""

    def called(*arguments):
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr(sys, "argv", ["simscen", "judge", *arguments, "--json"])
        with pytest.raises(SystemExit) as end:
            main()
        said = capsys.readouterr()
        return end.value.code, json.loads(said.out) if said.out else said.err

    return called


def test_a_log_is_judged_by_its_masks_when_their_files_are_gone(judge, tmp_path):
    strip(tmp_path, turned=True)
    slow(tmp_path)
    run = simscen.simulate(scenario(tmp_path, KNOWING, STRIP + CALM), log=tmp_path / "run.mcap")
    for file in [*tmp_path.glob("*.yaml"), *tmp_path.glob("*.pgm")]:
        file.unlink()
    code, document = judge("run.mcap")
    assert code == 1
    again = {verdict["criterion"]: verdict["findings"] for verdict in document["verdicts"]}
    for kind in ("keepout", "speed"):
        assert [(f["status"], f["value"], f["margin"]) for f in again[kind]] == findings(run, kind)


def test_a_log_is_judged_by_the_masks_of_another_file(judge, tmp_path):
    simscen.simulate(scenario(tmp_path, KNOWING), log=tmp_path / "run.mcap")
    strip(tmp_path)
    limits = tmp_path / "limits.yaml"
    limits.write_text(f"simscen: 1\npass:\n{STRIP}")
    code, document = judge("run.mcap", "--scenario", "limits.yaml")
    assert (code, document["verdicts"][0]["status"]) == (1, "fail")
    (tmp_path / "strip.pgm").write_bytes(b"P5\n90000 90000\n255\n")
    code, text = judge("run.mcap", "--scenario", "limits.yaml")
    assert code == 2
    assert "limits.yaml:3:21: error[SC320] mask image strip.pgm" in text
    (tmp_path / "strip.yaml").unlink()
    code, text = judge("run.mcap", "--scenario", "limits.yaml")
    assert code == 2
    assert "limits.yaml:3:21: error[SC023]" in text


def test_a_mask_of_a_criterion_that_is_missing_or_unreadable_is_refused_at_its_line(tmp_path):
    file = scenario(tmp_path, KNOWING, "  - keepout: {mask: strap.yaml}\n")
    strip(tmp_path)
    ((path, line, code, severity, text),) = told(file)
    assert (path, line, code, severity) == ("masks.scenario.yaml", CRITERION, "SC023", "error")
    assert "strip.yaml" in text
    (tmp_path / "strip.pgm").write_bytes(b"P5\n90000 90000\n255\n")
    ((path, line, code, severity, text),) = told(scenario(tmp_path, KNOWING, STRIP))
    assert (path, line, code, severity) == ("masks.scenario.yaml", CRITERION, "SC320", "error")
    assert "strip.pgm" in text


def test_criteria_that_no_mask_can_make_fail_are_warned_of(tmp_path):
    mask(tmp_path, "strip", white())
    mask(tmp_path, "slow", white())
    assert [
        (line, code, severity) for _, line, code, severity, _ in told(scenario(tmp_path, KNOWING, STRIP + CALM))
    ] == [
        (CRITERION, "SC055", "warning"),
        (CRITERION + 1, "SC055", "warning"),
    ]


@pytest.mark.parametrize(
    ("columns", "words"), [(slice(0, 14), "the robot starts in"), (slice(70, 100), "if goal `goal-1` is reached")]
)
def test_a_mask_that_forbids_start_or_goal_can_never_be_kept_out_of(columns, words, tmp_path):
    gray = white()
    gray[:, columns] = 0
    mask(tmp_path, "strip", gray)
    ((_, line, code, severity, text),) = told(scenario(tmp_path, KNOWING, STRIP))
    assert (line, code, severity) == (CRITERION, "SC051", "error")
    assert words in text


def test_a_mask_lies_beside_the_file_that_names_it(tmp_path):
    (tmp_path / "common").mkdir()
    strip(tmp_path / "common")
    (tmp_path / "common/base.yaml").write_text(f"simscen: 1\npass:\n{STRIP}")
    file = scenario(tmp_path, KNOWING)
    file.write_text("extends: common/base.yaml\n" + file.read_text().replace(SCENARIO[SCENARIO.index("pass:") :], ""))
    assert told(file) == []
    ((status, _, _),) = findings(simscen.simulate(file), "keepout")
    assert status == "fail"


def test_noise_mask_is_too_large_for_a_log(tmp_path):
    gray = np.random.default_rng(1).integers(0, 2, (800, 800)).astype(np.uint8) * 255
    mask(tmp_path, "strip", gray)
    ((_, line, code, _, text),) = told(scenario(tmp_path, KNOWING, STRIP))
    assert (line, code) == (CRITERION, "SC320")
    assert "rectangles" in text
