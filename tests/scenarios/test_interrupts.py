"""Ctrl-C reaches the command wherever it strikes."""

import ctypes
import signal
import sys
import time

import pytest

from scenarios.interrupts import Interrupted, interrupts


@pytest.fixture(autouse=True)
def python_hears_interrupts():
    """Whoever starts the tests in the background may have made them deaf to interrupts."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def interrupted(action):
    """Do something that interrupts the process, and work on for a while; tell where it ended."""
    reached = False
    try:
        with interrupts():
            action()
            reached = True
            deadline = time.monotonic() + 5.0
            while time.monotonic() < deadline:
                time.sleep(0.01)
    except Interrupted:
        return "at work" if reached else "in the action"
    return "not at all"


def test_an_interrupt_is_raised_and_the_context_leaves_no_trace():
    hook = sys.unraisablehook
    assert interrupted(lambda: signal.raise_signal(signal.SIGINT)) == "in the action"
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    assert sys.unraisablehook is hook


def test_one_that_a_callback_swallowed_is_raised_again():
    @ctypes.CFUNCTYPE(None)
    def callback():
        signal.raise_signal(signal.SIGINT)

    assert interrupted(callback) == "at work"


def test_other_errors_of_callbacks_are_told_as_ever(capsys):
    @ctypes.CFUNCTYPE(None)
    def callback():
        raise ValueError("as ever")

    before = sys.unraisablehook
    sys.unraisablehook = sys.__unraisablehook__
    try:
        with interrupts():
            callback()
    finally:
        sys.unraisablehook = before
    assert "as ever" in capsys.readouterr().err


def test_a_process_that_ignores_interrupts_goes_on_ignoring_them():
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with interrupts():
        signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
