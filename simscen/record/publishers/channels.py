"""Where messages go: into a log, or to a stack that is told them."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

from simscen.record.mcap_writer import MESSAGE_HEADER_BYTES, Channel, McapWriter, MessageType, load
from simscen.record.messages.cdr import Slot, Template, compile_writer, field_names
from simscen.record.topics import CLOCK, Topic, qos

Write = Callable[[int, bytes], None]
"""Takes a message at a time in nanoseconds."""

Layouts = Sequence[tuple[Topic, Template]]


class MessageSink(Protocol):
    """Takes messages."""

    def publish(self, topic: Topic, time: int, data: bytes) -> None:
        """Take a message at `time` nanoseconds."""
        ...

    def line(self, topic: Topic) -> "TopicWriter":
        """For a topic on which much is written."""
        ...

    def together(self, messages: Layouts) -> "BatchWriter":
        """For messages of which much is written, always at one time, one behind the other."""
        ...


class TopicWriter:
    """What takes the messages of one topic with `write`; the channel of a log is opened by the first."""

    def __init__(self, begin: Callable[[], Write]) -> None:
        self._begin = begin
        self.write: Write = self._first

    def _first(self, time: int, data: bytes) -> None:
        self.write = self._begin()
        self.write(time, data)


class BatchWriter:
    """Packs messages that always come at one time. Fields that are called alike are the same in all of them."""

    def __init__(self, out: MessageSink, messages: Layouts) -> None:
        self._out = out
        fields = field_names([part for _, message in messages for part in message.parts])
        self._each = [
            (topic, message.packer(), [fields.index(name) for name in field_names(message.parts)])
            for topic, message in messages
        ]

    def write(self, time: int, *fields: Any) -> None:
        """Write all of them at `time` nanoseconds; the fields are in the order in which they come first."""
        for topic, pack, own in self._each:
            self._out.publish(topic, time, pack(*[fields[index] for index in own]))


class LogPublisher:
    """Opens a channel the first time something is published on its topic."""

    def __init__(self, writer: McapWriter) -> None:
        self._writer = writer
        self._types: Mapping[str, MessageType] = load()
        self._channels: dict[str, Channel] = {}

    def publish(self, topic: Topic, time: int, data: bytes) -> None:
        """Write a message at `time` nanoseconds."""
        self.channel(topic).write(time, data)

    def line(self, topic: Topic) -> TopicWriter:
        """For a topic on which much is written."""
        return TopicWriter(lambda: self.channel(topic).write)

    def together(self, messages: Layouts) -> BatchWriter:
        """For messages of which much is written, always at one time, one behind the other."""
        return _ChunkBatchWriter(self, messages)

    def settle(self) -> None:
        """Nothing comes for a while."""
        self._writer.settle()

    def channel(self, topic: Topic) -> Channel:
        """The channel of a topic."""
        channel = self._channels.get(topic.name)
        if channel is None:
            kind = self._types[topic.type]
            metadata = {"offered_qos_profiles": qos(topic.latched), "topic_type_hash": kind.hash}
            channel = self._channels[topic.name] = self._writer.channel(topic.name, kind, metadata)
        return channel


class _ChunkBatchWriter(BatchWriter):
    """Packs all messages in one call, as records of a chunk; where they do not all fit into it, one by one."""

    def __init__(self, out: LogPublisher, messages: Layouts) -> None:
        super().__init__(out, messages)
        self._publisher, self._messages = out, messages
        self._room = 0
        self._places: list[tuple[Channel, int]] = []

    def write(self, time: int, *fields: Any) -> None:
        if not self._places:
            super().write(time, *fields)
            self._lay_out()
            return
        chunk = self._chunk
        at = chunk.size
        end = at + self._room
        if end > chunk.limit:
            super().write(time, *fields)
            return
        self._pack(chunk.view, at, time, *fields)
        chunk.size = end
        for channel, offset in self._places:
            channel.entries += (time, at + offset)

    def _lay_out(self) -> None:
        parts: list[bytes | Slot] = []
        for topic, message in self._messages:
            channel = self._publisher.channel(topic)
            parts += channel.record(message)
            self._places.append((channel, self._room))
            self._room += MESSAGE_HEADER_BYTES + len(message.buffer)
            self._chunk = channel.chunk
        self._pack = compile_writer(tuple(parts))


class NamespacedPublisher:
    """Takes the messages of one of several robots: its topics are in its namespace, as in Nav2's bringup of several.

    There is one clock for all.
    """

    def __init__(self, out: LogPublisher, robot: str) -> None:
        self._out, self._robot = out, robot

    def publish(self, topic: Topic, time: int, data: bytes) -> None:
        """Take a message at `time` nanoseconds."""
        self._out.publish(self._named(topic), time, data)

    def line(self, topic: Topic) -> TopicWriter:
        """For a topic on which much is written."""
        return self._out.line(self._named(topic))

    def together(self, messages: Layouts) -> BatchWriter:
        """For messages of which much is written, always at one time, one behind the other."""
        return self._out.together([(self._named(topic), message) for topic, message in messages])

    def settle(self) -> None:
        """Nothing comes for a while."""
        self._out.settle()

    def _named(self, topic: Topic) -> Topic:
        return topic if topic == CLOCK else topic._replace(name=f"/{self._robot}{topic.name}")
