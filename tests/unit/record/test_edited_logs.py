"""Tests that edited logs never pass."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from mcap import records
from mcap.reader import make_reader
from mcap.writer import Writer
from moments import CLOCK, about, moments

from simscen.core.errors import InvalidInput
from simscen.core.geometry.kinematics import Twist
from simscen.core.records.events import Event, EventKind
from simscen.core.records.run_result import Outcome, RunKey
from simscen.core.records.trace import Decision, Moment
from simscen.core.records.verdict import Evidence, Status
from simscen.criteria.registry import AnyCriterion
from simscen.judge.run_result import judge_run
from simscen.record.log_reader.read import Log, read_log
from simscen.record.recorder import Recorder

Keep = Callable[[str, float], bool]
TRUTH, CLEARANCE, EVENTS = "/ground_truth/odom", "/simscen/clearance", "/simscen/events"
SECONDS = 4.0
CRITERIA = [
    {"clearance": {"min": 0}},
    {"speed": {"max": 100}},
    {"collisions": {"max": 100}},
    {"recoveries": {"max": 9}},
]


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "run.mcap"
    end = CLOCK.ticks(SECONDS)
    with Recorder(path, CLOCK, about()) as recorder:
        for moment in moments(SECONDS, beams=8, particles=4):
            recorder.append(moment)
        ended = Event(end, EventKind.RUN_ENDED, "time limit")
        recorder.append(Moment(end + 1, None, (), Decision(Twist()), (ended,)))
        recorder.close(end)
    return path


def edited(log: Path, path: Path, keep: Keep = lambda *_: True, counts: bool = True, backwards: bool = False) -> Path:
    """A copy, written by the mcap library, with the messages to keep (by topic and seconds)."""
    with log.open("rb") as source, path.open("wb") as target:
        reader, writer = make_reader(source), Writer(target)
        summary = reader.get_summary()
        assert summary is not None
        writer.start("ros2", "somebody")
        schemas = {one.id: writer.register_schema(one.name, one.encoding, one.data) for one in summary.schemas.values()}
        notes = list(reader.iter_metadata())
        (about_run,) = [note for note in notes if note.name == "simscen"]
        writer.add_metadata(about_run.name, about_run.metadata)
        for file in reader.iter_attachments():
            writer.add_attachment(0, 0, file.name, file.media_type, file.data)
        channels: dict[str, int] = {}
        messages = list(_messages(reader))
        first = messages[0][1].log_time
        for channel, message in reversed(messages) if backwards else messages:
            if keep(channel.topic, (message.log_time - first) / 1e9):
                if channel.topic not in channels:
                    kind = schemas[channel.schema_id]
                    channels[channel.topic] = writer.register_channel(channel.topic, "cdr", kind)
                writer.add_message(channels[channel.topic], message.log_time, message.data, message.log_time)
        (end,) = [note for note in notes if note.name == "simscen.end"]
        writer.add_metadata(end.name, end.metadata if counts else {"tick": end.metadata["tick"]})
        writer.finish()
    return path


def _messages(reader) -> Iterator[tuple[records.Channel, records.Message]]:
    for _, channel, message in reader.iter_messages(log_time_order=False):
        yield channel, message


def judged(read: Log):
    entries = [AnyCriterion.model_validate(words) for words in CRITERIA]
    return judge_run(RunKey("a", 7), "a", entries, read.trace, read.header.case, coverage=read.coverage)


def test_a_log_that_was_only_copied_passes(log: Path, tmp_path: Path) -> None:
    for read in (read_log(log), read_log(edited(log, tmp_path / "copy.mcap"))):
        assert not read.coverage.missing and not read.coverage.partial
        assert judged(read).outcome is Outcome.PASSED


EDITS: dict[str, tuple[Keep, set[str]]] = {
    "events removed": (lambda topic, t: topic != EVENTS or t > 3, {"collisions", "recoveries"}),
    "clearance ends": (lambda topic, t: topic != CLEARANCE or t <= 1, {"clearance"}),
    "clearance removed": (lambda topic, _: topic != CLEARANCE, {"clearance"}),
    "one clearance removed": (lambda topic, t: topic != CLEARANCE or not 1.0 <= t < 1.02, {"clearance"}),
    "truth ends": (lambda topic, t: topic != TRUTH or t <= 1, {"speed"}),
    "the first 3 s": (lambda _, t: t >= 3, {"speed", "clearance", "collisions", "recoveries"}),
}


@pytest.mark.parametrize("edit", EDITS)
def test_edited_log_does_not_pass_without_its_evidence(log: Path, tmp_path: Path, edit: str) -> None:
    keep, affected = EDITS[edit]
    read = read_log(edited(log, tmp_path / "edited.mcap", keep))
    result = judged(read)
    statuses = {verdict.id: verdict.status for verdict in result.verdicts}
    assert {name for name, status in statuses.items() if status is Status.INCONCLUSIVE} == affected
    assert result.outcome is Outcome.FAILED
    told = " ".join([*read.coverage.missing.values(), *read.coverage.partial.values()])
    assert " recorded messages" in told


def test_a_log_without_counts_is_not_passed(log: Path, tmp_path: Path) -> None:
    read = read_log(edited(log, tmp_path / "edited.mcap", counts=False))
    assert set(read.coverage.partial) == set(Evidence)
    assert {verdict.status for verdict in judged(read).verdicts} == {Status.INCONCLUSIVE}


def test_messages_in_reverse_order_are_refused(log: Path, tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="not in the order of time"):
        read_log(edited(log, tmp_path / "edited.mcap", backwards=True))
