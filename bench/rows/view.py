"""The viewer in a browser: from a change in the page to its picture on the screen."""

import contextlib
import shutil
import statistics
import time

import numpy as np
from suite.goal import at_least, at_most
from suite.peers import Skipped
from suite.tables import markdown_table

import isospline

TITLE = "The viewer: from the mouse to the picture"
ABOUT = """`isospline.view` in Chromium without a window, both on this machine with all its cores; the page has 1280 x
800 pixels. The mouse moves 60 times a second for three seconds: it drags the level in the histogram, orbits, and moves
a cut. *Latency* is the time from the page's message to the first picture that shows its change, decoded and drawn, by
the page's own clock; changes that a newer one replaced have none. *Scale* is the fraction of the full resolution, along
each side, that was drawn meanwhile. *Still* is the time from the end of a move to the picture in full quality. The
transparent surface is the first one, around another one inside it. Levels of whole numbers move in whole steps, so
there are fewer changes to draw. The browser draws in software here, and so uses a part of the cores."""
SETTINGS = ("size",)
SECONDS, WINDOW = 3.0, {"width": 1280, "height": 800}
TRANSPARENT = "orbit, transparent"
GOALS = [
    ("from a move of the hand to its picture, median", "at most 50 ms"),
    ("pictures a second while the hand moves", "at least 25 pictures/s"),
    ("scale of pictures while the hand moves", "at least 0.5"),
    ("still of an opaque surface", "at most 2 s"),
    ("still of a surface inside a transparent one", "at most 4 s"),
]


def measure(settings):
    isospline.set_thread_count(0)
    with chromium() as browser:
        for subject in settings.subjects():
            volume = isospline.Volume(subject.data, **subject.grid)
            with isospline.view(volume, levels=[subject.level], browser=False) as viewer:
                page = browser.new_page(viewport=WINDOW)
                page.goto(viewer.url)
                settle(page)
                moves = {"level": drag_level(page), "orbit": orbit(page), "cut": drag_cut(page)}
                inside_another(viewer, (subject.level + subject.data.max()) / 2)
                settle(page)
                moves[TRANSPARENT] = orbit(page)
                page.close()
            yield {"subject": subject.name, "threads": isospline.thread_count(), "moves": moves}


@contextlib.contextmanager
def chromium():
    try:
        from playwright.sync_api import sync_playwright
    except ImportError as error:
        raise Skipped("no playwright: pip install playwright") from error
    names = ("chromium", "google-chrome", "chromium-headless-shell")
    path = next(filter(None, map(shutil.which, names)), None)
    if path is None:
        raise Skipped("no chromium")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        try:
            yield browser
        finally:
            browser.close()


def settle(page, seconds=120):
    """Wait until the newest state has been drawn at full quality."""
    end = time.monotonic() + seconds
    while not page.evaluate("!!isospline.frame?.final && isospline.frame.input === isospline.inputs"):
        if time.monotonic() > end:
            raise RuntimeError("the viewer shows no picture: " + page.inner_text("#messages"))
        time.sleep(0.05)


def inside_another(viewer, level):
    """Show a surface at this level inside the first one, which becomes transparent, without the cut."""

    def change(state):
        first = state.objects[0]
        state = state.with_object(first.id, opacity=0.4).with_new_object(first.source, float(level))
        return state.replace(clip=state.clip.replace(kind="none"))

    viewer.change(change)
    time.sleep(0.5)  # until the page knows of it


def orbit(page):
    return drag(page, (400, 400), (700, 330))


def drag_level(page):
    box = page.locator("#histogram [data-object]").bounding_box()
    place = (box["x"] + box["width"] / 2, box["y"] + 40)
    return drag(page, place, (place[0] + 30, place[1]))


def drag_cut(page):
    page.evaluate("document.getElementById('cut').open = true")
    page.get_by_role("button", name="Plane").click()
    settle(page)
    box = page.locator("[data-handle='move the plane']").bounding_box()
    place = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    return drag(page, place, (place[0] + 40, place[1] - 20))


def drag(page, begin, end):
    """Move back and forth between two points, and return what the page has shown meanwhile."""
    page.evaluate("""() => {
        isospline.latencies = [];
        window.shown = [];
        isospline.listeners.shown = [about => shown.push([performance.now(), about.samples, about.size[0]])];
    }""")
    page.mouse.move(*begin)
    page.mouse.down()
    start = time.monotonic()
    while (now := time.monotonic() - start) < SECONDS:
        part = (1 - np.cos(2 * np.pi * now / SECONDS)) / 2
        page.mouse.move(*(a + (b - a) * part for a, b in zip(begin, end)))
        time.sleep(max(0.0, 1 / 60 - (time.monotonic() - start - now)))
    latencies, shown = page.evaluate("[isospline.latencies, shown]")
    page.mouse.up()
    end = time.monotonic()
    settle(page)
    still = time.monotonic() - end
    full = page.evaluate("isospline.frame.size[0]")
    moving = [each for each in shown if each[1] == 0]
    return {
        "milliseconds": statistics.median(latencies),
        "slow_milliseconds": float(np.percentile(latencies, 95)),
        "rate": (len(moving) - 1) / (moving[-1][0] - moving[0][0]) * 1e3,
        "scale": statistics.median(each[2] for each in moving) / full,
        "still": still,
    }


def values(results, key, moves=("level", "orbit", "cut")):
    named = {(result["subject"], move): each[key] for result in results for move, each in result["moves"].items()}
    return {f"{subject}, {move}": value for (subject, move), value in named.items() if move in moves}


def goals(results):
    return [
        at_most(GOALS[0][0], 50, values(results, "milliseconds"), "ms"),
        at_least(GOALS[1][0], 25, values(results, "rate"), "pictures/s"),
        at_least(GOALS[2][0], 0.5, values(results, "scale"), ""),
        at_most(GOALS[3][0], 2, values(results, "still"), "s"),
        at_most(GOALS[4][0], 4, values(results, "still", [TRANSPARENT]), "s"),
    ]


def table(results):
    rows = [
        (
            result["subject"],
            move,
            *(each[key] for key in ("milliseconds", "slow_milliseconds", "rate", "scale", "still")),
        )
        for result in results
        for move, each in result["moves"].items()
    ]
    return markdown_table(
        ("volume", "move", "latency, ms", "95 of 100 within, ms", "pictures/s", "scale", "still, s"), rows
    )
