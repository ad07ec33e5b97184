"""The colours of the report: the same on the video, in the plots and on the page."""

from __future__ import annotations

from tracker.types import Label

Rgb = tuple[int, int, int]

IDENTITIES = (
    "#4cc9f0", "#ffb703", "#f72585", "#80ed99", "#b388ff", "#ff7b54",
    "#00d4a6", "#ffe066", "#5e9cff", "#ff8fb1", "#c0e218", "#e0aaff",
)  # fmt: skip
"""Bright, so that they stand out on road and on the dark profiles; an id takes ``id % 12``."""

LABELS = {Label.CAR: "#ef4444", Label.BACKGROUND: "#22a06b", Label.UNDECIDED: "#9aa0aa"}
"""Of traces, by what the tracker takes them for."""

CLASSES = {"car": "#ef4444", "background": "#22a06b", "oncoming": "#7c6cf2"}
"""Of scored traces, by what they truly are."""

DOTS = CLASSES | {"undecided": LABELS[Label.UNDECIDED]}
"""Of samples on the maps: by class where the truth is known, else by label."""

NO_TRACK = "#6b7280"
"""Of traces that belong to no track."""

SERIES = ("#3b82f6", "#f59e0b", "#10b981", "#a855f7", "#ef4444", "#06b6d4")
"""Of lines in plots that are neither."""

FOREGROUND = "#ff9f1c"
"""Of pixels in a foreground mask."""

TRUTH: Rgb = (255, 255, 255)


def rgb(colour: str) -> Rgb:
    """Turn ``#rrggbb`` into three bytes."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def identity(track: int) -> str:
    """Return the colour of a track."""
    return IDENTITIES[track % len(IDENTITIES)]
