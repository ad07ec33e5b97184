"""Motion context: where a hidden vehicle is, by those that move, or have moved, as it did (paper 2).

A predictor is a track with a section like the last F points of the hidden one (`tracker.aerial.lyapunov`).
From the end of that section on it shows the way, also where it did so long ago: B_i of the paper. The
regression (`tracker.aerial.regression`) goes from where the predictors were then to where they are. When one
of them ends or leaves the common way, the forecast goes on from its last point with those that remain; with
none it follows the road (`tracker.aerial.road`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tracker.aerial import lyapunov
from tracker.aerial.forecasts import WINDOW, Growth, drift, last_section, line, unit
from tracker.aerial.regression import carry
from tracker.aerial.road import course
from tracker.aerial.trajectories import Trajectories

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class ContextParameters:
    """Parameters of the motion context; px are of vehicles some 30 px long.

    Attributes:
        window: F, frames that a section lasts. Raising it asks for more of a common history.
        start: epsilon, px: noise of a common start.
        most: Distance, px, of the ends of aligned sections, from which alpha follows. Raising it takes
            predictors that move less alike.
        slack: The same as a share of the section's way: other speeds are no obstacle if `paced`.
        path: Greatest root mean square distance of aligned sections, as a share of that of their ends.
        reach: Px that a predictor's section may end away from the predictand.
        nearness: As in `lyapunov.search`.
        predictors: Most that are used, the best ones.
        fewest: With fewer there is no regression, and the forecast goes straight on: 3 as printed.
        ridge: lambda of `regression.affine`, px^2.
        paced: Whether a predictor's clock runs as fast as the predictand went beside it.
        doubt: How many usual errors the way of a single predictor must be off that of who keeps to the road
            at its speed to count; several count for more. 0 believes the predictors.
        journey: Px from one end of a predictor's path to the other at least: what stands and shakes shows
            nobody the way.
        search_every: Frames between two searches for more predictors.
        roads: Whether a forecast without predictors follows the road, as all paths show it.
    """

    window: int = WINDOW
    start: float = 2.5
    most: float = 10.0
    slack: float = 0.3
    path: float = 0.7
    reach: float = 120.0
    nearness: float = 0.25
    predictors: int = 7
    fewest: int = 1
    ridge: float = 400.0
    paced: bool = True
    doubt: float = 1.0
    journey: float = 60.0
    search_every: int = 5
    roads: bool = True


PRINTED = ContextParameters(
    slack=0.0,
    path=np.inf,
    reach=np.inf,
    nearness=0.0,
    predictors=1000,
    fewest=3,
    ridge=0.0,
    paced=False,
    doubt=0.0,
    journey=0.0,
    search_every=1,
    roads=False,
)
"""As printed, with alpha regularised: without that every exponent is infinite."""

FASTEST = 1.6
"""Greatest pace, and one over the least."""
STILL = 4.0
"""Px in F frames below which a section has no pace."""
SAME_WAY = 0.9
"""Cosine of the angle between the ways of two sections: slow vehicles on a bridge end near those below."""
ANCHOR = 9
"""Points through which a line gives the last seen position."""
BACK = np.arange(1.0 - ANCHOR, 1.0)
TO_END: Floats = line(ANCHOR)[0]
"""Weights of points ``BACK`` frames ago in the last point of the line through them."""
HEADING = 15
"""Last points that tell where a vehicle goes."""
ROOM = 10.0
"""Ticks of a predictor's known path from which on its clock may run at another pace."""
DOUBT = 4.0
"""Predictors that the usual growth of the error counts for, beside what the predictors show."""


@dataclass(slots=True)
class Guide:
    """A predictor.

    Attributes:
        track: Id.
        begin: The tick at which it was where the forecast began.
        pace: Ticks of its path to a frame.
        stretch: What its way is multiplied by where its clock cannot run at another pace, because it is now
            where its path ends.
    """

    track: int
    begin: float
    pace: float
    stretch: float

    def tick(self, lead: int) -> float:
        """Return its tick ``lead`` frames later."""
        return self.begin + self.pace * lead


