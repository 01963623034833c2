"""The commands that use the viewer: ``isospline view``, and ``isospline render --session``."""

from __future__ import annotations

import contextlib
import os
import signal
import tempfile
from pathlib import Path

import isospline

from ..base.parameters import check_count
from ..io.read import has_names
from ..scene.mesh_files import MESH_SUFFIXES
from ..store.detail import is_store
from .given import OF_FILES, READING, flag, keywords, refuse_without
from .picture import ALL, largest_of, marks_for

# The options of ``isospline render`` that a session leaves open.
_BESIDE_SESSION = {"session", "output", "quiet", "size", "samples", "threads", "layers", "annotate", "legend", "run"}


def serve(arguments, reading, say):
    """Show files in the browser until Ctrl-C.

    `reading` are options of `read_volume`; ``say(text)`` prints a message.
    """
    from ..viewer.viewer import Viewer

    if arguments.threads:
        isospline.set_thread_count(arguments.threads)
    for path in arguments.files:
        if not os.path.exists(path):
            raise FileNotFoundError(f"{path}: No such file or directory")
    _check_options(arguments)
    read_options = {name: _plain(value) for name, value in reading.items()}
    uploads = {"upload_limit": arguments.upload_limit, "upload_count": arguments.upload_count}
    viewer = Viewer(host=arguments.host, port=arguments.port, token=arguments.token, **uploads)
    ends = signal.signal(signal.SIGTERM, signal.default_int_handler)  # as Ctrl-C does
    try:
        session = viewer.read_session(arguments.session) if arguments.session else None
        say("Ctrl-C ends the viewer")
        print(viewer.url, flush=True)
        if not arguments.no_browser:
            viewer.open_in_browser()
        if session is not None:
            viewer.open_session(*session)
        model_options = keywords(arguments, ["degree"])
        for path in arguments.files:
            viewer.open(
                path,
                levels=arguments.level,
                largest=largest_of(arguments),
                table=arguments.largest == ALL,
                read_options=_used(path, read_options),
                model_options=model_options,
            )
        viewer.wait()
    except KeyboardInterrupt:
        pass  # the usual end of a viewer
    finally:
        viewer.close()
        signal.signal(signal.SIGTERM, ends)


def _check_options(arguments):
    """Refuse options that no file of a viewer uses: stores have a model and a place, and meshes no levels."""
    volumes = [path for path in arguments.files if not path.lower().endswith(MESH_SUFFIXES)]
    got = ", ".join(arguments.files) or None
    if not volumes:
        refuse_without(arguments, ("level", "largest"), "a volume", got)
    samples = [path for path in volumes if not is_store(path)]
    if not samples:
        refuse_without(arguments, ("degree", *OF_FILES), "a file of samples", got)
    used = {option for path in samples for option in _used(path, keywords(arguments, READING))}
    refuse_without(arguments, {"name"} - used, "a file with named arrays", got)
    refuse_without(arguments, sorted({"shape", "dtype", "offset"} - used), "a file", got)


def _used(path, options):
    """The options of `read_volume` that a file or a folder uses."""
    unused = set() if has_names(Path(path)) else {"name"}
    if os.path.isdir(path):
        unused |= {"shape", "dtype", "offset"}
    return {option: options[option] for option in options if option not in unused}


def check_beside_session(arguments, parser):
    """Check that no option of ``isospline render`` was given that a session has, or that has no effect with one."""
    plain = vars(parser.parse_args(["render", f"--session={arguments.session}", f"--output={arguments.output}"]))
    for name, value in vars(arguments).items():
        if name not in _BESIDE_SESSION and value != plain[name]:
            raise ValueError(f"{flag(name)} cannot be combined with --session")


def session_image(arguments, progress):
    """The image of a session, as the viewer's last pass draws it."""
    from ..viewer.bundle import is_bundle, unpack
    from ..viewer.document import Document
    from ..viewer.framing import camera_towards
    from ..viewer.picture import FINAL_SAMPLES, PictureMaker, Stage
    from ..viewer.rulers import draw_measurements, length_unit
    from ..viewer.session import open_session, read_session

    document = Document()
    with contextlib.ExitStack() as stack:
        path, folder = arguments.session, None
        if is_bundle(path):
            folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="isospline-"))
            path = unpack(path, folder)
        state = open_session(document, read_session(path), folder=folder)
    samples = FINAL_SAMPLES[state.light] if arguments.samples is None else arguments.samples
    check_count(samples, "samples", 65536)
    stage = Stage(samples, True)
    maker = PictureMaker(document)
    if state.camera is None:  # of a state that no page has shown
        state = state.replace(camera=camera_towards(document, maker, state, "home", arguments.size))
    image = maker.render(state, arguments.size, stage, progress, layers=arguments.layers)
    camera = state.camera.camera()
    if arguments.annotate is True:
        draw_measurements(image, state.measurements, camera, length_unit(document, state))
    return marks_for(arguments, maker.scene, maker.look(state)).draw(image, camera, is_fitted=False)


def _plain(value):
    """Values of options in types that JSON can hold."""
    return getattr(value, "str", value)
