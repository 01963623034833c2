"""Wrong guesses of calls, whose errors hold the right ones."""

import contextlib

import pytest


@contextlib.contextmanager
def answered(right_call):
    """The block is a wrong guess; its error holds the right call."""
    with pytest.raises((AttributeError, TypeError, ValueError, ImportError)) as caught:
        yield
    message = str(caught.value)
    assert right_call in message, message
    assert "\n" not in message and len(message) < 400, message
