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
CELL_M = 0.1


def write_mask(folder, name, gray, *, mode="trinary", origin=(0.0, 0.0, 0.0), extra=""):
    """Write a mask with cells of 10 cm; `gray` (rows, columns) starts with the lowest row."""
    rows, columns = gray.shape
    (folder / f"{name}.pgm").write_bytes(f"P5\n{columns} {rows}\n255\n".encode() + gray[::-1].tobytes())
    (folder / f"{name}.yaml").write_text(
        f"image: {name}.pgm\nmode: {mode}\nresolution: {CELL_M}\norigin: {list(origin)}\n"
        f"negate: 0\noccupied_thresh: 1.0\nfree_thresh: 0.0\n{extra}"
    )


def empty_mask(height=6.0, width=10.0):
    """Return an empty mask of the whole hall."""
    return np.full((round(height / CELL_M), round(width / CELL_M)), 255, dtype=np.uint8)


def scenario(folder, stack, extra=""):
    """Write a scenario; return its file. `extra` are further criteria."""
    file = folder / "masks.scenario.yaml"
    file.write_text(f"{SCENARIO}{extra}stack:\n{stack}")
    return file


@pytest.mark.parametrize("is_rotated", [False, True])
def test_robot_drives_around_a_keepout_mask(is_rotated, tmp_path):
    write_strip_mask(tmp_path, is_rotated=is_rotated)
    run = simscen.simulate(scenario(tmp_path, "  keepout_mask: strip.yaml\n", "  - keepout: {region: middle}\n"))
    assert run.passed, run.result.verdicts
    assert run.result.metrics["path_length"] > 7.8


def max_speed(run, left, right):
    """Return the maximum true speed in m/s between two x coordinates."""
    x, speed = run.trace.truth.values[:, 0], run.trace.velocity.values[:, 0]
    return float(speed[(x > left) & (x < right)].max())


SPEED_MASKS = {
    "percent": ("scale", 102, "type: percent, base: 100, multiplier: -1", 0.5 * 0.4),  # 60 of 100 dark: 40 percent
    "absolute": ("raw", 30, "type: absolute, multiplier: 0.01", 0.3),
}


@pytest.mark.parametrize("kind", SPEED_MASKS)
def test_speed_mask_limits_the_true_speed_only_inside_the_mask(kind, tmp_path):
    mode, value, options, limit = SPEED_MASKS[kind]
    gray = empty_mask() if mode == "scale" else np.zeros_like(empty_mask())
    gray[:, 40:60] = value
    write_mask(tmp_path, "slow", gray, mode=mode)
    run = simscen.simulate(scenario(tmp_path, f"  speed_mask: {{file: slow.yaml, {options}}}\n"))
    assert run.passed, run.result.verdicts
    assert 0.7 * limit < max_speed(run, 4.5, 5.8) < 1.05 * limit
    assert max_speed(run, 6.5, 7.5) > 1.4 * limit


def problems_of(file):
    """Return file, line, code, severity, and text of each problem that is found before a run."""
    try:
        loaded = load_scenario(file, file.parent)
        problems = [*loaded.notes, *check_in_world(loaded)]
    except InvalidInput as error:
        problems = error.problems
    return [(p.path, p.line, p.code, p.severity, f"{p.message}; {p.hint}") for p in problems]


STACK_LINE = SCENARIO.count("\n") + 2
"""Number of the first line below `stack:` in a scenario without `extra`."""


def test_a_missing_mask_is_refused_at_its_line(tmp_path):
    ((path, line, code, severity, text),) = problems_of(scenario(tmp_path, "  keepout_mask: nowhere.yaml\n"))
    assert (path, line, code, severity) == ("masks.scenario.yaml", STACK_LINE, "SC023", "error")
    assert "nowhere.yaml" in text


