"""Values that are invalid for all parameters, and some that a few accept."""

import numpy as np


class OwnError(Exception):
    """The exception of an object that is converted to an array."""


class BadArray:
    """Raises if it is converted to an array."""

    def __array__(self, dtype=None, copy=None):
        raise OwnError


class LyingArray:
    """Converts to an object that is not an array."""

    def __array__(self, dtype=None, copy=None):
        return "no array"


class BadLength:
    """A sequence whose length raises."""

    def __len__(self):
        raise OwnError

    def __getitem__(self, index):
        raise OwnError


class BadNumber:
    """Raises if it is converted to a number."""

    def __float__(self):
        raise OwnError

    __index__ = __int__ = __bool__ = __float__


def _read_only(array):
    array.setflags(write=False)
    return array


#: Functions, so that a case does not see changes by another one.
VALUES = [
    lambda rng: None,
    lambda rng: True,
    lambda rng: float("nan"),
    lambda rng: float("inf"),
    lambda rng: -float("inf"),
    lambda rng: 0,
    lambda rng: -1,
    lambda rng: 1,
    lambda rng: 3,
    lambda rng: -(2**31),
    lambda rng: 2**63,
    lambda rng: -(2**63) - 1,
    lambda rng: 10**400,
    lambda rng: 0.5,
    lambda rng: -0.0,
    lambda rng: 1e308,
    lambda rng: 5e-324,
    lambda rng: -1e-30,
    lambda rng: 1j,
    lambda rng: "",
    lambda rng: "nonsense",
    lambda rng: "\0",
    lambda rng: "\udce9",
    lambda rng: b"bytes",
    lambda rng: [],
    lambda rng: {},
    lambda rng: (),
    lambda rng: [None],
    lambda rng: [[1, 2], [3]],
    lambda rng: {"a": 1},
    lambda rng: {-1: None},
    lambda rng: object(),
    lambda rng: BadArray(),
    lambda rng: LyingArray(),
    lambda rng: BadLength(),
    lambda rng: BadNumber(),
    lambda rng: lambda *_: (_ for _ in ()).throw(OwnError),
    lambda rng: len,
    lambda rng: int,
    lambda rng: range(3),
    lambda rng: iter([1, 2]),
    lambda rng: np.zeros(0),
    lambda rng: np.zeros((0, 3)),
    lambda rng: np.zeros((0, 6)),
    lambda rng: np.zeros((3, 0, 6)),
    lambda rng: np.zeros(3),
    lambda rng: np.full(3, np.nan),
    lambda rng: np.ones(6),
    lambda rng: np.full((2, 3), np.inf),
    lambda rng: np.ones((4, 4)),
    lambda rng: np.eye(4) * 1e300,
    lambda rng: np.eye(4) * 1e-300,
    lambda rng: np.eye(3),
    lambda rng: np.array(5),
    lambda rng: np.array("text"),
    lambda rng: np.array([None, 1]),
    lambda rng: np.zeros(3, complex),
    lambda rng: np.zeros(3, "M8[s]"),
    lambda rng: np.zeros(2, [("a", "f4"), ("b", "i2")]),
    lambda rng: np.zeros((2, 6), ">f8"),
    lambda rng: np.ones((6, 4)).T,
    lambda rng: np.ones((4, 12))[::2, ::2],
    lambda rng: np.ones((4, 6))[::-1],
    lambda rng: _read_only(np.ones((2, 6))),
    lambda rng: np.full((2, 6), 1e38),
    lambda rng: np.full((2, 6), 1e-45),
    lambda rng: np.broadcast_to(1.0, (5, 6)),
    lambda rng: np.ma.masked_array(np.ones(6), [0, 1, 0, 0, 0, 0]),
    lambda rng: np.ma.masked_array(np.ones((2, 3)), True),
    lambda rng: np.ones((2, 3), np.float16),
    lambda rng: np.ones((2, 6), np.longdouble),
    lambda rng: np.zeros((1, 1, 1)),
    lambda rng: np.zeros((2, 2, 2, 2)),
    lambda rng: np.zeros((3, 4, 5), bool),
    lambda rng: np.arange(60.0).reshape(3, 4, 5),
    lambda rng: np.arange(60, dtype=">u2").reshape(3, 4, 5),
    lambda rng: np.full((3, 4, 5), 1e308),
    lambda rng: np.full((3, 4, 5), 2**63, np.uint64),
    lambda rng: np.array([[0, 1, 2**40]]),
    lambda rng: np.array([[0, 1, -1]]),
    lambda rng: np.array([[0, 1, 2**63]], np.uint64),
    lambda rng: (1, 2, 3),
    lambda rng: (0, 0, 0),
    lambda rng: (10**6, 10**6),
    lambda rng: (10**10, 1),
    lambda rng: (0, 5),
    lambda rng: (4, 4),
    lambda rng: rng.random(),
    lambda rng: rng.uniform(-1e6, 1e6),
    lambda rng: rng.randrange(-5, 5),
    lambda rng: np.frombuffer(b"\1" * 49, np.uint8)[1:].view("f8"),
    lambda rng: memoryview(b"123456"),
]
