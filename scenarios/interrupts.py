"""Ctrl-C ends a command, whatever it is in the middle of."""

from __future__ import annotations

import _thread
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

AGAIN = 0.05
"""Seconds until an interrupt that got lost is raised again."""


class Interrupted(BaseException):
    """The user interrupted the command.

    It is no `KeyboardInterrupt`, because others answer that one before the command can: the command line's
    parser with an exit of its own, the interpreter by ending as one whom the signal killed.
    """


@contextmanager
def interrupts() -> Iterator[None]:
    """Turn SIGINT into `Interrupted`, unless whoever started the process has it ignored.

    Python drops what is raised in a callback from C, such as the compiler's, and in finalizers. An interrupt
    that is dropped so is raised again a moment later.
    """
    handler, hook = signal.getsignal(signal.SIGINT), sys.unraisablehook
    if handler is signal.SIG_IGN:
        yield
        return

    def interrupt(_number: int, _frame: FrameType | None) -> None:
        raise Interrupted

    def again(dropped: Any) -> None:
        if not issubclass(dropped.exc_type, Interrupted):
            hook(dropped)
            return
        timer = threading.Timer(AGAIN, _thread.interrupt_main)
        timer.daemon = True
        timer.start()

    signal.signal(signal.SIGINT, interrupt)
    sys.unraisablehook = again
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)
        sys.unraisablehook = hook
