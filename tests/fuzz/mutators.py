"""Random changes of a file's bytes: bits, lengths, numbers in its text."""

import re

NUMBERS = [
    b"0",
    b"-1",
    b"1",
    b"2",
    b"255",
    b"65536",
    b"2147483647",
    b"2147483648",
    b"-2147483648",
    b"4294967295",
    b"9223372036854775807",
    b"99999999999999999999999",
    b"1e999",
    b"-1e999",
    b"nan",
    b"inf",
    b"1e-320",
    b"0.5",
    b"",
    b"x",
    b"1" * 400,
]
WORDS = [b"raw", b"gzip", b"ascii", b"LIST", b"LOCAL", b"%d", b"double", b"short", b"big", b"3", b"a" * 5000, b"\0"]
INTEGERS = [0, 1, 0x7F, 0x80, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF]


def flip_bits(rng, content, other):
    for _ in range(rng.choice((1, 1, 1, 2, 8))):
        content[rng.randrange(len(content))] ^= 1 << rng.randrange(8)
    return content


def set_bytes(rng, content, other):
    at = rng.randrange(len(content))
    length = rng.choice((1, 2, 4, 8, 16))
    content[at : at + length] = bytes(rng.randrange(256) for _ in content[at : at + length])
    return content


def set_integer(rng, content, other):
    length = rng.choice((2, 4, 8))
    at = rng.randrange(max(1, len(content) - length))
    value = rng.choice(INTEGERS) % (1 << 8 * length)
    content[at : at + length] = value.to_bytes(length, rng.choice(("little", "big")))
    return content


def truncate(rng, content, other):
    return content[: rng.randrange(len(content))]


def extend(rng, content, other):
    return content + bytes(rng.randrange(256) for _ in range(rng.choice((1, 4, 100))))


def remove(rng, content, other):
    at = rng.randrange(len(content))
    return content[:at] + content[at + rng.choice((1, 2, 4, 32, 500)) :]


def repeat(rng, content, other):
    at, length = rng.randrange(len(content)), rng.choice((1, 4, 32, 500))
    return content[:at] + content[at : at + length] * rng.choice((2, 2, 100)) + content[at + length :]


def splice(rng, content, other):
    at, begin, length = rng.randrange(len(content)), rng.randrange(len(other)), rng.choice((4, 32, 500))
    content[at : at + length] = other[begin : begin + length]
    return content


def replace_number(rng, content, other):
    return _replace(rng, content, rb"-?\d+(\.\d+)?", NUMBERS)


def replace_word(rng, content, other):
    return _replace(rng, content, rb"[A-Za-z]{2,}", WORDS)


def swap_lines(rng, content, other):
    lines = bytes(content).split(b"\n")
    i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
    if rng.random() < 0.3:
        lines.insert(i, lines[j])
    lines[i], lines[j] = lines[j], lines[i]
    return bytearray(b"\n".join(lines))


def _replace(rng, content, pattern, values):
    """Replace a match of the pattern, near the beginning as a rule, where the header is."""
    found = list(re.finditer(pattern, bytes(content[: rng.choice((400, 4000, 100_000))])))
    if not found:
        return flip_bits(rng, content, None)
    match = rng.choice(found)
    return content[: match.start()] + rng.choice(values) + content[match.end() :]


#: Changes of any bytes, and changes of text.
BYTES = [flip_bits, flip_bits, set_bytes, set_integer, truncate, extend, remove, repeat, splice]
TEXT = [replace_number, replace_number, replace_number, replace_word, swap_lines]


def mutate(rng, content, other, begin=0):
    """A changed copy; bytes before `begin` are not changed."""
    kept, changed = content[:begin], bytearray(content[begin:])
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        mutator = rng.choice(BYTES if begin else BYTES + TEXT)
        changed = bytearray(mutator(rng, changed or bytearray(1), other))
    return kept + bytes(changed)
