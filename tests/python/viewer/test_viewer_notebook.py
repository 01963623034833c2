"""Objects in the cells of notebooks; the example notebooks run, and the viewer's cell works in a browser."""

import contextlib
import io
import json
import re
import sys
import threading
import time
import warnings
from pathlib import Path

import nbformat
import numpy as np
import PIL.Image
import pytest
from browser import Page
from IPython.core.formatters import DisplayFormatter
from nbclient import NotebookClient

import isospline
from isospline import volumes
from isospline.io import VolumeData
from isospline.viewer.cell import display, still
from isospline.viewer.widget import ViewerWidget

pytestmark = pytest.mark.slow

NOTEBOOKS = sorted((Path(__file__).resolve().parents[3] / "examples").glob("*.ipynb"))


@pytest.fixture
def volume():
    field = volumes.sphere(0.6)
    return field.volume(24)


def outputs(path):
    notebook = nbformat.read(path, as_version=4)
    assert not any(each.get("outputs") for each in notebook.cells)  # committed without outputs
    NotebookClient(notebook, timeout=300, kernel_name="python3").execute()
    return [output for each in notebook.cells for output in each.get("outputs", ())]


@pytest.mark.long
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_example_notebook_runs(path):
    found = outputs(path)
    assert not [output for output in found if output.output_type in ("error", "stream")]
    data = [output.data for output in found if "data" in output]
    if "pictures" in path.stem:
        assert sum("image/png" in each for each in data) == 4
    else:
        assert sum("application/vnd.jupyter.widget-view+json" in each for each in data) == 1


def test_a_surface_has_a_picture(volume):
    """interface/test_one_look.py has those of volumes and scenes."""
    png = isospline.Isosurface(volume, 0.0)._repr_png_()
    pixels = np.asarray(PIL.Image.open(io.BytesIO(png)).convert("RGB")).astype(int)
    differs = (np.abs(pixels - pixels[0, 0]).sum(axis=-1) > 30).mean()
    assert 0.1 < differs < 0.9


def test_an_empty_scene_has_a_picture():
    assert isospline.Scene()._repr_png_().startswith(b"\x89PNG")


def test_a_constant_volume_has_a_picture():
    # All of it is at the level, and so in the solid, which is closed at the border.
    assert isospline.Volume(np.ones((4, 4, 4)))._repr_png_().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    "shown",
    [
        *(isospline.Volume(np.zeros((4, 4, 4)), degree=degree) for degree in (0, 4, 5)),
        VolumeData(np.full((4, 4, 4), np.nan)),
        VolumeData(np.zeros((4, 4))),
        VolumeData(np.zeros((2, 4, 4, 4))),
        VolumeData(np.zeros((4, 4, 4), complex)),
    ],
    ids=repr,
)
def test_what_has_no_picture_is_shown_by_its_text(shown):
    # The oracle is the formatter of notebooks, which would print the error.
    with warnings.catch_warnings(), contextlib.redirect_stderr(io.StringIO()) as errors:
        warnings.simplefilter("error")
        found, _ = DisplayFormatter().format(shown)
    assert list(found) == ["text/plain"] and found["text/plain"] == repr(shown) and not errors.getvalue()


CELL = """<!doctype html><link rel="icon" href="data:,"><body><div id="cell"></div><script type="module">
import widget from "./widget.js";
const {address, ...state} = STATE;
const listeners = new Set(), waiting = [];
const model = {
  get: name => state[name],
  on: (_, listener) => listeners.add(listener),
  off: (_, listener) => listeners.delete(listener),
  send: (content, callbacks, buffers) => {
    socket?.send(JSON.stringify({content, count: buffers.length}));
    for (const buffer of buffers) socket?.send(buffer);
  },
};
const show = () => { window.end = widget.render({model, el: document.getElementById("cell")}); };
const socket = address && new WebSocket(address);
if (!socket) show();
else {
  socket.binaryType = "arraybuffer";
  socket.onopen = show;
  socket.onmessage = ({data}) => {
    if (typeof data === "string") waiting.push(JSON.parse(data));
    const buffers = typeof data === "string" ? [] : [new DataView(data)];
    if (waiting[0].count > buffers.length) return;
    const {content} = waiting.shift();
    for (const listener of listeners) listener(content, buffers);
  };
}
</script>"""


class Notebook:
    """A page with a widget in a cell, and the comm of its kernel: messages pass as in a notebook."""

    def __init__(self, monkeypatch, folder):
        import comm
        import websockets.sync.server

        notebook, self.folder, self.messages, self.connection = self, folder, [], None

        class Comm(comm.base_comm.BaseComm):
            def publish_msg(self, msg_type, data=None, metadata=None, buffers=None, **keys):
                notebook.comm = self
                if msg_type == "comm_msg" and data["method"] == "custom":
                    notebook.tell(data["content"], buffers or [])

        monkeypatch.setattr(comm, "create_comm", Comm)
        self.lock = threading.Lock()
        self.server = websockets.sync.server.serve(self.serve, "127.0.0.1", 0, max_size=None)
        self.thread = threading.Thread(target=self.server.serve_forever)
        self.thread.start()

    @property
    def address(self):
        return f"ws://127.0.0.1:{self.server.socket.getsockname()[1]}/"

    def tell(self, content, buffers):
        with self.lock:
            self.connection.send(json.dumps({"content": content, "count": len(buffers)}))
            for buffer in buffers:
                self.connection.send(bytes(buffer))

    def serve(self, connection):
        self.connection = connection
        for message in connection:
            about = json.loads(message)
            buffers = [memoryview(connection.recv()) for _ in range(about["count"])]
            data = {"method": "custom", "content": about["content"]}
            self.comm.handle_msg({"content": {"data": data}, "buffers": buffers})

    def write(self, widget, address):
        """Write the page; without an address, its notebook has no kernel."""
        state = json.dumps({"address": address, "still": widget.still, "height": widget.height})
        (self.folder / "widget.js").write_text(widget._esm, encoding="utf-8")
        (self.folder / "cell.html").write_text(CELL.replace("STATE", state), encoding="utf-8")

    def close(self):
        self.server.shutdown()
        self.thread.join()


