"""Tests of message templates: CDR alignment, packing, and reading."""

import struct

import numpy as np
import pytest

from simscen.record.messages.decode import MessageReader, particle_cloud
from simscen.record.messages.template import Template, compile_packer


def test_alignment_is_counted_after_the_header() -> None:
    message = Template()
    message.put("B", 1)
    message.put("d", 1.0)
    assert bytes(message.buffer) == b"\0\1\0\0" + b"\1" + bytes(7) + struct.pack("<d", 1.0)


def test_string_length_includes_the_terminating_nul() -> None:
    message = Template()
    message.string("añ")
    assert bytes(message.buffer[4:]) == b"\4\0\0\0a\xc3\xb1\0"


def test_packer_writes_fields_and_keeps_constants() -> None:
    message = Template()
    message.slot("iI", "*stamp")
    message.string("map")
    message.put("2d", 0.0, 0.0)
    message.slot("d8xd", "*ends")
    pack = message.packer()
    first, second = pack((1, 2), (0.5, 1.5)), pack((3, 4), (2.5, 3.5))
    assert len(first) == len(message.buffer)
    assert first[12:] == bytes(message.buffer[12:])[:-24] + struct.pack("<3d", 0.5, 0.0, 1.5)
    assert second[12:-24] == first[12:-24]
    reader = MessageReader(second)
    assert reader.take("iI") == (3, 4)
    assert reader.string() == "map"
    assert reader.take("5d") == (0.0, 0.0, 2.5, 0.0, 3.5)


def test_fields_with_the_same_name_are_one_argument() -> None:
    first, second = Template(prefix=b""), Template(prefix=b"")
    first.slot("d", "value")
    second.slot("i", "count")
    second.slot("d", "value")
    assert compile_packer((*first.parts, *second.parts))(0.5, 7) == struct.pack("<di4xd", 0.5, 7, 0.5)


def test_reader_reads_messages_of_the_template() -> None:
    message = Template()
    message.put("B", 7)
    message.string("odom")
    message.put("3d", 1.0, -0.0, 1e-300)
    reader = MessageReader(bytes(message.buffer))
    assert reader.take("B") == (7,)
    assert reader.string() == "odom"
    assert reader.array("f8", (3,)).tolist() == [1.0, 0.0, 1e-300]


def test_truncated_message_is_an_error() -> None:
    message = Template()
    message.put("I", 5)
    data = bytes(message.buffer)
    with pytest.raises(ValueError, match="ends before"):
        MessageReader(data).take("d")
    with pytest.raises(ValueError, match="ends before"):
        MessageReader(data).string()
    with pytest.raises(ValueError, match="ends before"):
        MessageReader(data).array("i1", (9, 9))


def test_arrays_are_read_without_a_copy() -> None:
    cells = MessageReader(b"\0\1\0\0" + bytes(range(6))).array("i1", (2, 3))
    assert np.array_equal(cells, np.arange(6).reshape(2, 3))
    assert not cells.flags.owndata


def test_an_empty_particle_cloud_is_read() -> None:
    message = Template().put("iI", 0, 0).string("map").put("I", 0)
    assert particle_cloud(MessageReader(bytes(message.buffer))).shape == (0, 8)
