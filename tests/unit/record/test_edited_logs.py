"""Tests that a log from which data was removed does not pass, and that an inconsistent log is refused."""

import re
import struct
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from mcap import records
from mcap.reader import make_reader
from mcap.writer import Writer
from moments import CLOCK, moments, sample_header

from simscen.core.errors import InvalidInput
from simscen.core.geometry.kinematics import Twist
from simscen.core.records.events import Event, EventKind
from simscen.core.records.run_result import Outcome, RunKey
from simscen.core.records.trace import Decision, Moment
from simscen.core.records.verdict import Evidence, Status
from simscen.criteria.registry import AnyCriterion
from simscen.judge.run_result import judge_run
from simscen.record.log_contents import LogContents
from simscen.record.log_header import case_to_json
from simscen.record.log_reader import Log, read_log, read_run
from simscen.record.messages import decode
from simscen.record.messages.decode import MessageReader
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
    with Recorder(path, CLOCK, sample_header()) as recorder:
        for moment in moments(SECONDS, beams=8, particles=4):
            recorder.append(moment)
        ended = Event(end, EventKind.RUN_ENDED, "time limit")
        recorder.append(Moment(end + 1, None, (), Decision(Twist()), (ended,)))
        recorder.close(end)
    return path


def write_edited_copy(
    log: Path, path: Path, keep: Keep = lambda *_: True, counts: bool = True, backwards: bool = False
) -> Path:
    """Write a copy of the log with the mcap library.

    It contains only the messages for which `keep(topic, time in s)` is true. `counts`: with the message counts at
    its end; `backwards`: with the messages in reverse order.
    """
    with log.open("rb") as source, path.open("wb") as target:
        reader, writer = make_reader(source), Writer(target)
        summary = reader.get_summary()
        assert summary is not None
        writer.start("ros2", "other recorder")
        schemas = {
            schema.id: writer.register_schema(schema.name, schema.encoding, schema.data)
            for schema in summary.schemas.values()
        }
        metadata = list(reader.iter_metadata())
        (run_record,) = [record for record in metadata if record.name == "simscen"]
        writer.add_metadata(run_record.name, run_record.metadata)
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
        (end,) = [record for record in metadata if record.name == "simscen.end"]
        writer.add_metadata(end.name, end.metadata if counts else {"tick": end.metadata["tick"]})
        writer.finish()
    return path


def _messages(reader) -> Iterator[tuple[records.Channel, records.Message]]:
    for _, channel, message in reader.iter_messages(log_time_order=False):
        yield channel, message


def judge_log(read: Log):
    entries = [AnyCriterion.model_validate(criterion) for criterion in CRITERIA]
    return judge_run(RunKey("a", 7), "a", entries, read.trace, read.header.case, coverage=read.coverage)


def test_copied_log_passes(log: Path, tmp_path: Path) -> None:
    for read in (read_log(log), read_log(write_edited_copy(log, tmp_path / "copy.mcap"))):
        assert not read.coverage.missing and not read.coverage.partial
        assert judge_log(read).outcome is Outcome.PASSED


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
    read = read_log(write_edited_copy(log, tmp_path / "edited.mcap", keep))
    result = judge_log(read)
    statuses = {verdict.id: verdict.status for verdict in result.verdicts}
    assert {name for name, status in statuses.items() if status is Status.INCONCLUSIVE} == affected
    assert result.outcome is Outcome.FAILED
    reasons = " ".join([*read.coverage.missing.values(), *read.coverage.partial.values()])
    assert " recorded messages" in reasons


def test_log_without_message_counts_does_not_pass(log: Path, tmp_path: Path) -> None:
    read = read_log(write_edited_copy(log, tmp_path / "edited.mcap", counts=False))
    assert set(read.coverage.partial) == set(Evidence)
    assert {verdict.status for verdict in judge_log(read).verdicts} == {Status.INCONCLUSIVE}


def test_log_without_ground_truth_is_refused_with_the_removed_topic(log: Path, tmp_path: Path) -> None:
    path = write_edited_copy(log, tmp_path / "edited.mcap", lambda topic, _: topic != TRUTH)
    with pytest.raises(InvalidInput, match=f"no ground truth: the messages of {TRUTH} were removed"):
        read_run(path)


def test_messages_in_reverse_order_are_refused(log: Path, tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="not in the order of time"):
        read_log(write_edited_copy(log, tmp_path / "edited.mcap", backwards=True))


Record = dict[str, str]
Edit = Callable[["Parts"], object]