def test_a_mask_outside_of_the_root_is_refused_at_its_line(tmp_path):
    ((_, line, code, _, _),) = problems_of(scenario(tmp_path, "  speed_mask: {file: ../../outside.yaml}\n"))
    assert (line, code) == (STACK_LINE, "SC020")


def test_invalid_map_is_refused_as_a_mask(tmp_path):
    (tmp_path / "zones.yaml").write_text("type: 1\nfilter_info_topic: /costmap_filter_info\nbase: 0.0\n")
    problems = problems_of(scenario(tmp_path, "  keepout_mask: zones.yaml\n"))
    assert {path for path, *_ in problems} == {"zones.yaml"}
    assert any("image" in text for *_, text in problems)


def test_a_mask_with_too_many_pixels_is_refused_at_its_line(tmp_path):
    write_mask(tmp_path, "huge", empty_mask())
    (tmp_path / "huge.pgm").write_bytes(b"P5\n90000 90000\n255\n")
    ((path, line, code, severity, text),) = problems_of(scenario(tmp_path, "  keepout_mask: huge.yaml\n"))
    assert (path, line, code, severity) == ("masks.scenario.yaml", STACK_LINE, "SC320", "error")
    assert "90000 x 90000 pixels" in text
    assert "huge.pgm" in text


def test_an_unknown_key_of_a_mask_is_noted_and_ignored(tmp_path):
    gray = empty_mask()
    gray[:5, :5] = 0
    write_mask(tmp_path, "corner", gray, extra="kind: keepout\n")
    ((path, line, code, severity, text),) = problems_of(scenario(tmp_path, "  keepout_mask: corner.yaml\n"))
    assert (path, line, code, severity) == ("corner.yaml", 8, "SC311", "warning")
    assert "`kind` has no meaning in a ROS map" in text


def test_goal_in_a_masked_cell_is_reported_with_the_error_code_of_the_stack(tmp_path):
    gray = empty_mask()
    gray[:40, 60:] = 0
    write_mask(tmp_path, "right", gray)
    stack = "  keepout_mask: right.yaml\n"
    ((_, line, code, severity, text),) = problems_of(scenario(tmp_path, stack))
    assert (line, code, severity) == (STACK_LINE, "SC302", "error")
    assert "error_code: GOAL_OCCUPIED" in text
    file = scenario(tmp_path, stack)
    failing = "  - result: {status: FAILED, error_code: GOAL_OCCUPIED}\n"
    file.write_text(file.read_text().replace("  - goals_reached: {}\n", failing))
    assert problems_of(file) == []
    assert simscen.simulate(file).passed


def test_start_in_a_masked_cell_causes_a_warning_with_the_error_code(tmp_path):
    gray = empty_mask()
    gray[:, :30] = 0
    write_mask(tmp_path, "left", gray)
    ((_, line, code, severity, text),) = problems_of(scenario(tmp_path, "  keepout_mask: left.yaml\n"))
    assert (line, code, severity) == (STACK_LINE, "SC302", "warning")
    assert "error_code: START_OCCUPIED" in text
    file = scenario(tmp_path, "  keepout_mask: left.yaml\n")
    failing = "  - result: {status: FAILED, error_code: START_OCCUPIED}\n"
    file.write_text(file.read_text().replace("  - goals_reached: {}\n", failing))
    assert problems_of(file) == []
    assert simscen.simulate(file).passed


def test_empty_masks_cause_a_warning(tmp_path):
    write_mask(tmp_path, "blank", empty_mask())
    stack = "  keepout_mask: blank.yaml\n  speed_mask: {file: blank.yaml, base: 100, multiplier: -1}\n"
    assert [(line, code, severity) for _, line, code, severity, _ in problems_of(scenario(tmp_path, stack))] == [
        (STACK_LINE, "SC055", "warning"),
        (STACK_LINE + 1, "SC055", "warning"),
    ]


