"""The records of a log, sorted into what a Log is made of."""

import json
from collections.abc import Callable
from dataclasses import replace

from mcap import records

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose2, Pose3
from simscen.core.records.trace import Trace
from simscen.core.records.verdict import LogCoverage
from simscen.record import frame_names, log_header, topics
from simscen.record.log_header import LogHeader
from simscen.record.log_reader.message_counts import MessageCounts
from simscen.record.log_reader.sensor_messages import SensorMessages
from simscen.record.messages import decode, event_text
from simscen.record.simtime import NS_PER_SECOND, SimTime
from simscen.record.trace_builder import TraceRows

Handler = Callable[[int, bytes], None]


class NotSimscenLog(ValueError):
    """A sound MCAP file, but none of simscen's."""


class LogContents:
    """Takes a log's records in the order of the file. Raises ValueError, KeyError or struct.error on a wrong one.

    With `looks`, what no trace holds is kept for whoever wants to see it, too.
    """

    def __init__(self, looks: bool = False) -> None:
        self.end: int | None = None
        self._looks, self._seen = looks, SensorMessages()
        self._facts: dict[str, str] = {}
        self._files: dict[str, bytes] = {}
        self._rows = TraceRows()
        self._last = 0
        self._time = SimTime(1)
        self._map: OccupancyGrid | None = None
        self._robot_description = ""
        self._frames: dict[str, Pose3] = {}
        self._types: dict[int, str] = {}
        self._counts = MessageCounts()
        self._handlers: dict[int, Handler] = {}
        self._whose: dict[int, str] = {}
        self.robots: dict[str, LogContents] = {}
        """What is said of each of several robots, by name."""

    def take(self, record: records.McapRecord) -> None:
        """Take in one record."""
        match record:
            case records.Message():
                self._message(record)
            case records.Metadata(name="simscen"):
                self._begin(record.metadata)
            case records.Metadata(name=log_header.END):
                self.end = int(record.metadata["tick"])
                self._counts.expect(record.metadata)
                for name, contents in self.robots.items():
                    contents._counts.expect(record.metadata, name)
            case records.Attachment():
                self._attached(record)
            case records.Schema():
                for contents in (self, *self.robots.values()):
                    contents._types[record.id] = record.name
            case records.Channel():
                self._open(record)
            case _:
                pass  # indices and statistics say nothing new

    def header(self) -> LogHeader:
        """How the run was ordered. Raises Foreign when the log does not say."""
        if self.robots:
            return self._of_several({name: contents.header() for name, contents in self.robots.items()})
        if not self._facts or log_header.CASE not in self._files:
            raise NotSimscenLog("it does not say which run it is of")
        return LogHeader(
            name=self._facts["scenario"],
            seed=int(self._facts["seed"]),
            case=log_header.case_from_json(self._files[log_header.CASE]),
            scenario=str(self._files.get(log_header.SCENARIO, b""), "utf-8"),
            map=self._map,
            robot_description=self._robot_description,
            frames=self._frames,
            files={name: data for name, data in self._files.items() if name not in log_header.OWN_FILES},
            facts=log_header.extra_facts(self._facts),
        )

    def _of_several(self, robots: dict[str, LogHeader]) -> LogHeader:
        first = next(iter(robots.values()))
        text = str(self._files.get(log_header.SCENARIO, b""), "utf-8")
        files = {name: data for name, data in self._files.items() if name not in log_header.OWN_FILES}
        each = {name: replace(one, scenario=text) for name, one in robots.items()}
        return replace(first, scenario=text, files=files, robots=each)

    def trace(self) -> Trace:
        """What happened, until the end of the run or else the last message; of several robots to the first."""
        if self.robots:
            return self.traces()[next(iter(self.robots))]
        return self._rows.trace(self._time.rate, self._last if self.end is None else self.end)

    def traces(self) -> dict[str, Trace]:
        """What happened to each of several robots, by name."""
        for contents in self.robots.values():
            contents.end, contents._last = self.end, max(self._last, contents._last)
        return {name: contents.trace() for name, contents in self.robots.items()}

    def coverage(self) -> LogCoverage:
        """Return which evidence is missing, because the log holds fewer messages than were recorded."""
        return LogCoverage() if self.end is None else self._counts.coverage()

    def seen(self) -> SensorMessages:
        """What no trace holds, where it was asked for."""
        return self._seen

    def result(self) -> str:
        """The result of the run; "" when there is none."""
        return str(self._files.get(log_header.RESULT, b""), "utf-8")

    def _begin(self, facts: dict[str, str]) -> None:
        if facts.get("format") != log_header.FORMAT:
            raise NotSimscenLog(f"its format is {facts.get('format')}, this simscen reads {log_header.FORMAT}")
        self._facts = facts
        self._time = self._seen.time = SimTime(int(facts["tick_rate"]))
        for name in json.loads(facts.get(log_header.ROBOTS, "[]")):
            contents = self.robots[name] = LogContents(self._looks)
            contents._seen.names = frame_names.RobotFrames(name)
            contents._begin({**log_header.robot_metadata(facts, name), log_header.ROBOTS: "[]"})

    def _attached(self, file: records.Attachment) -> None:
        robot, _, name = file.name.partition("/")
        if robot in self.robots and name == log_header.CASE:
            self.robots[robot]._files[name] = file.data
        else:
            self._files[file.name] = file.data

    def _message(self, message: records.Message) -> None:
        if not self._facts:
            raise NotSimscenLog("it has no metadata record `simscen`")
        self._last = self._time.tick(message.log_time)
        self._counts.add(message.channel_id, message.log_time)
        if message.channel_id in self._whose:
            self.robots[self._whose[message.channel_id]]._message(message)
            return
        handler = self._handlers.get(message.channel_id)
        if handler is not None:
            handler(self._last, message.data)

    def _open(self, channel: records.Channel) -> None:
        robot, _, rest = channel.topic[1:].partition("/")
        if robot in self.robots:
            self._whose[channel.id] = robot
            self.robots[robot]._open(replace(channel, topic=f"/{rest}"))
            return
        kind = self._types.get(channel.schema_id, "")
        self._counts.open(channel.id, channel.topic, kind)
        by_topic: dict[tuple[str, str], Handler] = {
            topics.TRUTH[:2]: self._truth,
            topics.CLEARANCE[:2]: lambda tick, data: self._rows.clearance.add(tick, *decode.float64(data)),
            topics.BELIEF[:2]: self._belief,
            topics.COMMAND[:2]: lambda tick, data: self._rows.command.add(tick, *decode.twist(data)),
            topics.PLAN[:2]: self._plan,
            topics.EVENTS[:2]: self._event,
            topics.TF[:2]: self._transforms,
            topics.TF_STATIC[:2]: self._mounts,
            topics.MAP[:2]: self._grid,
            topics.ROBOT_DESCRIPTION[:2]: self._describe,
            ("/odom", topics.ODOMETRY_TYPE): self._odometry,
        }
        handler = by_topic.get((channel.topic, kind))
        if kind == topics.SCAN_TYPE:
            handler = self._scan
        taker = self._seen.taker(channel.topic, kind) if self._looks else None
        if found := [one for one in (handler, taker) if one is not None]:
            self._handlers[channel.id] = found[0] if len(found) == 1 else _call_all(found)

    def _truth(self, tick: int, data: bytes) -> None:
        pose, twist = decode.odometry(data)
        self._rows.truth.add(tick, *pose, *twist)

    def _odometry(self, tick: int, data: bytes) -> None:
        self._rows.odometry.add(tick, *decode.odometry(data)[0])

    def _belief(self, tick: int, data: bytes) -> None:
        pose, covariance = decode.pose_with_covariance(data)
        self._rows.belief.add(tick, *pose, *covariance)

    def _scan(self, tick: int, _: bytes) -> None:
        self._rows.scans.append(tick)

    def _plan(self, _: int, data: bytes) -> None:
        (sec, nanosec), poses = decode.path(data)
        self._rows.plans.append((self._time.tick(sec * NS_PER_SECOND + nanosec), poses))

    def _event(self, _: int, data: bytes) -> None:
        self._rows.events.append(event_text.from_json(decode.string(data)))

    def _transforms(self, tick: int, data: bytes) -> None:
        for link in decode.transforms(data):
            if (name := frame_names.object_in_frame(link.child)) is not None:
                self._rows.object(name).add(tick, *link.pose)

    def _mounts(self, _: int, data: bytes) -> None:
        self._frames = self._seen.mounts = {
            self._seen.names.own(link.child): Pose3(*link.pose) for link in decode.transforms(data)
        }

    def _grid(self, _: int, data: bytes) -> None:
        origin = Pose2(*json.loads(self._facts["map.origin"]))
        self._map = decode.occupancy_grid(data, float(self._facts["map.resolution"]), origin)

    def _describe(self, _: int, data: bytes) -> None:
        self._robot_description = decode.string(data)


def _call_all(handlers: list[Handler]) -> Handler:
    """One handler that hands a message to all of them."""

    def handle(tick: int, data: bytes) -> None:
        for one in handlers:
            one(tick, data)

    return handle
