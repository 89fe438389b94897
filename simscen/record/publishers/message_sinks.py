"""Message sinks, the destinations of published messages: a log, or the namespace of a robot in a log.

TopicWriter and BatchWriter are faster interfaces to a sink, for topics with many messages.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

from simscen.record.mcap_writer import MESSAGE_HEADER_BYTES, Channel, McapWriter
from simscen.record.messages.template import Slot, Template, compile_writer, field_names
from simscen.record.topics import CLOCK, MessageType, Topic, load_message_types, qos

Write = Callable[[int, bytes], None]
"""Function (time in ns, bytes) that writes a serialized message."""

Layouts = Sequence[tuple[Topic, Template]]
"""Topics with the templates of their messages."""


class MessageSink(Protocol):
    """Destination of published messages, such as a log or an external stack."""

    def publish(self, topic: Topic, time: int, data: bytes) -> None:
        """Publish a serialized message at `time` nanoseconds."""
        ...

    def topic_writer(self, topic: Topic) -> "TopicWriter":
        """Return a fast writer for a topic with many messages."""
        ...

    def batch_writer(self, layouts: Layouts) -> "BatchWriter":
        """Return a fast writer for messages that are always published together."""
        ...


class TopicWriter:
    """Writer of the messages of one topic. The attribute `write` is the function that writes a message.

    `open_topic` is called before the first message, and returns the function that writes messages.
    """

    def __init__(self, open_topic: Callable[[], Write]) -> None:
        self._open_topic = open_topic
        self.write: Write = self._first

    def _first(self, time: int, data: bytes) -> None:
        """Open the topic, and write its first message."""
        self.write = self._open_topic()
        self.write(time, data)


class BatchWriter:
    """Writer of one message on each of several topics. Fields with equal names have the same value in all messages."""

    def __init__(self, out: MessageSink, layouts: Layouts) -> None:
        self._out = out
        fields = field_names([part for _, message in layouts for part in message.parts])
        self._messages = [
            (topic, message.packer(), [fields.index(name) for name in field_names(message.parts)])
            for topic, message in layouts
        ]

    def write(self, time: int, *fields: Any) -> None:
        """Write all messages at `time` nanoseconds. `fields` are the values of the `field_names` of all layouts."""
        for topic, pack, indices in self._messages:
            self._out.publish(topic, time, pack(*[fields[index] for index in indices]))


class LogPublisher:
    """Message sink that writes to a log. The first message on a topic opens the topic's channel."""

    def __init__(self, writer: McapWriter) -> None:
        self._writer = writer
        self._types: Mapping[str, MessageType] = load_message_types()
        self._channels: dict[str, Channel] = {}

    def publish(self, topic: Topic, time: int, data: bytes) -> None:
        """Write a serialized message at `time` nanoseconds."""
        self.channel(topic).write(time, data)

    def topic_writer(self, topic: Topic) -> TopicWriter:
        """Return a fast writer for a topic with many messages."""
        return TopicWriter(lambda: self.channel(topic).write)

    def batch_writer(self, layouts: Layouts) -> BatchWriter:
        """Return a fast writer for messages that are always published together."""
        return _ChunkBatchWriter(self, layouts)

    def flush_if_due(self) -> None:
        """Write the buffered messages to the file if there are enough."""
        self._writer.flush_if_due()

    def channel(self, topic: Topic) -> Channel:
        """Return the channel of a topic, and open it if necessary."""
        channel = self._channels.get(topic.name)
        if channel is None:
            kind = self._types[topic.type]
            metadata = {"offered_qos_profiles": qos(topic.latched), "topic_type_hash": kind.hash}
            channel = self._channels[topic.name] = self._writer.channel(topic.name, kind, metadata)
        return channel


class _ChunkBatchWriter(BatchWriter):
    """BatchWriter that packs all messages directly into the current chunk with one call, if they fit."""

    def __init__(self, out: LogPublisher, layouts: Layouts) -> None:
        super().__init__(out, layouts)
        self._publisher, self._layouts = out, layouts
        self._size = 0
        self._offsets: list[tuple[Channel, int]] = []

    def write(self, time: int, *fields: Any) -> None:
        if not self._offsets:
            super().write(time, *fields)
            self._compile_layout()
            return
        chunk = self._chunk
        start = chunk.size
        end = start + self._size
        if end > chunk.limit:
            super().write(time, *fields)
            return
        self._pack(chunk.view, start, time, *fields)
        chunk.size = end
        for channel, offset in self._offsets:
            channel.entries += (time, start + offset)

    def _compile_layout(self) -> None:
        """Generate the function that packs all messages, after their channels have been opened."""
        parts: list[bytes | Slot] = []
        for topic, message in self._layouts:
            channel = self._publisher.channel(topic)
            parts += channel.record(message)
            self._offsets.append((channel, self._size))
            self._size += MESSAGE_HEADER_BYTES + len(message.buffer)
            self._chunk = channel.chunk
        self._pack = compile_writer(tuple(parts))


class NamespacedPublisher:
    """Message sink that writes the messages of a robot to a log, in the namespace `/ROBOT` (except /clock)."""

    def __init__(self, out: LogPublisher, robot: str) -> None:
        self._out, self._robot = out, robot

    def publish(self, topic: Topic, time: int, data: bytes) -> None:
        """Write a serialized message at `time` nanoseconds."""
        self._out.publish(self._with_namespace(topic), time, data)

    def topic_writer(self, topic: Topic) -> TopicWriter:
        """Return a fast writer for a topic with many messages."""
        return self._out.topic_writer(self._with_namespace(topic))

    def batch_writer(self, layouts: Layouts) -> BatchWriter:
        """Return a fast writer for messages that are always published together."""
        return self._out.batch_writer([(self._with_namespace(topic), message) for topic, message in layouts])

    def flush_if_due(self) -> None:
        """Write the buffered messages to the file if there are enough."""
        self._out.flush_if_due()

    def _with_namespace(self, topic: Topic) -> Topic:
        """Return the topic in the namespace of the robot."""
        return topic if topic == CLOCK else topic._replace(name=f"/{self._robot}{topic.name}")
