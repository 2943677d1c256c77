# SPDX-License-Identifier: GPL-3.0-or-later
"""Ways to spoil a file. Each takes its bytes and a random generator, and returns other bytes."""

import json
from collections.abc import Callable

import numpy as np

Mutation = Callable[[bytes, np.random.Generator], bytes]

# Where formats keep sizes, counts and offsets.
HEADER_SIZE = 512

NUMBERS = (0, 1, -1, 2**15, 2**31 - 1, 2**31, 2**32 - 1, 2**40, 2**62, 2**63 - 1, 2**64 - 1)
VALUES = (np.nan, np.inf, -np.inf, 0.0, -0.0, -1.0, 1e300, -1e300, 5e-324)
TEXTS = (
    "",
    "\0",
    '"; system("touch /tmp/x"); "',
    "\n}\nshader evil() { }\n/*",
    "../../../etc/passwd",
    "${diffuse} %s {0}",
    "\u202e\ufeff",
    "x" * 100_000,
)


def truncated(content: bytes, rng: np.random.Generator) -> bytes:
    """The beginning of the file, often of its header only."""
    end = HEADER_SIZE if rng.random() < 0.3 else len(content)
    return content[: rng.integers(0, min(end, len(content)) + 1)]


def extended(content: bytes, rng: np.random.Generator) -> bytes:
    """With noise, or a copy of itself, behind it."""
    return content + (rng.bytes(rng.integers(1, 4096)) if rng.random() < 0.8 else content)


def flipped(content: bytes, rng: np.random.Generator) -> bytes:
    """Some bytes anywhere replaced."""
    data = bytearray(content)
    for place in rng.integers(0, max(len(data), 1), rng.integers(1, 64)):
        data[place : place + 1] = rng.bytes(1)
    return bytes(data)


def flipped_in_header(content: bytes, rng: np.random.Generator) -> bytes:
    """A few bytes of the first half kilobyte replaced."""
    return flipped(content[:HEADER_SIZE], rng) + content[HEADER_SIZE:]


def other_number(content: bytes, rng: np.random.Generator) -> bytes:
    """A whole number in the header replaced by one that claims too much, or nothing."""
    size = int(rng.choice([1, 2, 4, 8]))
    number = NUMBERS[rng.integers(len(NUMBERS))] % 2 ** (8 * size)
    place = int(rng.integers(0, min(HEADER_SIZE, len(content)) + 1))
    return content[:place] + number.to_bytes(size, "little") + content[place + size :]


def other_values(content: bytes, rng: np.random.Generator) -> bytes:
    """A stretch of the data, or all of it, filled with NaN, infinities, zeros or extremes."""
    dtype = np.dtype(str(rng.choice(["<f2", "<f4", "<f8"])))
    with np.errstate(over="ignore"):
        value = np.array(VALUES[rng.integers(len(VALUES))]).astype(dtype).tobytes()
    start = int(rng.integers(0, len(content) + 1)) // 8 * 8 if rng.random() < 0.5 else HEADER_SIZE
    count = (len(content) - start) // len(value)
    count = count if rng.random() < 0.5 else int(rng.integers(0, max(count, 0) + 1))
    filled = value * max(count, 0)
    return content[:start] + filled + content[start + len(filled) :]


def rearranged(content: bytes, rng: np.random.Generator) -> bytes:
    """A stretch cut out, doubled, or moved elsewhere."""
    a, b, c = np.sort(rng.integers(0, len(content) + 1, 3))
    return (
        content[:a] + content[b:],
        content[:b] + content[a:b] + content[b:],
        content[:a] + content[b:c] + content[a:b] + content[c:],
    )[rng.integers(3)]


def noise(content: bytes, rng: np.random.Generator) -> bytes:
    """The first bytes of the file and then noise, or nothing but noise."""
    kept = int(rng.choice([0, 8, 64]))
    return content[:kept] + rng.bytes(int(rng.integers(0, 65536)))


def other_json(content: bytes, rng: np.random.Generator) -> bytes:
    """A node of the document replaced, removed, doubled or nested."""
    document = json.loads(content)
    holder, key = _random_node(document, rng)
    pick = rng.integers(7)
    if pick == 0:
        del holder[key]
    elif pick == 1:
        holder[key] = TEXTS[rng.integers(len(TEXTS))]
    elif pick == 2:
        holder[key] = NUMBERS[rng.integers(len(NUMBERS))] * int(rng.choice([1, 10**30]))
    elif pick == 3:
        holder[key] = VALUES[rng.integers(len(VALUES))]
    elif pick == 4:
        holder[key] = [holder[key], holder[key]]
    elif pick == 5:
        holder[key] = (None, True, {}, [], [[]])[rng.integers(5)]
    elif isinstance(holder, dict):
        holder[TEXTS[rng.integers(len(TEXTS))]] = holder[key]
    return json.dumps(document).encode()


def nested_json(content: bytes, rng: np.random.Generator) -> bytes:
    """Brackets without end in the place of a value, as against a recursive parser."""
    depth = int(10 ** rng.uniform(2, 5.5))
    opening = b"[" if rng.random() < 0.5 else b'{"a":'
    return content.replace(b"[", opening * depth, 1)


def _random_node(document: dict, rng: np.random.Generator) -> tuple[dict | list, str | int]:
    """Container and key of a value somewhere in the document."""
    holder: dict | list = document
    while True:
        keys = list(holder) if isinstance(holder, dict) else range(len(holder))
        key = keys[rng.integers(len(keys))]
        below = holder[key]
        if not isinstance(below, dict | list) or not below or rng.random() < 0.4:
            return holder, key
        holder = below


BINARY = (
    *(truncated, extended, flipped, flipped_in_header, flipped_in_header, other_number),
    *(other_number, other_number, other_values, other_values, rearranged, noise),
)
JSON = (other_json, other_json, other_json, other_json, nested_json, truncated, flipped, rearranged)


def mutated(content: bytes, is_json: bool, rng: np.random.Generator) -> tuple[bytes, list[str]]:
    """The file after one to three mutations, and their names."""
    names = []
    for number in range(rng.integers(1, 4)):
        # what is no document any more cannot be taken for one
        kinds = JSON if is_json and number == 0 else BINARY
        mutation: Mutation = kinds[rng.integers(len(kinds))]
        names.append(mutation.__name__)
        content = mutation(content, rng)
    return content, names