class Parts:
    """The parts of a log that can be edited: metadata records, attachments, and messages with their channels."""

    def __init__(self, log: Path) -> None:
        with log.open("rb") as source:
            reader = make_reader(source)
            self.messages = [
                [schema, channel.topic, message.log_time, message.data]
                for schema, channel, message in reader.iter_messages(log_time_order=False)
            ]
            self.metadata = [(record.name, dict(record.metadata)) for record in reader.iter_metadata()]
            self.attachments = [(file.name, file.data) for file in reader.iter_attachments()]

    def record(self, name: str) -> Record:
        """Return the metadata record of this name."""
        return dict(self.metadata)[name]

    def of_topic(self, topic: str) -> list[list]:
        """Return the messages of a topic: schema, topic, log time, data."""
        return [message for message in self.messages if message[1] == topic]

    def write(self, path: Path, channels_per_topic: int = 1) -> Path:
        """Write a log. The messages of each topic alternate between its channels."""
        with path.open("wb") as target:
            writer = Writer(target)
            writer.start("ros2", "other recorder")
            for name, record in self.metadata:
                writer.add_metadata(name, record)
            for name, data in self.attachments:
                writer.add_attachment(0, 0, name, "text/plain", data)
            channels: dict[tuple[str, int], int] = {}
            for index, (schema, topic, time, data) in enumerate(self.messages):
                key = topic, index % channels_per_topic
                if key not in channels:
                    number = writer.register_schema(schema.name, schema.encoding, schema.data)
                    channels[key] = writer.register_channel(topic, "cdr", number)
                writer.add_message(channels[key], time, data, time)
            writer.finish()
        return path


def test_message_counts_are_summed_over_channels_of_a_topic(log: Path, tmp_path: Path) -> None:
    read = read_log(Parts(log).write(tmp_path / "split.mcap", channels_per_topic=3))
    assert judge_log(read).outcome is Outcome.PASSED


def halve_times(parts: Parts) -> None:
    for message in parts.of_topic(TRUTH):
        message[2] //= 2


def lose_orientation(parts: Parts) -> None:
    for message in parts.of_topic(TRUTH):
        pose = decode.odometry(MessageReader(message[3])).pose
        message[3] = message[3].replace(struct.pack("<4d", *pose[3:]), bytes(32))


def move_event(tick: int) -> Edit:
    def edit(parts: Parts) -> None:
        message = parts.of_topic(EVENTS)[0]
        text = re.sub(r'"tick": ?\d+', f'"tick":{tick}', MessageReader(message[3]).string()).encode() + b"\0"
        message[3] = message[3][:4] + struct.pack("<I", len(text)) + text

    return edit


REFUSED: dict[str, tuple[Edit, str]] = {
    "times of the truth": (halve_times, "the log time of a message of /ground_truth/odom differs from its stamp"),
    "no orientation": (lose_orientation, "an orientation is not a quaternion of length 1"),
    "event in the future": (move_event(10**9), "an event has the tick 1000000000, but was logged at tick"),
    "event before the start": (move_event(-1), "an event has the tick -1"),
    "end before the truth": (
        lambda parts: parts.record("simscen.end").update(tick="-5"),
        "the ground truth lasts until tick 960, but the run ended at tick -5",
    ),
    "two descriptions": (
        lambda parts: parts.metadata.append(("simscen", parts.record("simscen") | {"tick_rate": "500"})),
        "two metadata records `simscen`; a log that was merged from several logs cannot be judged",
    ),
    "two ends": (lambda parts: parts.metadata.append(parts.metadata[-1]), "two metadata records `simscen.end`"),
    "two cases": (lambda parts: parts.attachments.append(parts.attachments[0]), "two attachments case.json"),
    "a goal at infinity": (
        lambda parts: parts.attachments.__setitem__(
            0, ("case.json", re.sub(rb'("pose": \[\s*)[-\d.]+', rb'\1"Infinity"', parts.attachments[0][1]))
        ),
        "a pose is not finite",
    ),
}


@pytest.mark.parametrize("edit", REFUSED)
def test_inconsistent_log_is_refused(log: Path, tmp_path: Path, edit: str) -> None:
    change, message = REFUSED[edit]
    parts = Parts(log)
    change(parts)
    with pytest.raises(InvalidInput, match=re.escape(message)):
        read_log(parts.write(tmp_path / "edited.mcap"))


def contents_with_robots(robots: str) -> LogContents:
    """Return the contents of a log with this list of robots, and the cases of robots a and b."""
    contents = LogContents()
    contents.add(records.Metadata("simscen", run_record("a", robots)))
    for name in ("a", "b"):
        case = case_to_json(sample_header().case).encode()
        contents.add(records.Attachment(0, 0, f"{name}/case.json", "application/json", case))
    return contents


def run_record(name: str, robots: str) -> Record:
    return {"format": "1", "scenario": name, "seed": "1", "tick_rate": "240", "robots": robots}


def test_all_robots_of_a_log_are_listed() -> None:
    assert list(contents_with_robots('["a", "b"]').header().robots) == ["a", "b"]
    with pytest.raises(ValueError, match=r"it has b/case\.json, but its list of robots is a$"):
        contents_with_robots('["a"]').header()


@pytest.mark.parametrize("robots", ['["a", "a"]', '{"a": 1}', '"a"', "[[]]", "[1, 2]"])
def test_duplicate_robot_names_are_refused(robots: str) -> None:
    with pytest.raises(ValueError, match="its list of robots is"):
        contents_with_robots(robots)
