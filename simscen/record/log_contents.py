"""Conversion of the MCAP records of a log to its contents: header, trace (signals and events), and sensor messages."""

import json
from collections.abc import Callable
from dataclasses import replace

from mcap import records

from simscen.core.clock import Clock
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose2, Pose3
from simscen.core.records.trace import Trace
from simscen.core.records.verdict import LogCoverage
from simscen.record import frame_names, log_header, topics
from simscen.record.log_header import LogHeader
from simscen.record.message_counts import MessageCounts
from simscen.record.messages import decode, event_text
from simscen.record.messages.decode import MessageReader
from simscen.record.sensor_messages import SensorMessages
from simscen.record.trace_builder import TraceRows

_MERGED_LOG_REASON = "; a log that was merged from several logs cannot be judged"
"""End of the error message for a record that exists twice."""

Handler = Callable[[int, bytes], None]
"""Function that processes a message. Its arguments are the tick of logging and the serialized message."""


class NotSimscenLog(ValueError):
    """The MCAP file is valid but was not recorded by simscen."""


class LogContents:
    """Collects the records of a log. Methods raise ValueError or KeyError if the log is damaged.

    If `with_sensors` is True, `sensors` also collects the messages that are not part of a Trace.
    """

    def __init__(self, with_sensors: bool = False) -> None:
        self.end: int | None = None
        """Tick of the end of the run; None if the log has no end record."""
        self.sensors = SensorMessages()
        self.stack: dict[str, str] = {}
        """Facts about the external stack, as in stack.json. With several robots, each key starts with `ROBOT.`."""
        self.robots: dict[str, LogContents] = {}
        """Contents of each robot by name; empty for a single robot."""
        self._with_sensors = with_sensors
        self._metadata: dict[str, str] = {}
        self._files: dict[str, bytes] = {}
        self._rows = TraceRows()
        self._last_tick = 0
        self._clock = Clock(1)
        self._map: OccupancyGrid | None = None
        self._robot_description = ""
        self._mounts: dict[str, Pose3] = {}
        self._types_by_schema: dict[int, str] = {}
        self._counts = MessageCounts()
        self._handlers_by_channel: dict[int, list[Handler]] = {}
        self._robots_by_channel: dict[int, str] = {}

    def add(self, record: records.McapRecord) -> None:
        """Process one record. Records must be added in the order of the file."""
        match record:
            case records.Message():
                self._add_message(record)
            case records.Metadata(name=log_header.RUN_RECORD):
                self._set_metadata(record.metadata)
            case records.Metadata(name=log_header.END_RECORD):
                if self.end is not None:
                    raise ValueError(f"it has two metadata records `{log_header.END_RECORD}`{_MERGED_LOG_REASON}")
                self.end = int(record.metadata["tick"])
                self._counts.set_expected(record.metadata)
                for name, contents in self.robots.items():
                    contents._counts.set_expected(record.metadata, name)
            case records.Metadata(name=log_header.STACK_RECORD):
                self._set_stack(record.metadata)
            case records.Attachment():
                self._add_attachment(record)
            case records.Schema():
                for contents in (self, *self.robots.values()):
                    contents._types_by_schema[record.id] = record.name
            case records.Channel():
                self._add_channel(record)
            case _:
                pass  # indexes and statistics

    def header(self) -> LogHeader:
        """Return the header of the log. Raises NotSimscenLog if the log has no header."""
        scenario = str(self._files.get(log_header.SCENARIO_FILE, b""), "utf-8")
        files = {name: data for name, data in self._files.items() if name not in log_header.RESERVED_FILES}
        if self.robots:
            if unknown := [name for name in self._files if name.endswith(f"/{log_header.CASE_FILE}")]:
                raise ValueError(f"it has {unknown[0]}, but its list of robots is {', '.join(self.robots)}")
            robots = {name: replace(robot.header(), scenario=scenario) for name, robot in self.robots.items()}
            return replace(next(iter(robots.values())), files=files, robots=robots)
        if not self._metadata or log_header.CASE_FILE not in self._files:
            raise NotSimscenLog("it has no description of its run")
        return LogHeader(
            name=self._metadata["scenario"],
            seed=int(self._metadata["seed"]),
            case=log_header.case_from_json(self._files[log_header.CASE_FILE]),
            scenario=scenario,
            map=self._map,
            robot_description=self._robot_description,
            mounts=self._mounts,
            files=files,
            facts=log_header.extra_facts(self._metadata),
        )

    def trace(self) -> Trace:
        """Return the Trace of the robot, or of the first one of several robots.

        If the run was aborted, the Trace ends with the last message.
        """
        if self.robots:
            return self.traces()[next(iter(self.robots))]
        trace = self._rows.trace(self._clock.rate, self._last_tick if self.end is None else self.end)
        if len(trace.truth) and (last := trace.truth.ticks[-1]) > trace.end:
            raise ValueError(f"the ground truth lasts until tick {last}, but the run ended at tick {trace.end}")
        return trace

    def traces(self) -> dict[str, Trace]:
        """Return the Trace of each robot by name; empty for a single robot."""
        for contents in self.robots.values():
            contents.end, contents._last_tick = self.end, max(self._last_tick, contents._last_tick)
        return {name: contents.trace() for name, contents in self.robots.items()}

    def coverage(self) -> LogCoverage:
        """Return which evidence the log lacks because messages were removed after the recording.

        The log of an aborted run has no message counts. No evidence counts as missing in it.
        """
        return LogCoverage() if self.end is None else self._counts.coverage()

    def result(self) -> str:
        """Return the result of the run as JSON; "" if the log has no result."""
        return str(self._files.get(log_header.RESULT_FILE, b""), "utf-8")

    def _set_metadata(self, metadata: dict[str, str]) -> None:
        """Process the metadata record "simscen". If it lists several robots, create the contents of each robot."""
        if metadata.get("format") != log_header.FORMAT_VERSION:
            raise NotSimscenLog(
                f"its format is {metadata.get('format')}, this simscen reads {log_header.FORMAT_VERSION}"
            )
        if self._metadata:
            raise ValueError(f"it has two metadata records `simscen`{_MERGED_LOG_REASON}")
        self._metadata = metadata
        self._clock = self.sensors.clock = Clock(int(metadata["tick_rate"]))
        names = json.loads(metadata.get(log_header.ROBOTS_KEY, "[]"))
        if not isinstance(names, list) or len({name for name in names if isinstance(name, str)}) < len(names):
            raise ValueError(f"its list of robots is {metadata[log_header.ROBOTS_KEY]}")
        for name in names:
            contents = self.robots[name] = LogContents(self._with_sensors)
            contents.sensors.frames = frame_names.RobotFrames(name)
            contents._set_metadata({**log_header.robot_metadata(metadata, name), log_header.ROBOTS_KEY: "[]"})

    def _set_stack(self, facts: dict[str, str]) -> None:
        if self.stack:
            raise ValueError(f"it has two metadata records `{log_header.STACK_RECORD}`{_MERGED_LOG_REASON}")
        self.stack = facts
        for name, contents in self.robots.items():
            contents.stack = log_header.stack_facts(facts, name)

    def _add_attachment(self, file: records.Attachment) -> None:
        robot, _, name = file.name.partition("/")
        is_case = robot in self.robots and name == log_header.CASE_FILE
        files, name = (self.robots[robot]._files, name) if is_case else (self._files, file.name)
        if name in files:
            raise ValueError(f"it has two attachments {file.name}{_MERGED_LOG_REASON}")
        files[name] = file.data

    def _add_message(self, message: records.Message) -> None:
        if not self._metadata:
            raise NotSimscenLog("it has no metadata record `simscen`")
        self._last_tick = self._clock.tick_at(message.log_time)
        self._counts.add_message(message.channel_id, message.log_time)
        if message.channel_id in self._robots_by_channel:
            self.robots[self._robots_by_channel[message.channel_id]]._add_message(message)
            return
        for handler in self._handlers_by_channel.get(message.channel_id, ()):
            handler(self._last_tick, message.data)

    def _add_channel(self, channel: records.Channel) -> None:
        robot, _, topic_of_robot = channel.topic[1:].partition("/")
        if robot in self.robots:
            self._robots_by_channel[channel.id] = robot
            self.robots[robot]._add_channel(replace(channel, topic=f"/{topic_of_robot}"))
            return
        message_type = self._types_by_schema.get(channel.schema_id, "")
        self._counts.add_channel(channel.id, channel.topic, message_type)
        handlers_by_topic: dict[tuple[str, str], Handler] = {
            topics.TRUTH[:2]: self._add_truth,
            topics.CLEARANCE[:2]: self._add_clearance,
            topics.BELIEF[:2]: self._add_belief,
            topics.COMMAND[:2]: self._add_command,
            topics.PLAN[:2]: self._add_plan,
            topics.EVENTS[:2]: self._add_event,
            topics.TF[:2]: self._add_object_poses,
            topics.TF_STATIC[:2]: self._set_mounts,
            topics.MAP[:2]: self._set_map,
            topics.ROBOT_DESCRIPTION[:2]: self._set_robot_description,
            ("/odom", topics.ODOMETRY_TYPE): self._add_odometry,
        }
        key = channel.topic, message_type
        handlers = [self._add_scan if message_type == topics.SCAN_TYPE else handlers_by_topic.get(key)]
        if self._with_sensors:
            handlers.append(self._add_log_line if key == topics.ROSOUT[:2] else self.sensors.handler(*key))
        self._handlers_by_channel[channel.id] = [handler for handler in handlers if handler is not None]

    def _add_truth(self, tick: int, data: bytes) -> None:
        odometry = decode.odometry(MessageReader(data))
        if self._clock.tick_at(odometry.stamp) != tick:
            raise ValueError(f"the log time of a message of {topics.TRUTH.name} differs from its stamp")
        self._rows.truth.add(tick, *odometry.pose, *(odometry.twist or ()))

    def _add_clearance(self, tick: int, data: bytes) -> None:
        self._rows.clearance.add(tick, *MessageReader(data).take("d"))

    def _add_odometry(self, tick: int, data: bytes) -> None:
        self._rows.odometry.add(tick, *decode.odometry(MessageReader(data)).pose)

    def _add_belief(self, tick: int, data: bytes) -> None:
        belief = decode.pose_with_covariance_stamped(MessageReader(data))
        self._rows.belief.add(tick, *belief.pose, *belief.covariance)

    def _add_command(self, tick: int, data: bytes) -> None:
        self._rows.command.add(tick, *decode.twist(MessageReader(data)).values)

    def _add_scan(self, tick: int, _: bytes) -> None:
        self._rows.scans.append(tick)

    def _add_plan(self, _: int, data: bytes) -> None:
        path = decode.path(MessageReader(data))
        self._rows.plans.append((self._clock.tick_at(path.stamp), path.poses))

    def _add_event(self, tick: int, data: bytes) -> None:
        event = event_text.from_json(MessageReader(data).string())
        if not 0 <= event.tick <= tick:
            raise ValueError(f"an event has the tick {event.tick}, but was logged at tick {tick}")
        self._rows.events.append(event)

    def _add_object_poses(self, tick: int, data: bytes) -> None:
        for link in decode.transforms(MessageReader(data)):
            if (name := frame_names.object_of_frame(link.child)) is not None:
                self._rows.object(name).add(tick, *link.pose)

    def _add_log_line(self, tick: int, data: bytes) -> None:
        self.sensors.log_lines.append((tick, data))

    def _set_mounts(self, _: int, data: bytes) -> None:
        self._mounts = self.sensors.mounts = {
            self.sensors.frames.stack_frame(link.child): Pose3(*link.pose)
            for link in decode.transforms(MessageReader(data))
        }

    def _set_map(self, _: int, data: bytes) -> None:
        grid = decode.occupancy_grid(MessageReader(data))[1]
        origin = Pose2(*json.loads(self._metadata[log_header.ORIGIN_KEY]))  # exact, unlike the numbers in the message
        self._map = OccupancyGrid(grid.cells, float(self._metadata[log_header.RESOLUTION_KEY]), origin)

    def _set_robot_description(self, _: int, data: bytes) -> None:
        self._robot_description = MessageReader(data).string()
