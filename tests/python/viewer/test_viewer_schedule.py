"""The times and sizes of frames, without a page, a scene or a picture."""

import threading
import time

import pytest

from isospline import Cancelled
from isospline.viewer.schedule import STEPS, AdaptiveResolution, FrameScheduler


def wait_for(condition, seconds=10):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.002)


class Recorder:
    """Records the requests instead of drawing; a pass runs until it is released or cancelled."""

    def __init__(self, passes=(1, 4), hold=False, seconds=0.0, **options):
        self.seconds, self.answers = seconds, []
        self.frames, self.errors, self.cancelled, self.drawing = [], [], [], []
        self.let_go = threading.Event()
        if not hold:
            self.let_go.set()
        options.setdefault("settle", 0.01)
        self.scheduler = FrameScheduler(
            self.draw, self.frames.append, lambda state: passes, failed=self.errors.append, **options
        )

    def draw(self, state, stage, progress):
        self.drawing.append((state, stage))
        time.sleep(self.seconds)
        self.answers.append(progress(0.5))
        if state == "broken":
            raise ValueError("broken state")
        while stage is not None and not self.let_go.wait(0.001):
            if not progress(0.5):
                self.cancelled.append((state, stage))
                raise Cancelled()
        return (state, stage)


@pytest.fixture
def make():
    made = []

    def recorder(*arguments, **options):
        made.append(Recorder(*arguments, **options))
        return made[-1]

    yield recorder
    for each in made:
        each.scheduler.close()


def test_a_state_is_drawn_coarsely_and_then_in_passes(make):
    recorder = make(in_flight=10)
    recorder.scheduler.request("a")
    wait_for(lambda: len(recorder.frames) == 3)
    assert recorder.frames == [("a", None), ("a", 1), ("a", 4)]


def test_a_request_cancels_the_passes_at_once(make):
    recorder = make(hold=True, in_flight=10)
    recorder.scheduler.request("a")
    wait_for(lambda: ("a", 1) in recorder.drawing)
    recorder.scheduler.request("b")
    wait_for(lambda: ("b", None) in recorder.frames)
    assert recorder.cancelled == [("a", 1)]
    assert ("a", 1) not in recorder.frames and ("a", 4) not in recorder.drawing


def test_states_in_between_are_skipped_but_the_newest_is_shown(make):
    recorder = make(passes=(), in_flight=1000, seconds=0.01)
    for number in range(100):
        recorder.scheduler.request(number)
        time.sleep(0.001)
    wait_for(lambda: recorder.frames and recorder.frames[-1] == (99, None))
    shown = [state for state, _ in recorder.frames]
    assert shown == sorted(set(shown)) and len(shown) < 60


def test_a_moving_frame_is_never_cancelled(make):
    """During continuous movement, every started frame is shown."""
    recorder = make(passes=(), in_flight=1000, seconds=0.005)
    for number in range(50):
        recorder.scheduler.request(number)
        time.sleep(0.001)
    wait_for(lambda: recorder.frames and recorder.frames[-1][0] == 49)
    assert all(recorder.answers) and len(recorder.frames) == len(recorder.answers)


def test_frames_wait_for_those_that_have_not_arrived(make):
    recorder = make(passes=(), in_flight=2, patience=60)
    for number in range(4):
        recorder.scheduler.request(number)
        wait_for(lambda number=number: len(recorder.frames) == min(number + 1, 2))
    time.sleep(0.05)
    recorder.scheduler.request("newest")
    time.sleep(0.05)
    assert len(recorder.frames) == 2
    recorder.scheduler.acknowledge()
    wait_for(lambda: len(recorder.frames) == 3)
    assert recorder.frames[-1] == ("newest", None)


def test_the_wait_for_a_silent_window_ends(make):
    recorder = make(passes=(), in_flight=1, patience=0.05)
    recorder.scheduler.request("a")
    wait_for(lambda: recorder.frames)
    recorder.scheduler.request("b")
    wait_for(lambda: len(recorder.frames) == 2)


def test_an_error_is_reported_and_the_next_state_drawn(make):
    recorder = make()
    recorder.scheduler.request("broken")
    wait_for(lambda: recorder.errors)
    recorder.scheduler.request("a")
    wait_for(lambda: ("a", None) in recorder.frames)
    assert [str(error) for error in recorder.errors] == ["broken state"]


def test_errors_of_older_states_are_not_told(make):
    recorder = make(seconds=0.1)
    recorder.scheduler.request("broken")
    wait_for(lambda: ("broken", None) in recorder.drawing)
    recorder.scheduler.request("newest")
    wait_for(lambda: ("newest", 4) in recorder.frames)
    assert recorder.errors == []


def test_closing_ends_a_pass(make):
    others = set(threading.enumerate())
    recorder = make(hold=True)
    recorder.scheduler.request("a")
    wait_for(lambda: ("a", 1) in recorder.drawing)
    recorder.scheduler.close()
    assert set(threading.enumerate()) <= others and ("a", 1) not in recorder.frames


@pytest.mark.parametrize("fixed", [0.0, 0.01, 0.02])
@pytest.mark.parametrize("pixel", [2e-9, 4e-8, 2e-7])
def test_the_resolution_holds_the_budget(rng, fixed, pixel):
    budget, full = 0.035, (1200, 800)
    resolution = AdaptiveResolution(budget)
    scales = []
    for _ in range(60):
        width, height = resolution.size(full)
        resolution.record((width, height), (fixed + pixel * width * height) * rng.uniform(0.95, 1.05))
        scales.append(resolution.scale)

    def seconds(scale):
        return fixed + pixel * scale**2 * full[0] * full[1]

    settled = scales[30:]
    for scale in settled:
        assert seconds(scale) < 1.1 * max(budget, fixed + budget / 2) or scale == STEPS[-1]
        if scale < 1:  # no coarser than necessary: one step finer would come near the budget
            finer = STEPS[STEPS.index(scale) - 1]
            assert seconds(scale) * (finer / scale) ** 2 > 0.7 * budget
    assert len(set(settled)) <= 2


def test_the_resolution_follows_a_change_of_cost():
    resolution, full = AdaptiveResolution(0.035), (1000, 1000)

    def settle(pixel):
        for _ in range(20):
            size = resolution.size(full)
            resolution.record(size, pixel * size[0] * size[1])
        return resolution.scale

    assert settle(1e-8) == 1.0
    assert settle(1e-6) == STEPS[-1]
    assert settle(1e-8) == 1.0
