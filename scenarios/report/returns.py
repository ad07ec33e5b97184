"""Strips of those who came back: the patches that were compared, and whether the choice was right."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from scenarios.log import EpisodeLog
from scenarios.report.flight import ENLARGED, PATCH, PATCHES, Return
from scenarios.report.palette import identity, rgb
from scenarios.report.pictures import Picture, jpeg
from scenarios.score.params import Boxes, ScoringParams
from scenarios.score.reacquisition import AFTER, BEFORE, ids_on_vehicles

MOST = 24
"""Strips that are shown."""
OTHERS = 3
"""Others of the hidden that are shown beside them."""
_WIDE, _HIGH = ENLARGED * PATCH[0], ENLARGED * PATCH[1]
SAME, OTHER, UNKNOWN = "the same vehicle", "another vehicle", "on no scored vehicle before or after"
"""What the truth says of a return."""
_GAP, _MARK = 6, 5
_FONT = cv2.FONT_HERSHEY_SIMPLEX


def strips(returns: Sequence[Return], log: EpisodeLog | None, boxes: Boxes, rate: float) -> list[Picture]:
    """Return a strip for each return, the first `MOST` of them.

    Args:
        returns: In order of time.
        log: Of the episode, which tells whether the vehicles are the same; None for a recording.
        boxes: Which boxes are scored.
        rate: Frames a second.
    """
    on = ids_on_vehicles(log, boxes=boxes, params=ScoringParams()) if log is not None else None
    shown = []
    for each in returns[:MOST]:
        words = (
            f"Track {each.track} at {each.first / rate:.1f} s, hidden for"
            f" {(each.first - each.last) / rate:.1f} s, {each.error:.0f} px from where it was expected"
        )
        if np.isfinite(each.distance):
            words += f" ({each.distance:.1f} deviations)"
        if on is not None:
            words += f": {verdict(each, on)}"
        shown.append(Picture(words, jpeg(strip(each)), "image/jpeg"))
    return shown


def verdict(each: Return, on: Mapping[int, Mapping[int, int]]) -> str:
    """Say whether a track came back on the vehicle that it had been on.

    Args:
        each: The return.
        on: By tick and vehicle, the id of the track on it.
    """
    before = _vehicle(each.track, range(each.last - BEFORE + 1, each.last + 1), on)
    after = _vehicle(each.track, range(each.first, each.first + AFTER), on)
    if before is None or after is None:
        return UNKNOWN
    return SAME if before == after else OTHER


def strip(each: Return) -> NDArray[np.uint8]:
    """Draw patches from before and after, and those of the others that were hidden then."""
    others = [*each.others.items()][:OTHERS]
    columns = 2 * PATCHES + OTHERS
    canvas = np.full((_HIGH + 2 * _MARK + 18, columns * (_WIDE + _GAP) + 4 * _GAP, 3), 24, np.uint8)
    colour = rgb(identity(each.track))
    groups = [
        ("before", [(patch, colour) for patch in each.before[-PATCHES:]], PATCHES),
        ("after", [(patch, colour) for patch in each.after], PATCHES),
        (
            "others hidden then, nearest first",
            [(patch, rgb(identity(track))) for track, patch in others],
            OTHERS,
        ),
    ]
    left = _GAP
    for name, patches, room in groups:
        cv2.putText(canvas, name, (left, 13), _FONT, 0.42, (200, 204, 212), 1, cv2.LINE_AA)
        for k, (patch, shade) in enumerate(patches):
            x, y = left + k * (_WIDE + _GAP), 18
            canvas[y : y + _HIGH, x : x + _WIDE] = patch
            canvas[y + _HIGH + 1 : y + _HIGH + 1 + _MARK, x : x + _WIDE] = shade
        left += room * (_WIDE + _GAP) + _GAP
    return canvas


def _vehicle(track: int, ticks: range, on: Mapping[int, Mapping[int, int]]) -> int | None:
    """Return the vehicle that a track was on most often, the smaller of equals."""
    found = [vehicle for tick in ticks for vehicle, number in on.get(tick, {}).items() if number == track]
    return min(set(found), key=lambda vehicle: (-found.count(vehicle), vehicle)) if found else None
