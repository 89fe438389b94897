"""Tests that the mcap library reads the files of McapWriter: by index, as a stream, and with checksums."""

import io
import random

import pytest
from mcap import records
from mcap.data_stream import RecordBuilder
from mcap.reader import NonSeekingReader, make_reader
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

from simscen.core.geometry import Pose3
from simscen.core.geometry.kinematics import Twist
from simscen.record import topics
from simscen.record.mcap_writer import McapWriter
from simscen.record.messages import message_templates
from simscen.record.publishers.message_sinks import BatchWriter, LogPublisher
from simscen.record.topics import load_message_types

TEXT = load_message_types()["std_msgs/msg/String"]
MESSAGES = [(1 + i % 3, 1000 * (i // 2), random.Random(i).randbytes(300)) for i in range(2000)]


def simscen_file() -> bytes:
    """Return a file of simscen's writer with MESSAGES."""
    stream = io.BytesIO()
    writer = McapWriter(stream, "ros2", "simscen", max_chunk_size=1 << 16)
    channels = [writer.add_channel(f"/t{n}", TEXT, {"key": str(n)}) for n in range(3)]
    writer.add_attachment("a.txt", "text/plain", b"hello")
    writer.add_metadata("facts", {"seed": "7"})
    for number, time, data in MESSAGES:
        channels[number - 1].write(time, data)
    writer.finish()
    return stream.getvalue()


def reference_file() -> bytes:
    """Return a file of the mcap library's writer with the same content."""
    stream = io.BytesIO()
    writer = Writer(stream, chunk_size=1 << 16, compression=CompressionType.ZSTD)
    writer.start("ros2", "simscen")
    schema = writer.register_schema(TEXT.name, "ros2msg", TEXT.definition.encode())
    for n in range(3):
        writer.register_channel(f"/t{n}", "cdr", schema, {"key": str(n)})
    writer.add_attachment(0, 0, "a.txt", "text/plain", b"hello")
    writer.add_metadata("facts", {"seed": "7"})
    for channel, time, data in MESSAGES:
        writer.add_message(channel, time, data, time)
    writer.finish()
    return stream.getvalue()


def test_summary_equals_the_summary_of_the_mcap_library() -> None:
    mine, reference = (make_reader(io.BytesIO(data)).get_summary() for data in (simscen_file(), reference_file()))
    assert mine is not None
    assert reference is not None
    assert mine.statistics == reference.statistics
    assert mine.schemas == reference.schemas
    assert mine.channels == reference.channels
    assert len(mine.chunk_indexes) == len(reference.chunk_indexes)


def test_messages_are_found_through_the_index() -> None:
    reader = make_reader(io.BytesIO(simscen_file()), validate_crcs=True)
    found = [(c.id, m.log_time, m.data) for _, c, m in reader.iter_messages(topics=["/t1"], starting_at=500_000)]
    assert found == [message for message in MESSAGES if message[0] == 2 and message[1] >= 500_000]


def test_messages_stream_in_the_order_they_were_written() -> None:
    reader = NonSeekingReader(io.BytesIO(simscen_file()), validate_crcs=True)
    read = [(c.id, m.log_time, m.data) for _, c, m in reader.iter_messages(log_time_order=False)]
    assert read == MESSAGES


def test_attachments_and_metadata_are_found_through_the_index() -> None:
    reader = make_reader(io.BytesIO(simscen_file()))
    assert [(a.name, a.media_type, a.data) for a in reader.iter_attachments()] == [("a.txt", "text/plain", b"hello")]
    assert [(m.name, m.metadata) for m in reader.iter_metadata()] == [("facts", {"seed": "7"})]


def test_any_changed_byte_in_the_data_is_detected() -> None:
    data = bytearray(simscen_file())
    data[data.index(b"hello")] ^= 1
    with pytest.raises(ValueError, match="crc"):
        list(StreamReader(io.BytesIO(data), validate_crcs=True).records)


def test_chunks_and_their_index_equal_chunks_of_the_mcap_library() -> None:
    data, kinds = simscen_file(), (records.Chunk, records.ChunkIndex, records.MessageIndex)
    packed_records = []
    for record in StreamReader(io.BytesIO(data), emit_chunks=True).records:
        if isinstance(record, kinds):
            builder = RecordBuilder()
            record.write(builder)
            packed_records.append(builder.end())
    assert len(packed_records) > 2 * len(kinds)
    assert all(packed in data for packed in packed_records)


def test_message_larger_than_a_chunk_closes_the_current_chunk() -> None:
    stream = io.BytesIO()
    writer = McapWriter(stream, "ros2", "simscen", max_chunk_size=1000)
    channel = writer.add_channel("/t", TEXT, {})
    payloads = [b"small", random.Random(1).randbytes(10_000), random.Random(2).randbytes(30_000), b"after"]
    for time, data in enumerate(payloads):
        channel.write(time, data)
    writer.finish()
    reader = make_reader(io.BytesIO(stream.getvalue()), validate_crcs=True)
    assert [message.data for _, _, message in reader.iter_messages()] == payloads
    summary = reader.get_summary()
    assert summary is not None
    assert [chunk.message_start_time for chunk in summary.chunk_indexes] == [0, 2, 3]


def test_file_without_messages_is_valid() -> None:
    stream = io.BytesIO()
    writer = McapWriter(stream, "ros2", "simscen")
    writer.add_channel("/t", TEXT, {})
    writer.finish()
    stream.seek(0)
    assert list(make_reader(stream, validate_crcs=True).iter_messages()) == []


def test_the_same_calls_give_the_same_bytes() -> None:
    assert simscen_file() == simscen_file()


def test_batched_messages_have_the_same_bytes_as_single_ones() -> None:
    """Chunks may end between batched messages, and other messages may be written between them."""
    layouts = (topics.TRUTH, message_templates.odometry("map", "base")), (topics.CLEARANCE, message_templates.float64())
    pose, twist = Pose3(1.0, 2.0), Twist(0.5)

    def file_content(is_batched: bool) -> bytes:
        stream = io.BytesIO()
        writer = McapWriter(stream, "ros2", "simscen", max_chunk_size=5000)
        out = LogPublisher(writer)
        block = out.batch_writer(layouts) if is_batched else BatchWriter(out, layouts)
        for time in range(100):
            block.write(time, (time, 0), pose, twist, 0.25)
            if time % 7 == 0:
                out.publish(topics.ROSOUT, time, bytes(time))
        writer.finish()
        return stream.getvalue()

    assert file_content(True) == file_content(False)
    reader = make_reader(io.BytesIO(file_content(True)), validate_crcs=True)
    assert len(list(reader.iter_messages(topics=[topics.CLEARANCE.name], start_time=50))) == 50
