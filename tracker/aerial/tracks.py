"""The vehicles in view: Kalman filters in the mosaic, their outlines, births and deaths."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tracker.aerial import appearance
from tracker.aerial.forecasts import Forecast
from tracker.aerial.measuring import Outlines
from tracker.filtering import kalman
from tracker.filtering.assignment import assign

Floats = NDArray[np.float64]

NOISE = 0.8
"""Standard deviation of a measured coordinate, px."""
INTENSITY = 0.012
"""Power spectral density of the white acceleration, px^2 / frame^3."""
SPEED = 3.0
"""Standard deviation of a new track's velocity, px a frame."""
GATE = 12.0
"""Squared Mahalanobis distance of a free region that a track may take."""
WHOLE = 0.82
"""Share of a vehicle's length that must be measured for it to be in full view."""
GROWN = 1.1
"""Share of the length above which more of a vehicle comes into view."""
PART = 4.0
"""Standard deviation of the place along the way of a vehicle that is seen in part, px."""
LEAST_PART, BESIDE = 0.25, 0.5
"""Share of a vehicle's area that is a part of it, and of its width by which that may lie beside."""
CONFIRMING_HITS = 6
SETTLED = 25
"""Frames after which the size and heading of a confirmed track are known."""
MOST_MISSES = 2
"""Successive misses after which a confirmed track is hidden, and any other one ends."""
YOUNG = 30
"""Outlines of a new track that tell how fast it goes."""
SLOWEST = 0.25
"""Px a frame below which a heading is kept as it was."""
GROW, SHRINK, NEW = 0.15, 0.1, 0.3
"""How fast the size follows larger and smaller outlines, and those of a track that is not settled."""
PICTURE_EVERY = 4
WITHIN = 0.6
"""Usual lengths and widths that the centres of two vehicles are apart at least."""


@dataclass(slots=True)
class Track:
    """One vehicle.

    Attributes:
        id: >= 1.
        path: Key in `Trajectories` of where it went since it came into view, for the first time or again:
            what lies between is guessed, and shows nobody the way.
        state: (2, 2) x, vx; y, vy, px of the mosaic and px a frame.
        spread: (2, 2, 2) covariance of each axis.
        heading: (2,) unit vector.
        size: (2,) length and width, px.
        origin: (2,) where it was first seen.
        hits: Frames measured.
        misses: Successive frames not measured.
        confirmed: Whether it is a vehicle for sure.
        whole: Whether it was in full view when last measured.
        outlines: Ticks, centres (2,) and lengths of its outlines until it is confirmed.
        pictures: What it looked like, (D,) each.
        pictured: (2,) heading at the last picture.
        forecast: Of a track that is not seen.
        since: Last tick at which it was seen, or, of a track that is not seen, of its path.
        hidden: What was known of it while it was not seen, if it was: who is lost again too soon may not have
            been that one.
    """

    id: int
    path: int
    state: Floats
    spread: Floats
    heading: Floats
    size: Floats
    origin: Floats
    pictured: Floats
    hits: int = 1
    misses: int = 0
    confirmed: bool = False
    whole: bool = False
    outlines: deque[tuple[int, Floats, float]] = field(default_factory=lambda: deque(maxlen=YOUNG))
    pictures: deque[Floats] = field(default_factory=lambda: deque(maxlen=appearance.MEMORY))
    forecast: Forecast | None = None
    since: int = 0
    hidden: Track | None = None

    @property
    def centre(self) -> Floats:
        """(2,) where it is, or is expected."""
        return self.state[:, 0] if self.forecast is None else self.forecast.point

    @property
    def velocity(self) -> Floats:
        """(2,) px a frame."""
        return self.state[:, 1] if self.forecast is None else self.forecast.velocity

    @property
    def covariance(self) -> Floats:
        """(2, 2) of the centre, px^2."""
        return np.diag(self.spread[:, 0, 0])

    @property
    def pace(self) -> float:
        """How fast a new track's front goes, px a frame: while it comes out its middle goes at half of that.

        0 as long as there is one outline.
        """
        if len(self.outlines) < 2:
            return 0.0
        ticks = np.array([tick for tick, _, _ in self.outlines], float)
        fronts = np.array([centre @ self.heading + 0.5 * length for _, centre, length in self.outlines])
        since = ticks - ticks.mean()
        return float(since @ fronts / (since @ since))

    def went(self, lengths: float = 2.0) -> bool:
        """Tell whether it is so many of its lengths away from where it began."""
        return float(np.hypot(*(self.centre - self.origin))) > lengths * float(self.size[0])


def begin(number: int, outlines: Outlines, k: int, tick: int) -> Track:
    """Begin a track at an outline."""
    centre = outlines.centres[k]
    return Track(
        id=number,
        path=number,
        state=np.column_stack([centre, np.zeros(2)]),
        spread=np.tile(np.diag([NOISE**2, SPEED**2]), (2, 1, 1)),
        heading=outlines.headings[k],
        size=np.maximum(outlines.sizes[k], 4.0),
        origin=centre.copy(),
        pictured=outlines.headings[k],
        since=tick,
        outlines=deque([(tick, centre, float(outlines.sizes[k, 0]))], YOUNG),
    )


