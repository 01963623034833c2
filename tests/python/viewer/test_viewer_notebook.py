"""Objects in the cells of notebooks; the example notebooks run, and the viewer's cell works in a browser."""

import io
import re
from pathlib import Path

import nbformat
import numpy as np
import PIL.Image
import pytest
from browser import Page, chromium
from nbclient import NotebookClient

import isospline
from isospline import volumes
from isospline.viewer.cell import cell

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
        (page,) = (each["text/html"] for each in data if "text/html" in each)
        assert "data:image/png;base64," in page and "iframe" in page


@pytest.mark.parametrize("kind", ["Volume", "Isosurface", "Scene"])
def test_objects_have_pictures(volume, kind):
    surface = isospline.Isosurface(volume, 0.0)
    item = {"Volume": volume, "Isosurface": surface, "Scene": isospline.Scene([surface])}[kind]
    pixels = np.asarray(PIL.Image.open(io.BytesIO(item._repr_png_())).convert("RGB")).astype(int)
    differs = (np.abs(pixels - pixels[0, 0]).sum(axis=-1) > 30).mean()
    assert 0.1 < differs < 0.9


def test_an_empty_scene_has_a_picture():
    assert isospline.Scene()._repr_png_().startswith(b"\x89PNG")


def test_a_constant_volume_has_a_picture():
    # All of it is at the level, and so in the solid, which is closed at the border.
    assert isospline.Volume(np.ones((4, 4, 4)))._repr_png_().startswith(b"\x89PNG")


def test_the_cell_is_alive_with_a_viewer_and_a_picture_without(volume, tmp_path):
    with chromium() as browser:
        with isospline.view(volume, browser=False) as viewer:
            content = cell(viewer, 300)
            (tmp_path / "cell.html").write_text(f"<!doctype html><body>{content}</body>", encoding="utf-8")
            # Notebooks are pages of a server on this machine. For browsers, localhost and 127.0.0.1 are different
            # sites: a frame has no cookie there, and needs the token in its address, also if it is reloaded.
            with static(tmp_path) as address:
                for place in (address, address.replace("127.0.0.1", "localhost")):
                    page = Page(browser, place)
                    page.page.wait_for_selector("iframe")
                    frame = page.page.frame_locator("iframe")
                    for _ in range(2):
                        frame.locator("#histogram [data-object]").wait_for()
                        frame.locator("#status:has-text('4 samples')").wait_for(timeout=60_000)
                        inner = page.page.frames[1]
                        inner.evaluate("location.reload()")
                        inner.wait_for_load_state()
                    page.close()
        with static(tmp_path) as address:
            page = Page(browser, address)
            page.page.wait_for_timeout(500)
            assert page.page.locator("iframe").count() == 0
            assert page.evaluate("document.querySelector('img').naturalWidth") == 640
            page.close()
    assert re.search(r'src="data:image/png;base64,[\w+/]{1000}', content)


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
