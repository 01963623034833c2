"""The commands that use the viewer: ``isospline view``, and ``isospline render --session``."""

from __future__ import annotations

import os

import isospline

from .cli_picture import ALL, largest_of


def serve(arguments, reading, say):
    """Show files in the browser until Ctrl-C.

    `reading` are options of `read_volume`; ``say(text)`` prints a message.
    """
    from .viewer.session import read_session
    from .viewer.viewer import Viewer, open_in_browser

    if arguments.threads:
        isospline.set_thread_count(arguments.threads)
    for path in arguments.files:
        if not os.path.exists(path):
            raise FileNotFoundError(f"{path}: No such file or directory")
    session = read_session(arguments.session) if arguments.session else None
    read_options = {name: _plain(value) for name, value in reading.items() if value}
    viewer = Viewer(host=arguments.host, port=arguments.port)
    try:
        say("Ctrl-C ends the viewer")
        print(viewer.url, flush=True)
        if not arguments.no_browser:
            open_in_browser(viewer.url)
        if session is not None:
            viewer.open_session(session)
        model_options = {} if arguments.degree == 2 else {"degree": arguments.degree}
        for path in arguments.files:
            viewer.open(
                path,
                levels=arguments.level,
                largest=largest_of(arguments),
                table=arguments.largest == ALL,
                read_options=read_options,
                model_options=model_options,
            )
        viewer.wait()
    except KeyboardInterrupt:
        pass  # the usual end of a viewer
    finally:
        viewer.close()


def session_image(arguments, progress):
    """The image of a session, as the viewer's last pass draws it."""
    from .viewer.document import Document
    from .viewer.picture import FINAL_SAMPLES, PictureMaker, Stage
    from .viewer.session import open_session, read_session

    document = Document()
    state = open_session(document, read_session(arguments.session))
    if state.camera is None:
        raise ValueError(f"{arguments.session}: expected a session with a camera")
    if arguments.turntable:
        raise ValueError("--turntable: expected it without --session, got both")
    samples = arguments.samples or FINAL_SAMPLES[state.shading]
    stage = Stage(samples, True)
    return PictureMaker(document).render(state, arguments.size, stage, progress, layers=arguments.layers)


def _plain(value):
    """Values of options in types that JSON can hold."""
    return getattr(value, "str", value)
