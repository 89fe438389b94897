"""Tests of an object on looped keyframes, in the simulation and in the log."""

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from simscen.core.records.events import EventKind
from simscen.loading.scenario import load_scenario
from simscen.record.log_reader import read_log
from simscen.run.preparation import prepare
from simscen.run.simulate import simulate

RATE_HZ = 240
KEYFRAMES = [
    (0.0, 3.0, 1.0, 0.0),
    (0.5, 4.0, 1.0, 1.5),
    (0.7, 4.0, 2.0, 3.0),
    (1.1, 3.0, 2.0, -2.0),
    (1.3, 3.0, 1.0, 0.0),
]
"""Time in s, x and y in m, and yaw in rad of each keyframe."""
START_S, PHASE_S = 0.5, 0.6
SCENARIO = f"""\
simscen: 1
world:
  simscen: 1
  walls: [{{name: outer wall, points: [[0, 0], [8, 0], [8, 4], [0, 4], [0, 0]]}}]
  objects:
    - {{name: straight, cylinder: [0.2, 1.0], pose: {{x: 3, y: 1}},
       move: {{keyframes: {[[t, x + 2, y + 1, yaw] for t, x, y, yaw in KEYFRAMES]}, repeat: loop}}}}
robot: {{pose: {{x: 1, y: 1}}}}
stack: {{localizer: {{type: ground_truth}}}}
goals: [{{pose: {{x: 1, y: 3}}}}]
physics: {{truth_rate: {RATE_HZ}}}
events:
  - {{when: {{time: 0 s}}, do: {{spawn: {{name: round, cylinder: [0.2, 1.0], pose: {{x: 7, y: 3}}}}}}}}
  - when: {{time: {START_S} s}}
    do: {{move: {{name: round, keyframes: {[list(frame) for frame in KEYFRAMES]}, repeat: loop, ease: spline,
                phase: {PHASE_S} s}}}}
time_limit: 5 s
pass: [{{collisions: {{max: 0}}}}]
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("keyframes")
    file, log = folder / "own.scenario.yaml", folder / "log.mcap"
    file.write_text(SCENARIO)
    return simulate(prepare(load_scenario(file, folder)), log=log), log


def expected_poses(ticks, start, phase, shift, is_spline):
    """Return the expected poses of the cylinder, by a spline of SciPy or linear interpolation."""
    times, values = np.array(KEYFRAMES)[:, 0], np.array(KEYFRAMES)[:, 1:] + [*shift, 0.0]
    values[:, 2] = np.unwrap(values[:, 2])
    local = np.fmod(ticks / RATE_HZ - start + phase, times[-1])
    if not is_spline:
        return np.column_stack([np.interp(local, times, column) for column in values.T])
    slopes = np.empty_like(values)
    slopes[1:-1] = (values[2:] - values[:-2]) / (times[2:] - times[:-2])[:, None]
    slopes[[0, -1]] = (values[1] - values[0] + values[-1] - values[-2]) / (times[1] - times[0] + times[-1] - times[-2])
    return CubicHermiteSpline(times, values, slopes)(local)


@pytest.mark.parametrize("source", ["trace", "log"])
@pytest.mark.parametrize(
    ("name", "start", "phase", "shift"), [("round", START_S, PHASE_S, (0, 0)), ("straight", 0.0, 0.0, (2, 1))]
)
def test_object_is_within_a_millimeter_of_its_keyframes(run, source, name, start, phase, shift):
    finished_run, log = run
    trace = finished_run.trace if source == "trace" else read_log(log).trace
    samples = trace.objects[name]
    moving = samples.ticks >= round(start * RATE_HZ) + 1
    ticks = samples.ticks[moving]
    assert np.array_equal(ticks, np.arange(ticks[0], trace.end + 1)), "a pose is missing"
    assert len(ticks) > 3 * KEYFRAMES[-1][0] * RATE_HZ, "too few loops"
    expected = expected_poses(ticks, start, phase, shift, name == "round")
    error = samples.values[moving] - expected
    assert np.abs(error[:, :2]).max() < 1e-3
    assert np.abs((error[:, 2] + np.pi) % (2 * np.pi) - np.pi).max() < 1e-3


def test_log_contains_the_parameters_of_the_motion(run):
    _, log = run
    (event,) = read_log(log).trace.of_kind(EventKind.OBJECT_MOVED)
    motion = event.data
    assert [(t, *pose) for t, pose in zip(motion["times"], motion["waypoints"], strict=True)] == KEYFRAMES
    assert (motion["repeat"], motion["ease"], motion["phase"], motion["start"]) == ("loop", "spline", PHASE_S, 0.0)
