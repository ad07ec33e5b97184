"""Occlusion events: who was hidden by whom, when, how deep, and where it came back."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sim.truth.types import FrameTruth, OcclusionEvent

HIDDEN = 0.1
"""A vehicle is hidden once less than this share of it can be seen ..."""
SEEN = 0.3
"""... after at least this share could be, and until it can be again."""
SHORTEST = 0.1
"""Seconds: shorter gaps are flicker between thin things."""


def occlusion_events(truths: Sequence[FrameTruth], rate: int) -> tuple[OcclusionEvent, ...]:
    """Find the occlusion events of an episode.

    An event of a vehicle begins with the first frame in which less than `HIDDEN` of it can be seen, after it
    has been seen (`SEEN` or more of it), and ends before the frame in which it is seen again; its last frame
    is the last hidden one before that. Both shares are of the whole silhouette, so that to leave the view
    hides too. A vehicle that has left the extended frame is hidden. It was out of view, and its event has no
    occluder, where over the event the frame's border took a larger share of it than other objects did.

    Args:
        truths: Every frame of the episode, in order.
        rate: Frames a second.

    Returns:
        The events, by their first frame, then by the hidden vehicle.
    """
    shortest = max(1, round(SHORTEST * rate))
    found = []
    for vehicle, life in _lives(truths).items():
        visible = np.zeros(len(truths))
        visible[list(life)] = [sight.visible for sight in life.values()]
        for first, last, back in _spans(visible):
            if last - first + 1 < shortest:
                continue
            returned = None
            if back is not None:
                x0, y0, x1, y1 = truths[back].box_visible[life[back].row]
                returned = (float((x0 + x1) / 2), float((y0 + y1) / 2))
            found.append(
                OcclusionEvent(
                    hidden=vehicle,
                    occluder=_occluder(life, first, last),
                    first=truths[first].tick,
                    last=truths[last].tick,
                    deepest=float(visible[first : last + 1].min()),
                    returned=returned,
                )
            )
    return tuple(sorted(found, key=lambda event: (event.first, event.hidden)))


class _Sight(NamedTuple):
    """A vehicle in one frame: its row of the truth, its shares, and who hides it."""

    row: int
    visible: float
    in_frame: float
    occluder: int


def _lives(truths: Sequence[FrameTruth]) -> dict[int, dict[int, _Sight]]:
    """Give each vehicle's sights by frame."""
    lives: dict[int, dict[int, _Sight]] = defaultdict(dict)
    for frame, truth in enumerate(truths):
        columns = (truth.visible, truth.in_frame, truth.occluder_ids)
        values = zip(truth.ids.tolist(), *(column.tolist() for column in columns), strict=True)
        for row, (vehicle, *sight) in enumerate(values):
            lives[vehicle][frame] = _Sight(row, *sight)
    return lives


def _spans(visible: NDArray[np.float64]) -> list[tuple[int, int, int | None]]:
    """Find (first hidden, last hidden, seen again) frames of each gap; the last is None where it never is."""
    spans: list[tuple[int, int, int | None]] = []
    seen, first, last = False, -1, -1
    for frame, share in enumerate(visible):
        if share >= SEEN:
            if first >= 0:
                spans.append((first, last, frame))
            seen, first = True, -1
        elif seen and share < HIDDEN:
            first, last = (frame if first < 0 else first), frame
    if first >= 0:
        spans.append((first, last, None))
    return spans


def _occluder(life: dict[int, _Sight], first: int, last: int) -> int:
    """Return who took most of the vehicle over the event, 0 where that was the frame's border."""
    taken: dict[int, float] = defaultdict(float)
    for frame in range(first, last + 1):
        if frame in life:
            sight = life[frame]
            taken[0] += 1.0 - sight.in_frame
            taken[sight.occluder] += sight.in_frame - sight.visible
        else:
            taken[0] += 1.0
    # Objects together against the border, then the largest among them.
    border = taken.pop(0, 0.0)
    if not taken or sum(taken.values()) < border:
        return 0
    return max(taken, key=lambda occluder: (taken[occluder], -occluder))
