"""The trackers by name."""

from __future__ import annotations

import importlib

from tracker.base import Tracker

TRACKERS = {
    "in-car": "tracker.in_car.tracker:InCarTracker",
    "in-car:paper": "tracker.in_car.paper:PaperTracker",
    "in-car:per-frame": "tracker.in_car.paper:PerFrameTracker",
    "in-car:sticky": "tracker.in_car.paper:StickyTracker",
    "in-car:accumulating": "tracker.in_car.paper:AccumulatingTracker",
    "aerial": "tracker.aerial.tracker:AerialTracker",
    "aerial:paper": "tracker.aerial.variants:paper",
    "aerial:motion-only": "tracker.aerial.variants:motion_only",
    "aerial:appearance-only": "tracker.aerial.variants:appearance_only",
    "aerial:linear": "tracker.aerial.variants:linear",
    "aerial:kalman-nn": "tracker.aerial.variants:kalman_nearest",
    "motorcycle-lane": "tracker.motorcycle_lane.tracker:MotorcycleLaneTracker",
    "motorcycle-lane:paper": "tracker.motorcycle_lane.paper:PaperTracker",
    "motorcycle-lane:mog2-nn": "tracker.motorcycle_lane.nearest:NearestTracker",
}
DETECTION_TRACKERS = {
    "bytetrack": "tracker.adapters.bytetrack:ByteTrack",
    "norfair": "tracker.adapters.norfair:Norfair",
    "stone-soup-jpda": "tracker.adapters.stone_soup:Jpda",
}
"""Of others, that start at detections; each needs a package of its own (`tracker.adapters`)."""


def make(name: str) -> Tracker:
    """Build a tracker.

    Args:
        name: One of `TRACKERS`, or ``module:object`` for a tracker of the reader's own.

    Raises:
        ValueError: If there is no such tracker, or calling it gives none.
    """
    tracker = build(name)
    if not isinstance(tracker, Tracker):
        raise ValueError(f"{name!r} gives a {type(tracker).__name__}, without start(info) and step(frame)")
    return tracker


def build(name: str) -> object:
    """Call what a name stands for, without looking at what that gives.

    Raises:
        ValueError: If there is nothing of that name, or it cannot be called without arguments.
    """
    target = (TRACKERS | DETECTION_TRACKERS).get(name, name)
    module_name, _, attribute = target.partition(":")
    try:
        factory = getattr(importlib.import_module(module_name), attribute)
    except (ImportError, AttributeError, ValueError) as error:
        known = ", ".join((*TRACKERS, *DETECTION_TRACKERS))
        raise ValueError(f"no tracker {name!r}: {error}; wanted one of {known}, or module:object") from error
    try:
        return factory()
    except ImportError as error:
        raise ValueError(f"tracker {name!r} needs a package that is not here: {error}") from error
    except TypeError as error:
        raise ValueError(f"no tracker {name!r}: calling it without arguments fails: {error}") from error