@pytest.mark.slow
def test_keepout_mask_applies_without_a_map(tmp_path):
    gray = empty_mask()
    gray[:40, 40:60] = 0
    write_mask(tmp_path, "strip", gray)
    extra = "  - keepout: {region: middle}\nmap: none\n"
    run = simscen.simulate(scenario(tmp_path, "  keepout_mask: strip.yaml\n  localizer: {type: ground_truth}\n", extra))
    assert run.passed, run.result.verdicts


KEEPOUT = "  - keepout: {mask: strip.yaml}\n"
SPEED_LIMIT = "  - speed: {mask: {file: slow.yaml, type: absolute, multiplier: 0.01}}\n"
GROUND_TRUTH = "  localizer: {type: ground_truth}\n"
CRITERION_LINE = SCENARIO.count("\n") + 1
"""Number of the line of the first criterion in `extra`."""


def write_strip_mask(folder, *, is_rotated=False):
    """Write a mask of the cells from x = 4 to 6 and y = 0 to 4; `is_rotated` for an image with its origin at (6, 0)."""
    if is_rotated:
        write_mask(folder, "strip", np.zeros((20, 40), dtype=np.uint8), origin=(6.0, 0.0, math.pi / 2))
    else:
        gray = empty_mask()
        gray[:40, 40:60] = 0
        write_mask(folder, "strip", gray)


def write_slow_mask(folder):
    """Write a mask with a limit of 0.3 m/s between x = 4 and x = 6."""
    gray = np.zeros_like(empty_mask())
    gray[:, 40:60] = 30
    write_mask(folder, "slow", gray, mode="raw")


def findings(run, kind):
    """Return the status, value, and margin of each finding of a criterion."""
    return [(f.status.value, f.value, f.margin) for v in run.result.verdicts if v.criterion == kind for f in v.findings]


@pytest.mark.sample(1)
@pytest.mark.parametrize("is_rotated", [False, True])
def test_only_the_robot_with_the_mask_avoids_it(is_rotated, tmp_path):
    write_strip_mask(tmp_path, is_rotated=is_rotated)
    aware = simscen.simulate(scenario(tmp_path, "  keepout_mask: strip.yaml\n", KEEPOUT))
    assert aware.passed, aware.result.verdicts
    (region,) = findings(
        simscen.simulate(scenario(tmp_path, GROUND_TRUTH, "  - keepout: {region: middle}\n")), "keepout"
    )
    unaware = simscen.simulate(scenario(tmp_path, GROUND_TRUTH, KEEPOUT))
    assert not unaware.passed
    ((status, value, _),) = findings(unaware, "keepout")
    assert status == region[0] == "fail"
    assert value < -0.2


def test_only_the_robot_with_the_speed_mask_keeps_the_limit(tmp_path):
    write_slow_mask(tmp_path)
    options = "{file: slow.yaml, type: absolute, multiplier: 0.01}"
    assert simscen.simulate(scenario(tmp_path, f"  speed_mask: {options}\n", SPEED_LIMIT)).passed
    unaware = simscen.simulate(scenario(tmp_path, GROUND_TRUTH, SPEED_LIMIT))
    ((status, value, margin),) = findings(unaware, "speed")
    assert status == "fail"
    assert margin == pytest.approx(0.35 - value)


@pytest.fixture
def judge(monkeypatch, capsys, tmp_path):
    """Return a function that runs `simscen judge --json`: exit code, and the document or the error."""

    def call(*arguments):
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr(sys, "argv", ["simscen", "judge", *arguments, "--json"])
        with pytest.raises(SystemExit) as end:
            main()
        output = capsys.readouterr()
        return end.value.code, json.loads(output.out) if output.out else output.err

    return call


