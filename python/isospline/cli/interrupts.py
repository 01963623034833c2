"""Ctrl-C on the command line."""

import _thread
import contextlib
import sys
import threading

#: Seconds until a dropped KeyboardInterrupt is raised again.
PAUSE = 0.05


@contextlib.contextmanager
def heard_interrupts():
    """Raise a KeyboardInterrupt again where Python drops it: in finalizers and in callbacks of weak references.

    Python drops about one in a hundred while it imports modules. A viewer would then never end.
    """

    def raise_again(dropped):
        if not isinstance(dropped.exc_value, KeyboardInterrupt):
            before(dropped)
            return
        timer = threading.Timer(PAUSE, _thread.interrupt_main)
        timer.daemon = True
        timer.start()

    before = sys.unraisablehook
    sys.unraisablehook = raise_again
    try:
        yield
    finally:
        sys.unraisablehook = before
