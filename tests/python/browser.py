"""A page of the viewer in a real Chromium, and the actions of tests."""

import base64
import contextlib
import io
import os
import shutil
import time

import numpy as np
import PIL.Image

#: The window. Its picture has 220 columns beside the panel, so that its passes take less than a tenth of a second.
SIZE = (500, 220)


@contextlib.contextmanager
def chromium():
    """The browser of the system. One that does not start is an error."""
    from playwright.sync_api import sync_playwright

    names = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
    path = next(filter(None, map(shutil.which, names)), None)
    if path is None:
        raise RuntimeError("the tests of the viewer need Chromium, which make test installs: see tests/packages.txt")
    # Libraries that are preloaded for the module under test, such as a sanitizer, must not be in the browser.
    preloaded = os.environ.pop("LD_PRELOAD", None)
    with contextlib.ExitStack() as stack:
        try:
            playwright = stack.enter_context(sync_playwright())
            browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"], env=dict(os.environ))
        finally:
            if preloaded is not None:
                os.environ["LD_PRELOAD"] = preloaded
        stack.callback(browser.close)
        yield browser


@contextlib.contextmanager
def shown(browser, source, size=SIZE, **options):
    """A viewer of a source and its page, when it has settled; errors in the page fail at the end."""
    import isospline

    with isospline.view(source, browser=False, **options) as viewer:
        page = Page(browser, viewer.url, size)
        page.settle()
        yield page, viewer
        page.close()
        assert not page.problems


class Page:
    """A window with the viewer's page. An error in it ends the test, unless it contains one of the `expected` texts."""

    def __init__(self, browser, url, size=SIZE, expected=()):
        self.page = browser.new_page()
        self.page.emulate_media(reduced_motion="reduce")  # what moves would be found where it is not yet
        self.page.set_viewport_size({"width": size[0], "height": size[1]})
        self.problems = []
        self.expected = expected
        self.page.on("pageerror", lambda error: self.add_problem(str(error)))
        self.page.on("console", lambda line: line.type == "error" and self.add_problem(line.text))
        self.page.goto(url)

    def add_problem(self, text):
        if not any(each in text for each in self.expected):
            self.problems.append(text)

    def evaluate(self, expression, argument=None):
        return self.page.evaluate(expression, argument)

    def wait(self, expression, seconds=60):
        """Wait until something is true in the page."""
        end = time.monotonic() + seconds
        messages = set()  # the page removes them after some seconds
        # One call for both, and few of them: each takes milliseconds of three processes.
        both = f"[!!({expression}), document.getElementById('messages')?.innerText]"
        while not (found := self.evaluate(both))[0]:
            messages.add(found[1])
            assert not self.problems, self.problems
            assert time.monotonic() < end, f"waited in vain for {expression}; messages: {messages}"
            time.sleep(0.05)

    def settle(self):
        """Wait for the last pass over the newest state; a camera is sent at the next refresh of the screen."""
        self.wait("!isospline.cameraWaits && isospline.frame?.final && isospline.frame.input === isospline.inputs")

    def messages(self):
        return self.page.inner_text("#messages")

    def open(self, section):
        self.evaluate(f"document.getElementById('{section}').open = true")

    def drag(self, begin, end, steps=12, button="left"):
        mouse = self.page.mouse
        mouse.move(*begin)
        mouse.down(button=button)
        for step in range(1, steps + 1):
            mouse.move(*(a + (b - a) * step / steps for a, b in zip(begin, end)))
            time.sleep(0.016)
        mouse.up(button=button)

    def drag_element(self, selector, offset, steps=12):
        box = self.page.locator(selector).bounding_box()
        middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        self.drag(middle, (middle[0] + offset[0], middle[1] + offset[1]), steps)

    def pixels(self):
        """The displayed picture."""
        data = self.evaluate("document.getElementById('picture').toDataURL('image/png').split(',')[1]")
        return np.asarray(PIL.Image.open(io.BytesIO(base64.b64decode(data))).convert("RGB"))

    def download(self, selector):
        """The name and the contents of the file that a button saves."""
        with self.page.expect_download(timeout=120_000) as download:
            self.page.locator(selector).click()
        with open(download.value.path(), "rb") as file:
            return download.value.suggested_filename, file.read()

    def close(self):
        self.page.close()
