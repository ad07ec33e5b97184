"""What a user gave that cannot be used."""

from __future__ import annotations


class InputError(ValueError):
    """Bad input; the message is one line that says what was wrong, what was wanted and where."""
