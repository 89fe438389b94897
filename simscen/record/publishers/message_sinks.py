"""Message sinks, the destinations of published messages, and writers of messages that are published together."""

from collections.abc import Sequence
from typing import Any, Protocol

from simscen.record.mcap_writer import MESSAGE_HEADER_BYTES, Channel, McapWriter
from simscen.record.messages.template import Slot, Template, compile_writer, field_names
from simscen.record.topics import CLOCK, Topic, load_message_types, qos

Layouts = Sequence[tuple[Topic, Template]]
"""Pairs of a topic and the template of its messages."""


class MessageSink(Protocol):
    """Destination of published messages, such as a log or an external stack."""

    def publish(self, topic: Topic, time: int, data: bytes) -> None:
        """Publish a serialized message at `time` nanoseconds."""
        ...

    def batch_writer(self, layouts: Layouts) -> "BatchWriter":
        """Return a fast writer for messages that are always published together."""
        ...


class BatchWriter:
    """Writer of one message on each of several topics. Fields with equal names have the same value in all messages."""

    def __init__(self, sink: MessageSink, layouts: Layouts) -> None:
        self._sink = sink
        fields = field_names([part for _, message in layouts for part in message.parts])
        self._messages = [
            (topic, message.packer(), [fields.index(name) for name in field_names(message.parts)])
            for topic, message in layouts
        ]

    def write(self, time: int, *fields: Any) -> None:
        """Write all messages at `time` nanoseconds. `fields` are the values of the `field_names` of all layouts."""
        for topic, pack, indices in self._messages:
            self._sink.publish(topic, time, pack(*[fields[index] for index in indices]))


class LogPublisher:
    """Message sink that writes to a log. The first message on a topic opens the topic's channel.

    `robot` is the name of the robot if the log has several robots. All topics except /clock are in its namespace.
    """

    def __init__(self, writer: McapWriter, robot: str = "") -> None:
        self._writer, self._namespace = writer, f"/{robot}" if robot else ""
        self._channels: dict[str, Channel] = {}
        self.flush_if_due = writer.flush_if_due

    def publish(self, topic: Topic, time: int, data: bytes) -> None:
        """Write a serialized message at `time` nanoseconds."""
        self.channel(topic).write(time, data)

    def batch_writer(self, layouts: Layouts) -> BatchWriter:
        """Return a fast writer for messages that are always published together."""
        return _ChunkBatchWriter(self, layouts)

    def channel(self, topic: Topic) -> Channel:
        """Return the channel of a topic, and open it if necessary."""
        channel = self._channels.get(topic.name)
        if channel is None:
            name = topic.name if topic == CLOCK else self._namespace + topic.name
            message_type = load_message_types()[topic.type]
            metadata = {"offered_qos_profiles": qos(topic.latched), "topic_type_hash": message_type.hash}
            channel = self._channels[topic.name] = self._writer.add_channel(name, message_type, metadata)
        return channel


class _ChunkBatchWriter(BatchWriter):
    """BatchWriter that packs all messages into the current chunk with one call if the chunk has enough space."""

    def __init__(self, publisher: LogPublisher, layouts: Layouts) -> None:
        super().__init__(publisher, layouts)
        self._publisher, self._layouts = publisher, layouts
        self._size = 0
        self._offsets: list[tuple[Channel, int]] = []
        """Channel of each message, and offset of the message in the batch in bytes."""

    def write(self, time: int, *fields: Any) -> None:
        if not self._offsets:
            super().write(time, *fields)
            self._compile_layout()
            return
        chunk = self._chunk
        start = chunk.size
        end = start + self._size
        if end > chunk.max_size:
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
            parts += channel.record_parts(message)
            self._offsets.append((channel, self._size))
            self._size += MESSAGE_HEADER_BYTES + len(message.buffer)
            self._chunk = channel.chunk
        self._pack = compile_writer(tuple(parts))