@pytest.fixture
def notebook(monkeypatch, tmp_path):
    notebook = Notebook(monkeypatch, tmp_path)
    yield notebook
    notebook.close()


def test_the_viewer_is_in_the_cell(browser, volume, notebook, tmp_path):
    with isospline.view(volume, browser=False) as viewer, static(tmp_path) as address:
        widget = ViewerWidget(viewer, "", 420)
        notebook.write(widget, notebook.address)
        page = Page(browser, address)
        page.page.wait_for_selector("iframe")
        cell = Cell(page)
        cell.settle()
        assert page.page.locator("iframe").bounding_box()["height"] == 420
        assert cell.pixels().std() > 10

        level = viewer.state.objects[0].level
        viewer.change(lambda state: state.with_object(state.objects[0].id, level=level / 2))
        cell.wait(f"isospline.state.objects[0].level === {level / 2}")
        cell.settle()
        cell.frame.locator("#undo").click()
        cell.wait(f"isospline.state.objects[0].level === {level}")
        assert viewer.state.objects[0].level == level

        # Files arrive in parts, and the page waits while many are on their way.
        samples = np.arange(128 * 128 * 160, dtype=np.float32).reshape(128, 128, 160)
        np.save(tmp_path / "ramp.npy", samples)
        cell.frame.locator("#open").set_input_files(tmp_path / "ramp.npy")
        cell.wait("[...isospline.sources.values()].some(each => each.name === 'ramp.npy')")
        assert cell.evaluate("isospline.socket.bufferedAmount") == 0
        opened = [each.item for each in viewer.document][1]
        np.testing.assert_allclose(opened.sample((3.0, 50.0, 127.0)), samples[127, 50, 3], rtol=1e-4)

        # A page that connects again is one window; one whose window is gone connects again.
        cell.evaluate("isospline.connect()")
        cell.wait("isospline.socket.readyState === 1")
        assert len(viewer.windows()) == 1
        page.evaluate("dispatchEvent(new Event('pagehide'))")
        wait_until(lambda: not viewer.windows())
        cell.evaluate("isospline.send({type: 'undo'})")
        wait_until(lambda: len(viewer.windows()) == 1)
        cell.wait("isospline.socket.readyState === 1")
        viewer.close()
        cell.wait("document.getElementById('messages').innerText.includes('connection')")
        page.close()
        assert not page.problems


def test_the_window_of_a_cell_ends_with_it_and_with_the_notebook(browser, volume, notebook, tmp_path):
    with isospline.view(volume, browser=False) as viewer, static(tmp_path) as address:
        notebook.write(ViewerWidget(viewer, "", 300), notebook.address)
        page = Page(browser, address)
        page.page.wait_for_selector("iframe")
        Cell(page).settle()
        assert len(viewer.windows()) == 1
        page.page.reload()
        page.page.wait_for_selector("iframe")
        Cell(page).settle()
        assert len(viewer.windows()) == 1
        page.evaluate("end()")
        wait_until(lambda: not viewer.windows())
        page.close()


def test_a_notebook_without_a_kernel_has_a_picture(browser, volume, notebook, tmp_path):
    with isospline.view(volume, browser=False) as viewer:
        notebook.write(ViewerWidget(viewer, still(viewer), 300), None)
    with static(tmp_path) as address:
        page = Page(browser, address)
        page.wait("document.querySelector('img')?.naturalWidth === 640")
        assert page.page.locator("iframe").count() == 0
        page.close()
        assert not page.problems


def test_without_anywidget_the_cell_has_a_picture_and_says_how(volume, monkeypatch):
    shown = []
    monkeypatch.setitem(sys.modules, "isospline.viewer.widget", None)
    monkeypatch.setattr("IPython.display.display", shown.append)
    with isospline.view(volume, browser=False) as viewer:
        display(viewer, 300)
    assert re.search(r'src="data:image/png;base64,[\w+/]{1000}', shown[0].data)
    assert "pip install isospline[view]" in shown[0].data


class Cell(Page):
    """The viewer's page in the frame of another page."""

    def __init__(self, page):
        self.page, self.problems = page.page, page.problems
        self.frame = page.page.frames[1]
        self.frame.wait_for_selector("#histogram [data-object]")

    def evaluate(self, expression, argument=None):
        return self.frame.evaluate(expression, argument)

    def messages(self):
        return self.frame.inner_text("#messages")


def wait_until(condition, seconds=20):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


class static:
    """Serves cell.html of a folder."""

    def __init__(self, folder):
        import functools
        import http.server
        import threading

        class Quiet(http.server.SimpleHTTPRequestHandler):
            def log_message(self, *_):
                pass

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=str(folder)))
        self.thread = threading.Thread(target=self.server.serve_forever)

    def __enter__(self):
        self.thread.start()
        return f"http://127.0.0.1:{self.server.server_port}/cell.html"

    def __exit__(self, *_):
        self.server.shutdown()
        self.server.server_close()
        self.thread.join()
