"""The viewer in the cell of a notebook, as an anywidget: its page talks to the kernel through the notebook."""

from __future__ import annotations

import contextlib
import functools
import re
from typing import Any

import anywidget
import traitlets

from .server import PAGE
from .window import Window


class ViewerWidget(anywidget.AnyWidget):
    """A viewer in the cells that show the widget; each of them is a window.

    Parameters
    ----------
    viewer : Viewer
    still : str
        The address of a picture, for notebooks without a kernel.
    height : int
        In pixels.
    """

    _esm = (PAGE / "widget.js").read_text(encoding="utf-8")
    still = traitlets.Unicode().tag(sync=True)
    height = traitlets.Int().tag(sync=True)

    def __init__(self, viewer, still, height):
        super().__init__(still=still, height=height)
        self._viewer = viewer
        self._windows: dict[str, Window] = {}
        self.on_msg(self._receive)

    def _receive(self, _: Any, content: dict[str, Any], buffers: list[memoryview]) -> None:
        """Handle a message of widget.js."""
        id, kind = content["window"], content["kind"]
        if kind in ("open", "close"):
            self._close(id)
        if kind == "page" and self._viewer.is_open:  # otherwise, the picture stays
            self._tell(id, "page", page=page_for_cells())
        elif kind == "open" and self._viewer.is_open:
            transmit, ended = (functools.partial(each, id) for each in (self._transmit, self._end))
            self._windows[id] = Window(self._viewer, transmit, ended)
            self._tell(id, "open")
        elif kind in ("text", "binary") and id in self._windows:
            message = content["text"] if kind == "text" else bytes(buffers[0])
            with contextlib.suppress(ValueError, RecursionError):  # the page is not one of ours
                self._windows[id].receive(message)
            if kind == "binary":
                self._tell(id, "received", bytes=len(message))
        elif kind != "close":  # the page connects again, if the viewer is still open
            self._tell(id, "closed")

    def _close(self, id):
        if window := self._windows.pop(id, None):
            window.close()

    def _transmit(self, id, message):
        if isinstance(message, str):
            self._tell(id, "text", text=message)
        else:
            self.send({"window": id, "kind": "binary"}, buffers=[message])

    def _tell(self, id, kind, **content):
        self.send({"window": id, "kind": kind, **content})

    def _end(self, id):
        """Tell a page that the viewer has ended."""
        self._windows.pop(id, None)
        self._tell(id, "closed")


@functools.cache
def page_for_cells() -> dict[str, Any]:
    """The page as one document without addresses: its HTML, and its modules.

    The map of imports goes in place of IMPORTS. Modules import each other by bare names, because a document in a frame
    has no address to resolve others from.
    """
    files = {path.name: path.read_text(encoding="utf-8") for path in PAGE.iterdir()}
    modules = {
        f"isospline/{name}": re.sub(r'(from|import) "\./', r'\1 "isospline/', source)
        for name, source in files.items()
        if name.endswith(".js") and name != "widget.js"
    }
    html = files["index.html"]
    for line, replacement in {
        '<link rel="icon" href="icon.svg">\n': "",
        '<link rel="stylesheet" href="style.css">': f"<style>\n{files['style.css']}</style>",
        '<script type="module" src="main.js"></script>': '<script type="importmap">IMPORTS</script>\n'
        '<script type="module">import "isospline/main.js";</script>',
    }.items():
        if html.count(line) != 1:
            raise RuntimeError(f"index.html: expected {line!r} once")
        html = html.replace(line, replacement)
    return {"html": html, "modules": modules}