def predict(tracks: list[Track]) -> None:
    """Advance tracks by a frame."""
    if not tracks:
        return
    mean = np.concatenate([track.state for track in tracks])
    spread = np.concatenate([track.spread for track in tracks])
    kalman.predict(mean, spread, 1.0, INTENSITY)
    for k, track in enumerate(tracks):
        track.state, track.spread = mean[2 * k : 2 * k + 2], spread[2 * k : 2 * k + 2]


def measure(
    track: Track, centre: Floats, size: Floats, tick: int, blocked: bool, largest: Floats | None = None
) -> bool:
    """Correct a track by its outline along its heading.

    Where a part is hidden the end that lies where it was expected is right, and the length is the track's;
    where there is more than that the track began at a part, and grows.

    Args:
        track: Advanced to this frame.
        centre: (2,) middle of the outline, px.
        size: (2,) length and width, px.
        tick: Of the frame.
        blocked: Whether the outline touches the picture's border.
        largest: (2,) up to which it grows, px; None is not at all.

    Returns:
        Whether it was taken; what lies too far off is another vehicle's, as where one drives on a bridge.
    """
    across = track.heading[::-1] * np.array([-1.0, 1.0])
    full = WHOLE * track.size[0] <= size[0] <= GROWN * track.size[0] + 1.0
    track.whole = bool(full) and not blocked
    apart = np.array([(centre - track.state[:, 0]) @ axis for axis in (track.heading, across)])
    settled = track.confirmed and track.hits > SETTLED
    if settled and not track.whole:
        if not _is_part(track, apart, size):
            return False
        # The middle of the whole, if its front, or its rear, is what is measured; beside it is where it was.
        missing = 0.5 * max(track.size[0] - size[0], 0.0)
        candidates = np.array([apart[0] - missing, apart[0] + missing])
        ahead = candidates[np.abs(candidates).argmin()]
        at = track.state[:, 0] + ahead * track.heading
        kalman.update(track.state, track.spread, np.arange(2), at, PART**2)
        if size[0] > track.size[0] and not blocked and largest is not None and (size <= largest).all():
            track.size += GROW * np.maximum(size - track.size, 0.0)
        track.hits, track.misses, track.since = track.hits + 1, 0, tick
        return True
    if settled:
        squared = float(((centre - track.state[:, 0]) ** 2 / (track.spread[:, 0, 0] + NOISE**2)).sum())
        if squared > GATE:
            return False
    if not track.confirmed:
        track.outlines.append((tick, centre, float(size[0])))
    kalman.update(track.state, track.spread, np.arange(2), centre, NOISE**2)
    rate = np.where(size > track.size, GROW, SHRINK) if settled else np.full(2, NEW)
    track.size = np.maximum(track.size + rate * (size - track.size), 4.0)
    track.hits, track.misses, track.since = track.hits + 1, 0, tick
    turn_to_velocity(track)
    return True


def _is_part(track: Track, apart: Floats, size: Floats) -> bool:
    """Tell whether an outline, ``apart`` (2,) along and across, may be a part of a vehicle."""
    covered = float(size.prod() / track.size.prod())
    return covered > LEAST_PART and abs(float(apart[1])) < BESIDE * float(track.size[1])


def turn_to_velocity(track: Track) -> None:
    """Let a track that goes somewhere head there; a first outline's axis may have been the other one."""
    speed = float(np.hypot(*track.velocity))
    if speed < SLOWEST or (track.forecast is None and track.hits < 3):
        return
    heading = track.velocity / speed
    if track.hits <= 4 and abs(float(heading @ track.heading)) < 0.7 and track.size[0] > 1.2 * track.size[1]:
        track.size = track.size[::-1].copy()
    rate = 1.0 if track.hits <= 6 else min(0.25 * speed, 1.0)
    mixed = (1.0 - rate) * track.heading * np.sign(heading @ track.heading + 1e-9) + rate * heading
    track.heading = mixed / np.hypot(*mixed)


def take_free(tracks: list[Track], outlines: Outlines) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Assign free outlines to tracks without one, within a gate: rows of tracks, and of outlines."""
    if not tracks or not len(outlines.centres):
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    places = np.array([track.state[:, 0] for track in tracks])
    spread = np.array([track.spread[:, 0, 0] for track in tracks]) + NOISE**2 + 4.0
    squared = ((outlines.centres[None] - places[:, None]) ** 2 / spread[:, None]).sum(-1)
    return assign(np.where(outlines.pixels > 0, squared, np.inf), GATE)


def doubles(tracks: list[Track], usual: Floats) -> list[Track]:
    """Return who lies so near to a senior track that both would be in one vehicle of the usual size (2,)."""
    if not tracks:
        return []
    order = sorted(tracks, key=lambda t: (-t.confirmed, -t.hits))
    centres = np.array([track.centre for track in order])
    along = np.array([track.heading for track in order])
    across = along[:, ::-1] * np.array([-1.0, 1.0])
    # Of (i, j): how far the centre of j lies from that of i, on the axes of i.
    apart = centres[None] - centres[:, None]
    away = np.abs(np.stack([(apart * axis[:, None]).sum(-1) for axis in (along, across)], -1))
    within = (away < WITHIN * usual).all(-1)
    senior = np.zeros(len(order), np.bool_)
    for i in range(len(order)):
        senior[i] = not within[i, senior].any()
    return [track for track, first in zip(order, senior.tolist(), strict=True) if not first]
