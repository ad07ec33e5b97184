"""The vehicles out of sight: where each is expected, whether it could be seen there, and which come back."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tracker.aerial.appearance import PATCH
from tracker.aerial.belief import OFFSETS, Belief, deviations, speed_log_ratio
from tracker.aerial.calibration import Calibration
from tracker.aerial.forecasts import Forecaster
from tracker.aerial.occluders import Occluders
from tracker.aerial.reacquisition import Appeared, Hidden, Matcher
from tracker.aerial.stabilisation import inverse, transform
from tracker.aerial.tracks import Track, turn_to_velocity
from tracker.aerial.trajectories import Trajectories

Floats = NDArray[np.float64]

LONGEST = 12.0
"""Seconds after which a hidden vehicle is lost."""
GIVEN_UP = 0.02
"""Chance of not having been seen below which a hidden vehicle is taken to have gone elsewhere ..."""
PATIENCE = 45
"""... once it has been so low for so many frames."""
LOST = 0.03
"""Chance that a vehicle that vanishes does not come back at all: it may never have been one."""
AROUND = 1.5
"""Lengths about a new track in which a hidden vehicle that is not seen may be that one."""
SCALES = (0.6, 2.0)
"""Least and most that rehearsals make of the usual variances: it is below bridges and at their ends that
drivers brake and change lanes, and nobody can be rehearsed there; what is no vehicle is rehearsed, too."""
RIM = 10.0
"""Px at the picture's border where nothing is sure to be seen."""
INSIDE, ENTERING = 2e-5, 4e-5
"""Vehicles never seen before that turn up, a px^2, inside the picture and where they come in."""
ENTRY = 45.0
"""Px of the border where vehicles come in."""


