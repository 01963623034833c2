"""Scheduling of frames: a changing state is drawn at once and coarsely, then refined when it stops changing."""

from __future__ import annotations

import threading
import time

from .._core import Cancelled

#: Fractions of the full resolution, along each side, at which pictures are drawn during movement.
STEPS = (1.0, 0.75, 0.625, 0.5, 0.4375, 0.375, 0.3125, 0.25, 0.1875)

# The weight of past frames after each new one.
_MEMORY = 0.85
# The past does not count if a frame takes more than this many times as long as expected, or is as much faster.
_SURPRISE = 2.0
# The part of a frame's time that does not depend on its size, as long as frames do not tell.
_FIXED = 0.3
# Pixels get at least this fraction of the budget, however long the rest of a frame takes.
_PIXELS = 0.5
# A finer step may use only this fraction of the pixels' budget, so that the size does not alternate between frames.
_ROOM = 0.9


class AdaptiveResolution:
    """Chooses the resolution at which a frame takes no longer than a budget.

    A frame of p pixels takes about a + b p seconds. Both are estimated from past frames by weighted least squares; the
    newest frames have the largest weights. The number of pixels follows from the budget less a. If a takes most of
    the budget, coarser pictures would hardly be faster, so pixels get at least half of the budget. If a and b cannot be
    separated, a is taken for a fixed part of the time.

    Parameters
    ----------
    budget : float
        Seconds that a frame may take.

    Examples
    --------
    >>> from isospline.viewer.schedule import AdaptiveResolution
    >>> resolution = AdaptiveResolution(budget=0.04)
    >>> resolution.size((1000, 800))
    (500, 400)
    >>> resolution.record((500, 400), 0.08)
    >>> resolution.size((1000, 800))
    (250, 200)
    """

    def __init__(self, budget=0.0385):
        self._budget = budget
        self._step = STEPS.index(0.5)
        self._sums = [0.0] * 5  # of 1, p, t, p^2 and p t

    @property
    def scale(self):
        """The fraction of the full resolution, along each side."""
        return STEPS[self._step]

    def size(self, full):
        """Width and height of the frame to draw for a picture of full width and height."""
        return tuple(max(1, round(side * self.scale)) for side in full)

    def record(self, size, seconds):
        """Record the time of a frame, and choose the step of the next one."""
        pixels = float(size[0] * size[1])
        news = [1.0, pixels, seconds, pixels * pixels, pixels * seconds]
        if self._sums[0] and self._is_expected(pixels, seconds):
            self._sums = [_MEMORY * old + new for old, new in zip(self._sums, news)]
        else:
            self._sums = news
        fixed, each = self._estimate()
        left = max(self._budget - fixed, _PIXELS * self._budget)
        full = pixels / self.scale**2 * each
        while self._step < len(STEPS) - 1 and full * self.scale**2 > left:
            self._step += 1
        if self._step > 0 and full * STEPS[self._step - 1] ** 2 < _ROOM * left:
            self._step -= 1

    def _is_expected(self, pixels, seconds):
        """Whether a frame takes about as long as past ones tell."""
        fixed, each = self._estimate()
        expected = fixed + each * pixels
        return expected / _SURPRISE < seconds < expected * _SURPRISE

    def _estimate(self):
        """Seconds per frame without pixels, and per pixel."""
        count, pixels, seconds, squares, products = self._sums
        variance = squares / count - (pixels / count) ** 2
        if variance >= 1e-3 * squares / count:
            each = (products / count - pixels * seconds / count**2) / variance
            fixed = (seconds - each * pixels) / count
            if each > 0 and fixed > 0:
                return fixed, each
        return _FIXED * seconds / count, (1 - _FIXED) * seconds / pixels


class FrameScheduler:
    """Draws states on its own thread. It makes no assumption about the states or how they are drawn.

    Each request is answered by a moving frame of the newest state. A moving frame is never cancelled, because
    continuous movement would then never show one. Of the states that arrive meanwhile, only the newest is drawn. Once a
    state stops changing, it is drawn in passes of increasing quality. A new request cancels these at once.

    Parameters
    ----------
    draw : callable
        ``draw(state, stage, progress)`` returns a frame. `stage` is None for a moving frame and otherwise one of
        `passes(state)`. `draw` raises `Cancelled` if `progress(fraction)` returns False.
    publish : callable
        ``publish(frame)`` gets the result of `draw`, unless that is None.
    passes : callable
        ``passes(state)`` returns the stages of a state that no longer changes.
    failed : callable, optional
        ``failed(error)`` gets the errors that `draw` and `publish` raise for the newest state; the scheduler continues.
    settle : float
        Seconds without a request after which the passes begin.
    in_flight : int
        The largest number of frames that wait for `acknowledge`; further ones are not drawn.
    patience : float
        Seconds after which a frame without acknowledgement counts as lost.
    """

    def __init__(self, draw, publish, passes, *, failed=None, settle=0.12, in_flight=2, patience=2.0):
        self._draw, self._publish, self._passes = draw, publish, passes
        self._failed = failed or (lambda error: None)
        self._settle, self._in_flight_limit, self._patience = settle, in_flight, patience
        self._changed = threading.Condition()
        self._state = None
        self._version = 0
        self._requested_at = 0.0
        self._in_flight = 0
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="isospline-frames", daemon=True)
        self._thread.start()

    def request(self, state):
        """Draw a state, which is now the newest."""
        with self._changed:
            self._state = state
            self._version += 1
            self._requested_at = time.monotonic()
            self._changed.notify_all()

    def acknowledge(self):
        """Acknowledge that a frame has arrived."""
        with self._changed:
            self._in_flight = max(0, self._in_flight - 1)
            self._changed.notify_all()

    def close(self):
        """Cancel drawing, and end the thread."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        if threading.current_thread() is not self._thread:
            self._thread.join()

    def _run(self):
        drawn = 0
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._closed or self._version != drawn)
                self._wait_for_room()  # before the state is read: newer ones may arrive meanwhile
                if self._closed:
                    return
                state, drawn = self._state, self._version
            if self._show(state, None, drawn) and self._wait(drawn):
                self._refine(state, drawn)

    def _wait_for_room(self):
        """Wait until another frame may be in flight; the lock is held."""
        arrived = self._changed.wait_for(
            lambda: self._closed or self._in_flight < self._in_flight_limit, self._patience
        )
        if not arrived:
            self._in_flight = 0

    def _wait(self, version):
        """Wait until the state has not changed for a while; False if another one arrived."""
        with self._changed:
            rest = self._requested_at + self._settle - time.monotonic()
            return not self._changed.wait_for(lambda: self._closed or self._version != version, max(0.0, rest))

    def _refine(self, state, version):
        try:
            for stage in self._passes(state):
                if not self._show(state, stage, version):
                    return
        except Exception as error:
            self._failed(error)

    def _show(self, state, stage, version):
        """Draw and publish a frame; False if it was cancelled or failed."""
        with self._changed:
            self._wait_for_room()
            if self._closed:
                return False

        def progress(_):
            return not self._closed and (stage is None or self._version == version)

        try:
            frame = self._draw(state, stage, progress)
            # A refined picture of an old state must not replace a newer one.
            if frame is None or not progress(1.0):
                return frame is None
            with self._changed:
                self._in_flight += 1
            self._publish(frame)
            return True
        except Cancelled:
            return False
        except Exception as error:
            with self._changed:  # what an older state shows may have been closed
                is_newest = self._version == version
            if is_newest:
                self._failed(error)
            return False
