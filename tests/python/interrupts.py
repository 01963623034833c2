"""Processes that tests interrupt."""

import signal


def obey_interrupts():
    """Raise KeyboardInterrupt on SIGINT, which background jobs of a shell ignore, and the processes that they start."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


def obey_signals():
    """For `preexec_fn`: a program that obeys SIGINT, and SIGHUP, which programs under `nohup` ignore."""
    obey_interrupts()
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
