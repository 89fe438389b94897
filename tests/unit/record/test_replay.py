"""A log gives back the very Trace that the moments gave, and nothing but InvalidInput when it cannot."""

import dataclasses
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.stream_reader import StreamReader
from mcap.writer import Writer

from simscen.core.belief import Belief
from simscen.core.errors import InvalidInput
from simscen.core.events import Event
from simscen.core.geometry import Pose2, Pose3
from simscen.core.motion import Twist
from simscen.core.navigation import Path as Plan
from simscen.core.sensing import Odometry, Scan
from simscen.core.trace import Decision, Moment, Samples, Trace, Truth
from simscen.record.recorder import Recorder
from simscen.record.replay import Log, read_log
from simscen.record.trace import TraceBuilder

sys.path.insert(0, str(Path(__file__).parent))
from moments import CASE, CLOCK, about, moments

HERE = Path(__file__).parent
RESULT = '{"status": "pass"}'


def recorded(path: Path, run: "list[Moment]", end: int) -> Trace:
    builder = TraceBuilder(CLOCK)
    with Recorder(path, CLOCK, about()) as recorder:
        for moment in run:
            recorder.append(moment)
            builder.append(moment)
        recorder.close(end, RESULT)
    return builder.finish(end)


def exact(value: object) -> object:
    """Something that is equal for equal bits only: nan equals itself, 0.0 is not -0.0."""
    match value:
        case np.ndarray():
            return value.dtype.str, value.shape, value.tobytes()
        case Samples() | Plan():
            return [exact(getattr(value, field.name)) for field in dataclasses.fields(value)]
        case dict():
            return [(name, exact(item)) for name, item in value.items()]
        case tuple():
            return [exact(item) for item in value]
    return repr(value)


def assert_same(ours: Trace, theirs: Trace) -> None:
    for field in dataclasses.fields(Trace):
        assert exact(getattr(ours, field.name)) == exact(getattr(theirs, field.name)), field.name


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "run.mcap"
    recorded(path, list(moments(1.0)), 240)
    return path


@pytest.mark.parametrize("seed", range(3))
def test_a_replayed_log_gives_the_very_same_trace(tmp_path: Path, seed: int) -> None:
    trace = recorded(tmp_path / "run.mcap", list(moments(2.0, seed)), 481)
    assert_same(trace, read_log(tmp_path / "run.mcap").trace)


floats = st.floats(allow_infinity=False)
twists = st.builds(Twist, floats, floats, floats)
poses = st.builds(Pose2, floats, floats, floats)
spatial = st.builds(Pose3, *[st.floats()] * 7)
matrices = st.lists(st.floats(), min_size=9, max_size=9).map(lambda v: np.array(v).reshape(3, 3))
plans = st.builds(
    Plan, st.lists(st.tuples(floats, floats, floats), max_size=4).map(lambda p: np.array(p).reshape(-1, 3))
)
events = st.builds(
    Event, st.integers(0, 10**6), st.text(), st.text(), st.dictionaries(st.text(), st.floats() | st.text())
)
truths = st.builds(Truth, spatial, twists, st.floats(), st.dictionaries(st.text(max_size=5), spatial, max_size=2))
decisions = st.builds(
    Decision,
    twists,
    st.none() | st.builds(Belief, poses, matrices, poses),
    st.none() | plans,
    events=st.lists(events, max_size=2).map(tuple),
)
readings = st.builds(Odometry, st.sampled_from(["a", "b"]), st.integers(0, 99), poses, twists) | st.builds(
    Scan,
    st.sampled_from(["c", "d"]),
    st.integers(0, 99),
    st.just(np.array([1.0, np.nan])),
    *map(st.just, (0.0, 0.1, 0.0, 9.0)),
)
any_moments = st.lists(
    st.builds(Moment, st.just(0), st.none() | truths, st.lists(readings, max_size=3).map(tuple), decisions), max_size=8
).flatmap(
    lambda run: st.lists(st.integers(0, 10**6), min_size=len(run), max_size=len(run), unique=True).map(
        lambda ticks: [dataclasses.replace(m, tick=tick) for m, tick in zip(run, sorted(ticks), strict=True)]
    )
)


@settings(max_examples=40, deadline=None, suppress_health_check=list(HealthCheck))
@given(run=any_moments, end=st.integers(0, 10**7))
def test_any_moments_are_replayed_to_the_last_bit(
    tmp_path_factory: pytest.TempPathFactory, run: list[Moment], end: int
) -> None:
    path = tmp_path_factory.mktemp("any") / "run.mcap"
    assert_same(recorded(path, run, end), read_log(path).trace)


def test_a_log_knows_how_its_run_was_ordered(log: Path) -> None:
    read, given_ = read_log(log), about()
    assert read.complete
    assert read.result == RESULT
    for name in ("name", "seed", "case", "scenario", "robot_description", "files", "facts"):
        assert getattr(read.about, name) == getattr(given_, name)
    assert read.about.case == CASE
    assert read.about.frames["camera"] == given_.frames["camera"]


