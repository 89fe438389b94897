"""Damages bytes as accidents and attackers do; a function of its random generator alone."""

import random
import re

_NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
NUMBERS = [
    b"0", b"-1", b"1e308", b"-1e-308", b"nan", b"inf", b"-inf", b".nan", b".inf", b"1e400", b"4294967296", b"1e30",
    b"9999999999999999999999", b"0x1F", b"007", b"1_000", b"-0.0", b"1e-12", b"65536", b"1000000", b"", b"1 2 3",
]  # fmt: skip
TOKENS = [
    b"{}", b"[]", b"null", b"~", b"true", b"&a", b"*a", b"<<: *a", b"!!python/object:os.system", b"|", b">", b"---",
    b"...", b"\t", b"\x00", b"\xff", b"\xe2\x80\xae", b"\r", b"#", b": ", b"- ", b"'", b'"', b"?", b"%",
    b"../../etc/passwd",
    b"<![CDATA[", b"]]>", b"<!DOCTYPE a [<!ENTITY b 'c'>]>", b"&b;", b"<a/>", b"</link>", b"<!--", b"<", b">", b"/>",
    b"xmlns='x'", b"${1/0}", b"${9**9**9}", b"$(env HOME)", b"${'a'*10**9}", b"${[].__class__}", b"$(find x)", b"mm",
    b"deg",
    b"/dev/zero", b"http://x", b"model://", b"\xed\xa0\x80", "ü".encode(), b"a" * 5000, b"[" * 300, b"<a>" * 300,
]  # fmt: skip


def mutant(corpus: list[bytes], chance: random.Random) -> tuple[int, bytes]:
    """One of the corpus, by its index, damaged one to six times; of some only numbers, which reaches deeper."""
    index = chance.randrange(len(corpus))
    data = corpus[index]
    ways = _MUTATIONS if chance.random() < 0.6 else (_number,)
    for _ in range(chance.choice((1, 1, 1, 2, 3, 6))):
        data = chance.choice(ways)(data, corpus, chance)
    return index, data[: 1 << 18]


def _span(data: bytes, chance: random.Random) -> tuple[int, int]:
    start = chance.randrange(len(data) + 1)
    return start, min(len(data), start + chance.choice((1, 1, 2, 4, 8, 16, 64, 256)))


def _flip(data: bytes, _: list[bytes], chance: random.Random) -> bytes:
    if not data:
        return data
    at = chance.randrange(len(data))
    return data[:at] + bytes([data[at] ^ (1 << chance.randrange(8))]) + data[at + 1 :]


def _cut(data: bytes, _: list[bytes], chance: random.Random) -> bytes:
    start, end = _span(data, chance)
    return data[:start] + data[end:]


def _end(data: bytes, _: list[bytes], chance: random.Random) -> bytes:
    return data[: chance.randrange(len(data) + 1)]


def _repeat(data: bytes, _: list[bytes], chance: random.Random) -> bytes:
    start, end = _span(data, chance)
    return data[:end] + data[start:end] * chance.choice((1, 1, 2, 10, 100)) + data[end:]


def _insert(data: bytes, _: list[bytes], chance: random.Random) -> bytes:
    at = chance.randrange(len(data) + 1)
    return data[:at] + chance.choice(TOKENS) + data[at:]


def _overwrite(data: bytes, _: list[bytes], chance: random.Random) -> bytes:
    start, end = _span(data, chance)
    return data[:start] + chance.randbytes(end - start) + data[end:]


def _splice(data: bytes, corpus: list[bytes], chance: random.Random) -> bytes:
    other = chance.choice(corpus)
    return data[: _span(data, chance)[0]] + other[_span(other, chance)[0] :]


def _number(data: bytes, _: list[bytes], chance: random.Random) -> bytes:
    found = list(_NUMBER.finditer(data))
    if not found:
        return data
    one = chance.choice(found)
    other = chance.choice(NUMBERS) if chance.random() < 0.5 else f"{chance.uniform(-5, 10):.3g}".encode()
    return data[: one.start()] + other + data[one.end() :]


def _line(data: bytes, corpus: list[bytes], chance: random.Random) -> bytes:
    """Drop, repeat or move a line, or take one from elsewhere."""
    lines = data.split(b"\n")
    at = chance.randrange(len(lines))
    other = chance.choice(chance.choice(corpus).split(b"\n"))
    lines[at : at + 1] = chance.choice(([], [lines[at]] * 2, [other], [lines[at], other], [b"  " + lines[at]]))
    return b"\n".join(lines)


def _word(data: bytes, _: list[bytes], chance: random.Random) -> bytes:
    """Put one word in the place of another, wherever it stands."""
    words = re.findall(rb"\w+", data)
    if not words:
        return data
    return data.replace(chance.choice(words), chance.choice([*words, *NUMBERS, *TOKENS]), chance.choice((1, 1, -1)))


_MUTATIONS = (
    _flip, _cut, _end, _repeat, _insert, _overwrite, _splice, _number, _number, _number, _line, _line, _word, _word,
)  # fmt: skip