def test_log_is_judged_with_its_masks_after_their_files_are_deleted(judge, tmp_path):
    write_strip_mask(tmp_path, is_rotated=True)
    write_slow_mask(tmp_path)
    run = simscen.simulate(scenario(tmp_path, GROUND_TRUTH, KEEPOUT + SPEED_LIMIT), log=tmp_path / "run.mcap")
    for file in [*tmp_path.glob("*.yaml"), *tmp_path.glob("*.pgm")]:
        file.unlink()
    code, document = judge("run.mcap")
    assert code == 1
    findings_by_kind = {verdict["criterion"]: verdict["findings"] for verdict in document["verdicts"]}
    for kind in ("keepout", "speed"):
        assert [(f["status"], f["value"], f["margin"]) for f in findings_by_kind[kind]] == findings(run, kind)


def test_a_log_is_judged_by_the_masks_of_another_file(judge, tmp_path):
    simscen.simulate(scenario(tmp_path, GROUND_TRUTH), log=tmp_path / "run.mcap")
    write_strip_mask(tmp_path)
    limits = tmp_path / "limits.yaml"
    limits.write_text(f"simscen: 1\npass:\n{KEEPOUT}")
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


def test_missing_or_unreadable_mask_of_a_criterion_is_an_error(tmp_path):
    file = scenario(tmp_path, GROUND_TRUTH, "  - keepout: {mask: strap.yaml}\n")
    write_strip_mask(tmp_path)
    ((path, line, code, severity, text),) = problems_of(file)
    assert (path, line, code, severity) == ("masks.scenario.yaml", CRITERION_LINE, "SC023", "error")
    assert "strip.yaml" in text
    (tmp_path / "strip.pgm").write_bytes(b"P5\n90000 90000\n255\n")
    ((path, line, code, severity, text),) = problems_of(scenario(tmp_path, GROUND_TRUTH, KEEPOUT))
    assert (path, line, code, severity) == ("masks.scenario.yaml", CRITERION_LINE, "SC320", "error")
    assert "strip.pgm" in text


def test_criteria_with_empty_masks_cause_a_warning(tmp_path):
    write_mask(tmp_path, "strip", empty_mask())
    write_mask(tmp_path, "slow", empty_mask())
    assert [
        (line, code, severity)
        for _, line, code, severity, _ in problems_of(scenario(tmp_path, GROUND_TRUTH, KEEPOUT + SPEED_LIMIT))
    ] == [
        (CRITERION_LINE, "SC055", "warning"),
        (CRITERION_LINE + 1, "SC055", "warning"),
    ]


@pytest.mark.parametrize(
    ("columns", "message"), [(slice(0, 14), "the robot starts in"), (slice(70, 100), "if goal `goal-1` is reached")]
)
def test_keepout_criterion_with_start_or_goal_in_the_mask_is_an_error(columns, message, tmp_path):
    gray = empty_mask()
    gray[:, columns] = 0
    write_mask(tmp_path, "strip", gray)
    ((_, line, code, severity, text),) = problems_of(scenario(tmp_path, GROUND_TRUTH, KEEPOUT))
    assert (line, code, severity) == (CRITERION_LINE, "SC051", "error")
    assert message in text


def test_mask_path_is_relative_to_the_file_that_contains_it(tmp_path):
    (tmp_path / "common").mkdir()
    write_strip_mask(tmp_path / "common")
    (tmp_path / "common/base.yaml").write_text(f"simscen: 1\npass:\n{KEEPOUT}")
    file = scenario(tmp_path, GROUND_TRUTH)
    file.write_text("extends: common/base.yaml\n" + file.read_text().replace(SCENARIO[SCENARIO.index("pass:") :], ""))
    assert problems_of(file) == []
    ((status, _, _),) = findings(simscen.simulate(file), "keepout")
    assert status == "fail"


def test_noise_mask_is_too_large_for_a_log(tmp_path):
    gray = np.random.default_rng(1).integers(0, 2, (800, 800)).astype(np.uint8) * 255
    write_mask(tmp_path, "strip", gray)
    ((_, line, code, _, text),) = problems_of(scenario(tmp_path, GROUND_TRUTH, KEEPOUT))
    assert (line, code) == (CRITERION_LINE, "SC320")
    assert "rectangles" in text