def test_the_map_is_read_back_exactly(log: Path) -> None:
    ours, theirs = read_log(log).about.map, about().map
    assert ours is not None
    assert theirs is not None
    assert exact(ours.cells) == exact(theirs.cells)
    assert (ours.resolution, ours.origin) == (theirs.resolution, theirs.origin)


def killed(folder: Path, seconds: float) -> Path:
    """The log of a process that a SIGKILL ended after so many simulated seconds."""
    code = f"""if True:
        import os, signal, sys
        sys.path.insert(0, {str(HERE)!r})
        from moments import CLOCK, about, moments
        from simscen.record.recorder import Recorder
        recorder = Recorder({str(folder / "run.mcap")!r}, CLOCK, about())
        for moment in moments({seconds}):
            recorder.append(moment)
        os.kill(os.getpid(), signal.SIGKILL)
    """
    process = subprocess.run([sys.executable, "-c", code], check=False, cwd=HERE.parents[2], env=dict(os.environ))
    assert process.returncode == -signal.SIGKILL
    return folder / "run.partial.mcap"


def test_a_killed_log_keeps_95_percent_of_its_messages(tmp_path: Path) -> None:
    partial = killed(tmp_path, 20.0)
    whole = recorded(tmp_path / "whole.mcap", list(moments(20.0)), 4800)
    log = read_log(partial)
    assert not log.complete
    assert log.about.case == CASE
    assert len(log.trace.truth) >= 0.95 * len(whole.truth)
    assert log.trace.end >= 0.95 * whole.end
    kept = len(log.trace.truth)
    assert exact(log.trace.truth.values[:, :2].copy()) == exact(whole.truth.values[:kept, :2].copy())


def test_the_mcap_library_streams_a_killed_log(tmp_path: Path) -> None:
    count = 0
    with killed(tmp_path, 5.0).open("rb") as stream, pytest.raises(Exception, match=""):
        for _ in StreamReader(stream).records:
            count += 1
    assert count > 1000


def problem(path: Path) -> str:
    with pytest.raises(InvalidInput) as caught:
        read_log(path)
    (found,) = caught.value.problems
    assert found.path == str(path)
    return f"{found.code} {found.message}"


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda data: b"", "SC801 not a log of simscen: it is not an MCAP file"),
        (lambda data: b"name: goal\nworld: house\n", "SC801 not a log of simscen: it is not an MCAP file"),
        (lambda data: data[:-1], "SC803 the log ends too early: its run broke off"),
        (lambda data: data[: len(data) // 2], "SC803 the log ends too early: its run broke off"),
        (lambda data: data[:9], "SC803 the log ends too early: its run broke off"),
    ],
)
def test_a_wrong_file_is_told_as_such(
    tmp_path: Path, log: Path, change: Callable[[bytes], bytes], expected: str
) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(change(log.read_bytes()))
    assert problem(path) == expected


def test_a_missing_file_is_told_as_such(tmp_path: Path) -> None:
    assert problem(tmp_path / "run.mcap") == "SC800 cannot read the log: No such file or directory"


def test_a_log_of_somebody_else_is_told_as_such(tmp_path: Path) -> None:
    with Path(tmp_path / "run.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2", "rosbag2")
        channel = writer.register_channel(
            "/odom", "cdr", writer.register_schema("nav_msgs/msg/Odometry", "ros2msg", b"")
        )
        writer.add_message(channel, 0, b"", 0)
        writer.finish()
    assert problem(tmp_path / "run.mcap").startswith("SC801 not a log of simscen")


def test_a_log_too_short_to_say_its_run_is_told_as_such(tmp_path: Path, log: Path) -> None:
    path = tmp_path / "run.partial.mcap"
    path.write_bytes(log.read_bytes()[:60])
    assert problem(path).startswith("SC801 not a log of simscen")


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(place=st.floats(0, 1), bit=st.integers(0, 7))
def test_a_flipped_bit_is_noticed(tmp_path: Path, log: Path, place: float, bit: int) -> None:
    data = bytearray(log.read_bytes())
    summary = data.rindex(b"/amcl_pose") - 1000  # the data section is what counts; the index is not read
    data[int(place * summary)] ^= 1 << bit
    path = tmp_path / "flipped.mcap"
    path.write_bytes(data)
    assert problem(path)


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(kept=st.floats(0, 1))
def test_a_log_cut_anywhere_is_read_as_far_as_it_goes_or_refused(tmp_path: Path, log: Path, kept: float) -> None:
    data = log.read_bytes()
    path = tmp_path / "cut.partial.mcap"
    path.write_bytes(data[: int(kept * len(data))])
    try:
        read: Log | None = read_log(path)
    except InvalidInput:
        read = None
    assert read is None or len(read.trace.truth) <= 41
