"""Processes that tests interrupt."""

import signal


def obey_interrupts():
    """Raise KeyboardInterrupt on SIGINT. Background jobs of a shell ignore SIGINT, and so do the processes they start.

    Also for `preexec_fn`.
    """
    signal.signal(signal.SIGINT, signal.default_int_handler)
