"""Labels by (x, v) alone: paper 1's rule as printed, and others that remember less and more.

All label the traces of the same front end as our tracker and draw no boxes. None measures the camera's
own motion: the speed and the yaw rate are integrated out over their assumed distributions, eqs. (13) and
(17).
"""

from __future__ import annotations

from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, logit

from tracker.in_car.front_end import FrontEnd
from tracker.in_car.hmm import Evidence, Transitions, update_max, update_sum
from tracker.in_car.likelihood import LikelihoodTable, MotionPriors, likelihood_table
from tracker.in_car.traces import TraceSet
from tracker.types import Diagnostics, Frame, Info, Label, Traces, Tracks

Floats = NDArray[np.float64]

PRIORS = MotionPriors(
    corridor=5.0,
    speed=20.0,
    speed_sd=5.0,
    car_lateral_sd=4.0,
    car_t_x_sd=0.6,
    car_t_z_sd=2.0,
    yaw_sd=0.02,
    v_sd=4.0,
)
"""Ours: the paper's values are lost. Roads outside towns; v is as good as the slope of a line through 12
centres."""

MINIMUM_DURATION = 1.0
"""Seconds that a trace must last before it is labelled; the paper's value is lost."""


STAY = 6.0
"""Seconds in which a trace changes between car and background once, for the sticky rule."""


class _Rule(Protocol):
    def __call__(self, p_car: Floats, log_ratio: Floats, dt: float, /) -> Floats: ...


class _Labeller:
    """Labels traces by (x, v) alone: what the trackers share.

    Args:
        rule: How P(car) goes on from the last frame to this one.
        minimum_duration: Seconds before a trace is labelled.
    """

    has_boxes: ClassVar[bool] = False

    def __init__(self, rule: _Rule, minimum_duration: float) -> None:
        self._rule = rule
        self._minimum_duration = minimum_duration
        self._front_end: FrontEnd | None = None
        self._table: LikelihoodTable
        self._dt: float
        self._ids: NDArray[np.int64]
        self._p_car: Floats
        self.diagnostics = Diagnostics()

    def start(self, info: Info) -> None:
        """Forget everything and get ready for an episode."""
        self._front_end = front_end = FrontEnd(info)
        x_max = max(front_end.centre_x, info.width - front_end.centre_x)
        self._table = likelihood_table(front_end.focal, PRIORS, x_max)
        self._dt = 1 / info.rate
        self._ids, self._p_car = np.zeros(0, np.int64), np.zeros(0)
        self.diagnostics = Diagnostics()

    def step(self, frame: Frame) -> Tracks:
        """Label the traces of a frame, for `diagnostics`; there are never tracks.

        Raises:
            RuntimeError: If there was no `start`.
        """
        if self._front_end is None:
            raise RuntimeError("step before start(info)")
        traces = self._front_end.step(frame)
        p_car = np.full(len(traces), 0.5)
        _, old, new = np.intersect1d(self._ids, traces.ids, assume_unique=True, return_indices=True)
        p_car[new] = self._p_car[old]
        # A trace that was not seen in this frame brings no observation.
        seen = traces.missed == 0
        ratio = self._table.log_ratio(traces.x[seen] - self._front_end.centre_x, traces.v[seen])
        p_car[seen] = self._rule(p_car[seen], ratio, self._dt)
        self._ids, self._p_car = traces.ids, p_car
        self.diagnostics = Diagnostics(
            traces=self._labelled(traces, p_car), profiles=self._front_end.profiles
        )
        return Tracks.none()

    def _labelled(self, traces: TraceSet, p_car: Floats) -> Traces:
        labels = np.where(p_car > 0.5, Label.CAR, Label.BACKGROUND).astype(np.uint8)
        labels[traces.age < self._minimum_duration] = Label.UNDECIDED
        return Traces(
            ids=traces.ids,
            x=traces.x,
            v=traces.v,
            labels=labels,
            p_car=p_car,
            owners=np.zeros(len(traces), np.int64),
            points=traces.points,
            point_traces=traces.point_traces,
        )


class PaperTracker(_Labeller):
    """Paper 1: the hidden Markov model of eqs. (20)-(22), and a label only after a minimum time."""

    def __init__(self) -> None:
        super().__init__(lambda p_car, log_ratio, _: update_max(p_car, log_ratio), MINIMUM_DURATION)


class PerFrameTracker(_Labeller):
    """The likelihood ratio of one frame, without memory: what a reader of the paper would try first."""

    def __init__(self) -> None:
        super().__init__(lambda _, log_ratio, __: np.asarray(expit(log_ratio)), 0.0)


class StickyTracker(_Labeller):
    """The paper's model with states that are seldom left (methods.md 1.6, a), and summed predecessors."""

    def __init__(self) -> None:
        super().__init__(
            lambda p_car, log_ratio, dt: update_sum(p_car, log_ratio, Transitions.sticky(dt, STAY)),
            MINIMUM_DURATION,
        )


class AccumulatingTracker(_Labeller):
    """Tempered log ratios, added up over a trace's life (methods.md 1.6, b)."""

    def __init__(self) -> None:
        evidence = Evidence()
        super().__init__(
            lambda p_car, log_ratio, dt: np.asarray(expit(evidence.update(logit(p_car), log_ratio, dt))),
            MINIMUM_DURATION,
        )