class ContextForecast:
    """The forecast of one hidden track by its motion context.

    Attributes:
        guides: Its predictors of now.
        point: (2,) px.
        velocity: (2,) px a frame.
        covariance: (2, 2) px^2.
    """

    def __init__(
        self,
        trajectories: Trajectories,
        track: int,
        *,
        parameters: ContextParameters | None = None,
        growth: Growth | None = None,
    ) -> None:
        self._parameters = parameters or ContextParameters()
        self._growth = growth or Growth()
        self._trajectories, self._track = trajectories, track
        section, self._tick = last_section(trajectories, track, self._parameters.window)
        self._began = self._base = self._tick
        self.point = self._steady = self._carried = self._base_point = drift(section[-ANCHOR:])[0]
        self.velocity = drift(section)[1]
        self._speed, self._ahead = float(np.hypot(*self.velocity)), unit(self.velocity)
        self._witnesses = 0
        self._section = section
        self._way = 0.0
        self._earlier = np.zeros((2, 2))
        self._scatter = np.zeros((2, 2))
        self.guides: list[Guide] = []
        self.covariance = self._growth.covariance(unit(self.velocity), 0.0, 0.0)
        self._look_for_more()

    def step(self, tick: int) -> None:
        """Go on to the frame ``tick``."""
        while self._tick < tick:
            if (self._tick - self._began) % self._parameters.search_every == 0:
                self._look_for_more()
            self._go()

    def _go(self) -> None:
        """Go on by a frame."""
        lead = self._tick + 1 - self._base
        # A predictor that has no more points is exhausted.
        left = [g for g in self.guides if g.tick(lead) <= self._trajectories.extent(g.track)[1]]
        if len(left) < len(self.guides):
            self._begin(left)
            lead = 1
        before = self._carried
        if len(self.guides) >= self._parameters.fewest:
            reference = np.array([self._place(g, 0) for g in self.guides])
            way = np.array([self._place(g, lead) for g in self.guides]) - reference
            current = reference + np.array([[g.stretch] for g in self.guides]) * way
            self._carried, apart = carry(reference, current, self._base_point, ridge=self._parameters.ridge)
            self._scatter = apart.T @ apart
            self._witnesses = len(self.guides)
        else:
            self.velocity = self._onward()
            self._carried = before + self.velocity
        self._tick += 1
        self._section = np.concatenate([self._section[-self._parameters.window + 1 :], self._carried[None]])
        self._way += float(np.hypot(*(self._carried - before)))
        self.velocity = drift(self._section[-6:])[1] if self.guides else self.velocity
        self._ahead = self._course(self._steady, self._ahead)
        self._steady = self._steady + self._speed * self._ahead
        self.point = self._believed()
        self._spread()
        self._drop_diverging()

    def _course(self, place: Floats, heading: Floats) -> Floats:
        """Return a heading (2,) turned to the road at a place (2,), if forecasts follow roads."""
        if not self._parameters.roads:
            return heading
        return np.asarray(course(*self._trajectories.table, place, heading))

    def _onward(self) -> Floats:
        """Return (2,) the velocity without predictors: as fast as before, along the road.

        Where a vehicle goes its newest points tell best, but not how fast: those of a predictor that went
        under something lag behind it.
        """
        newest = HEADING if self._witnesses else len(self._section)
        ahead = self._course(self._carried, unit(drift(self._section[-newest:])[1]))
        return float(np.hypot(*drift(self._section)[1])) * ahead

    def _believed(self) -> Floats:
        """Lead what the predictors show back to who keeps to the road at its speed, as far as drivers differ.

        Along the road and across it that is the positive part of the estimator of James and Stein.
        """
        lead = self._tick - self._began
        frame = np.array([self._ahead, [-self._ahead[1], self._ahead[0]]])
        apart = frame @ (self._carried - self._steady)
        usual = self._growth.covariance(self._ahead, lead * self._speed, lead)
        chance = self._parameters.doubt**2 * np.diag(frame @ usual @ frame.T) / max(self._witnesses, 1)
        share = np.maximum(1.0 - chance / np.maximum(apart**2, 1e-9), 0.0)
        return np.asarray(self._steady + (share * apart) @ frame)

    def _place(self, guide: Guide, lead: int) -> Floats:
        """Return (2,) where a predictor is by a line through its last points: less noise, no lag."""
        ticks = guide.tick(lead) + guide.pace * BACK
        return np.asarray(TO_END @ self._trajectories.at(guide.track, ticks))

    def _begin(self, guides: list[Guide]) -> None:
        """Let the regression begin anew at the last point, with predictors of the old base."""
        lead = self._tick - self._base
        self.guides = [Guide(g.track, g.tick(lead), g.pace, g.stretch) for g in guides]
        self._earlier = self._earlier + self._scatter / max(len(guides), 1)
        self._scatter = np.zeros((2, 2))
        self._base, self._base_point = self._tick, self._carried

    def _spread(self) -> None:
        """Weigh the usual growth of the error and what the predictors' own ways differ by."""
        lead = self._tick - self._began
        usual = self._growth.covariance(unit(self.velocity), self._way, lead)
        count = len(self.guides)
        shown = DOUBT * usual + self._scatter + self._earlier * max(count, 1)
        self.covariance = (1.0 + 1.0 / max(count, 1)) * shown / (DOUBT + max(count - 3, 0))

    def _drop_diverging(self) -> None:
        """Remove the predictors that do not move as the forecast does any more."""
        if len(self._section) < self._parameters.window or not self.guides:
            return
        alpha = self._alpha(self._section)
        ticks = np.arange(1 - self._parameters.window, 1)
        lead = self._tick - self._base
        left = [
            g
            for g in self.guides
            if lyapunov.exponent(
                self._section,
                self._trajectories.at(g.track, g.tick(lead) + g.pace * ticks),
                self._parameters.start,
            )
            <= alpha
        ]
        if len(left) < len(self.guides):
            self._begin(left)

    def _look_for_more(self) -> None:
        """Search all tracks for predictors that are not in use."""
        p = self._parameters
        if len(self._section) < p.window or len(self.guides) >= p.predictors:
            return
        points, counts = self._trajectories.table
        most = lyapunov.distance(p.window, p.start, self._alpha(self._section))
        ends, costs = lyapunov.search(
            points, counts, self._section, most, p.reach, min(p.path * most, 1e6), p.nearness
        )
        ids = self._trajectories.ids
        used = {g.track for g in self.guides} | {self._track}
        more: list[Guide] = []
        for row in np.argsort(costs, kind="stable").tolist():
            if ends[row] < 0 or len(used) > p.predictors:
                break
            if ids[row] in used:
                continue
            guide = self._guide(ids[row], int(ends[row]))
            if guide is None:
                continue
            if guide.tick(1) <= self._trajectories.extent(guide.track)[1] + (guide.pace == 1.0):
                more.append(guide)
                used.add(guide.track)
        if more:
            self._begin(self.guides)
            self.guides += more

    def _guide(self, track: int, end: int) -> Guide | None:
        """Make a predictor of the section that ends with a point ``end``; None if it goes another way."""
        first, last = self._trajectories.extent(track)
        begin = float(first + end)
        gone = np.diff(self._trajectories.at(track, [first, last]), axis=0)[0]
        if float(np.hypot(*gone)) < self._parameters.journey:
            return None
        if not self._parameters.paced:
            return Guide(track, begin, 1.0, 1.0)
        window = self._parameters.window
        start, stop = self._trajectories.at(track, [begin + 1 - window, begin])
        theirs, ours = stop - start, self._section[-1] - self._section[0]
        length = float(np.hypot(*theirs))
        if min(length, float(np.hypot(*ours))) < STILL:
            return Guide(track, begin, 1.0, 1.0)
        if unit(theirs) @ unit(ours) < SAME_WAY:
            return None
        # Side by side with the forecast, between two ticks if need be: where the road bends that is what
        # counts.
        ahead = np.clip(float((self._carried - stop) @ theirs) / length**2 * (window - 1), -3, 3)
        begin = float(np.clip(begin + ahead, first, last))
        ratio = float(np.clip(np.hypot(*ours) / length, 1.0 / FASTEST, FASTEST))
        return Guide(track, begin, 1.0, ratio) if last - begin < ROOM else Guide(track, begin, ratio, 1.0)

    def _alpha(self, section: Floats) -> float:
        p = self._parameters
        way = float(np.hypot(*(section[-1] - section[0])))
        return lyapunov.threshold(p.window, p.start, float(np.hypot(p.most, p.slack * way)))
