"""When to draw what: the newest state at once and coarse while it changes, then ever finer while it stays."""

from __future__ import annotations

import threading
import time

from .._core import Cancelled

#: Parts of the full resolution, along each side, in which pictures are drawn while something moves.
STEPS = (1.0, 0.75, 0.5, 0.375, 0.25, 0.1875)

# How much of what is known of past frames counts after one more.
_MEMORY = 0.75
# The part of the budget that pixels get even where the rest of a frame takes more than what they leave.
_PIXELS = 0.5
# The part of what pixels have that a finer step may take: the size must not go up and down from frame to frame.
_ROOM = 0.8


class AdaptiveResolution:
    """Chooses the resolution at which a frame takes no longer than a budget.

    A frame of p pixels takes about a + b p seconds. Both are estimated from the frames so far by least squares, the
    newest count most. What is left of the budget decides how many pixels there are; where the fixed part a takes most
    of the budget, coarser pictures would hardly be sooner, and half of it is for pixels in any case. Where the parts
    cannot be told, all of the newest frame is taken for that of its pixels.

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
    >>> resolution.record((500, 400), 0.16)
    >>> resolution.size((1000, 800))
    (250, 200)
    """

    def __init__(self, budget=0.026):
        self._budget = budget
        self._step = STEPS.index(0.5)
        self._sums = [0.0] * 5  # of 1, p, t, p^2 and p t

    @property
    def scale(self):
        """Part of the full resolution, along each side."""
        return STEPS[self._step]

    def size(self, full):
        """Width and height to draw, of a picture of full width and height."""
        return tuple(max(1, round(side * self.scale)) for side in full)

    def record(self, size, seconds):
        """Learn what a frame took, and choose the step of the next one."""
        pixels = float(size[0] * size[1])
        news = (1.0, pixels, seconds, pixels * pixels, pixels * seconds)
        self._sums = [_MEMORY * old + new for old, new in zip(self._sums, news)]
        fixed, each = self._estimate() or (0.0, seconds / pixels)
        left = max(self._budget - fixed, _PIXELS * self._budget)
        full = pixels / self.scale**2 * each
        while self._step < len(STEPS) - 1 and full * self.scale**2 > left:
            self._step += 1
        if self._step > 0 and full * STEPS[self._step - 1] ** 2 < _ROOM * left:
            self._step -= 1

    def _estimate(self):
        """Seconds of a frame without pixels, and of a pixel; None where frames of one size, or noise, do not tell."""
        count, pixels, seconds, squares, products = self._sums
        variance = squares / count - (pixels / count) ** 2
        if variance < 1e-3 * squares / count:
            return None
        each = (products / count - pixels * seconds / count**2) / variance
        fixed = (seconds - each * pixels) / count
        return (fixed, each) if each > 0 and fixed > 0 else None


class FrameScheduler:
    """Draws states on a thread of its own, and knows neither what they are nor how they are drawn.

    Each request is answered by a moving frame of the newest state. A moving frame is never cancelled, or a hand that
    does not rest would never see one; states that come meanwhile are skipped but for the newest. Once a state stays,
    it is drawn in passes, each better than the one before; a request cancels these at once.

    Parameters
    ----------
    draw : callable
        ``draw(state, stage, progress)`` returns a frame. `stage` is None for a moving frame and otherwise one of
        `passes(state)`. A pass that `progress(fraction)` returns False in raises `Cancelled`.
    publish : callable
        ``publish(frame)``; what `draw` returned, if that is not None.
    passes : callable
        ``passes(state)`` returns the stages of a state that stays.
    failed : callable, optional
        ``failed(error)`` is told what `draw` and `publish` raised; the scheduler goes on.
    settle : float
        Seconds without a request after which the passes begin.
    in_flight : int
        Frames that may wait for `acknowledge`; more are not drawn.
    patience : float
        Seconds after which a frame that was not acknowledged counts as lost.
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
        """Draw a state, which is the newest from now on."""
        with self._changed:
            self._state = state
            self._version += 1
            self._requested_at = time.monotonic()
            self._changed.notify_all()

    def acknowledge(self):
        """Tell that a frame has arrived."""
        with self._changed:
            self._in_flight = max(0, self._in_flight - 1)
            self._changed.notify_all()

    def close(self):
        """Cancel what is drawn, and end the thread."""
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
                if self._closed:
                    return
                state, drawn = self._state, self._version
            if self._show(state, None, drawn) and self._wait(drawn):
                self._refine(state, drawn)

    def _wait(self, version):
        """Wait until the state has stayed for a while; False where another one came."""
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
        """Draw and publish a frame; False where it was cancelled or failed."""
        with self._changed:
            arrived = self._changed.wait_for(
                lambda: self._closed or self._in_flight < self._in_flight_limit, self._patience
            )
            if not arrived:
                self._in_flight = 0
            if self._closed:
                return False

        def progress(_):
            return not self._closed and (stage is None or self._version == version)

        try:
            frame = self._draw(state, stage, progress)
            # A refined picture of a state that is no longer the newest would go back in time.
            if frame is None or not progress(1.0):
                return frame is None
            with self._changed:
                self._in_flight += 1
            self._publish(frame)
            return True
        except Cancelled:
            return False
        except Exception as error:
            self._failed(error)
            return False
