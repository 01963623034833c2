"""Processes that are to be interrupted."""

import signal


def obey_interrupts():
    """For `preexec_fn`: jobs in the background of a shell ignore SIGINT, and what they begin does so too."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