class HiddenVehicles:
    """Keeps the hidden vehicles of one episode.

    Attributes:
        tracks: Those of now, each with a forecast.
    """

    def __init__(
        self, forecaster: Forecaster, matcher: Matcher, width: int, height: int, rate: float
    ) -> None:
        self.tracks: list[Track] = []
        self.occluders = Occluders()
        self._forecaster, self._matcher = forecaster, matcher
        self._calibration = Calibration(forecaster)
        self._size = np.array([width, height], float)
        self._longest = round(LONGEST * rate)
        self._unlikely: dict[int, int] = {}
        self._beliefs: dict[int, Belief] = {}
        self._tick = -1
        self._covariances: dict[int, Floats] = {}

    def rehearse(self, trajectories: Trajectories, tick: int, seen: list[int]) -> None:
        """Let the calibration learn from what is seen."""
        self._calibration.step(trajectories, tick, seen)

    def add(self, track: Track, trajectories: Trajectories) -> None:
        """Take in a track that is no longer seen."""
        track.forecast, track.hidden = self._forecaster(trajectories, track.path), None
        self.restore(track)

    def restore(self, track: Track) -> None:
        """Take in a track with a forecast, which goes on."""
        self.tracks.append(track)
        self._unlikely[track.id], self._beliefs[track.id] = 0, Belief()

    def step(self, tick: int, to_mosaic: Floats, begun: Sequence[Track]) -> None:
        """Advance all forecasts, and give up who should have been seen, or has been away for too long.

        Args:
            tick: Of the frame.
            to_mosaic: (3, 3).
            begun: Tracks of which it is not yet decided who they are.
        """
        self._tick = tick
        left = []
        for track in self.tracks:
            assert track.forecast is not None
            track.forecast.step(tick)
            turn_to_velocity(track)
            lead = tick - track.since
            self._covariances[track.id] = self._calibration.covariance(track.forecast, lead, SCALES)
        for track, visible in zip(self.tracks, self._visible(inverse(to_mosaic), begun), strict=True):
            belief = self._beliefs[track.id]
            belief.miss(visible)
            self._unlikely[track.id] = self._unlikely[track.id] + 1 if belief.unseen < GIVEN_UP else 0
            if tick - track.since <= self._longest and self._unlikely[track.id] <= PATIENCE:
                left.append(track)
            else:
                self._forget(track.id)
        self.tracks = left

    def covariance(self, track: Track) -> Floats:
        """Return (2, 2) of a forecast, calibrated, px^2, as of the last `step`."""
        return self._covariances[track.id]

    def _visible(self, to_picture: Floats, begun: Sequence[Track]) -> Floats:
        """Return (N, K) the chance that each hidden vehicle is in plain view at the offsets of its belief."""
        along = [deviations(track.heading, self.covariance(track))[0] for track in self.tracks]
        headings = np.array([track.heading for track in self.tracks]).reshape(-1, 1, 2)
        centres = np.array([track.centre for track in self.tracks]).reshape(-1, 1, 2)
        places = centres + np.array(along).reshape(-1, 1, 1) * OFFSETS[:, None] * headings
        shown = transform(to_picture, places)
        framed = ((shown > RIM) & (shown < self._size - RIM)).all(-1)
        lengths = np.array([track.size[0] for track in self.tracks])
        for other in begun:
            near = AROUND * np.maximum(lengths, other.size[0])
            framed &= np.hypot(*np.moveaxis(places - other.centre, -1, 0)) > near[:, None]
        ways = np.broadcast_to(headings, places.shape)
        visible = self.occluders.visible(places.reshape(-1, 2), ways.reshape(-1, 2))
        return np.asarray(framed * visible.reshape(framed.shape))

    def _forget(self, number: int) -> None:
        del self._unlikely[number], self._beliefs[number], self._covariances[number]

    def reacquire(self, new: list[Track], to_mosaic: Floats) -> list[tuple[Track, Track]]:
        """Return pairs of a hidden track and the new one that is the same vehicle; the hidden are let go."""
        if not new or not self.tracks:
            return []
        centres = np.array([track.centre for track in new])
        none = np.zeros((0, PATCH[0] * PATCH[1] * 3))
        hidden = Hidden(
            centres=np.array([track.centre for track in self.tracks]),
            covariances=np.array([self.covariance(track) for track in self.tracks]) + np.eye(2),
            pictures=[np.array(track.pictures) if track.pictures else none for track in self.tracks],
            headings=np.array([track.pictured for track in self.tracks]),
            densities=self._densities(new),
        )
        shown = transform(inverse(to_mosaic), centres)
        border = np.minimum(shown, self._size - shown).min(1)
        appeared = Appeared(
            centres=centres,
            pictures=np.array([np.mean(track.pictures, 0) for track in new]),
            headings=np.array([track.pictured for track in new]),
            strangers=np.where(border < ENTRY, ENTERING, INSIDE),
        )
        rows, columns = self._matcher(hidden, appeared)
        pairs = [(self.tracks[i], new[j]) for i, j in zip(rows.tolist(), columns.tolist(), strict=True)]
        gone = {old.id for old, _ in pairs}
        self.tracks = [track for track in self.tracks if track.id not in gone]
        for number in gone:
            self._forget(number)
        return pairs

    def _densities(self, new: list[Track]) -> Floats:
        """Return (N, M) log densities, a px^2, of the hidden vehicles, that may be lost, where new ones are.

        How fast those go tells, too, by what it is likelier than of a stranger.
        """
        points, headings = np.array([t.centre for t in new]), np.array([t.heading for t in new])
        paces = np.array([t.pace for t in new])
        found = np.empty((len(self.tracks), len(new)))
        for row, track in zip(found, self.tracks, strict=True):
            belief, covariance = self._beliefs[track.id], self.covariance(track) + np.eye(2)
            faster = paces * np.sign(headings @ track.heading) - np.hypot(*track.velocity)
            ahead, along = (points - track.centre) @ track.heading, deviations(track.heading, covariance)[0]
            row[:] = np.log(belief.unseen / (belief.unseen + LOST))
            row += speed_log_ratio(faster, ahead, along, self._tick - track.since)
            row += belief.log_density(points, track.centre, track.heading, covariance)
        return found
