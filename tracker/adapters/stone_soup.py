"""Stone Soup's JPDA (exact, with its efficient hypothesis management), put together as its tutorials do."""

from __future__ import annotations

import importlib
from datetime import datetime, timedelta
from typing import Any

import numpy as np

from tracker.types import Detections, Diagnostics, Info, Status, Tracks

ACCELERATION, GROWTH, ERROR = 60.0, 20.0, 3.0
"""Noise of the motion, px/s^1.5, and of the sizes, px/s^.5; deviation of a box's centre and size, px."""
SPEED = 150.0
"""Standard deviation of a new track's speed, px/s."""
DETECTED, GATE, CLUTTER = 0.9, 0.99, 1e-6
"""Probabilities of detection and of the gate, and false boxes per px^4 of centre and size."""
POINTS, SECONDS = 3, 0.5
"""Detections that make a track, and how long it lives without one."""
_EPOCH = datetime(2000, 1, 1)
_CENTRE, _SIZE, _STATE = (0, 2, 4, 5), slice(4, 6), [0, 2, 1, 3]


class Jpda:
    """Follows detections with Stone Soup's mixture tracker; its state is cx, vx, cy, vy, width, height.

    Raises:
        ImportError: If Stone Soup is not installed.
    """

    def __init__(self) -> None:
        self._part = {
            name: importlib.import_module(f"stonesoup.{name}")
            for name in (
                "dataassociator.neighbour",
                "dataassociator.probability",
                "deleter.time",
                "hypothesiser.distance",
                "hypothesiser.probability",
                "initiator.simple",
                "measures",
                "models.measurement.linear",
                "models.transition.linear",
                "predictor.kalman",
                "tracker.simple",
                "types.detection",
                "types.state",
                "types.update",
                "updater.kalman",
            )
        }

    def start(self, info: Info) -> None:
        """Make another one."""
        self._ids: dict[str, int] = {}
        self._innovations = np.zeros(0)
        self._tracker = self._made(info)

    def follow(self, detections: Detections) -> Tracks:
        """Return its tracks; those whose last state is a bare prediction are coasting."""
        time = _EPOCH + timedelta(seconds=detections.time)
        corners = detections.boxes
        measured = np.hstack([(corners[:, :2] + corners[:, 2:]) / 2, corners[:, 2:] - corners[:, :2]])
        detection = self._part["types.detection"].Detection
        given = {detection(row[:, None], timestamp=time, measurement_model=self._model) for row in measured}
        _, found = self._tracker.update_tracker(time, given)
        # Its tracks are a set: new ones get their ids from left to right.
        order = [(self._ids.get(t.id, len(self._ids) + 1), float(t.state_vector[0]), t) for t in found]
        return self._shown([track for *_, track in sorted(order, key=lambda row: row[:2])])

    @property
    def diagnostics(self) -> Diagnostics:
        """The innovations of the tracks that it updated last."""
        return Diagnostics(innovations=self._innovations)

    def _id(self, name: str) -> int:
        return self._ids.setdefault(name, len(self._ids) + 1)

    def _shown(self, found: list[Any]) -> Tracks:
        # It sums over sets, in no fixed order: what that changes is rounded away.
        means = np.array([np.asarray(t.state_vector, float).ravel() for t in found]).reshape(-1, 6).round(6)
        covariances = np.array([np.asarray(t.covar, float) for t in found]).reshape(-1, 6, 6).round(6)
        centres, half = means[:, [0, 2]], np.maximum(means[:, _SIZE], 1.0) / 2
        update = self._part["types.update"].Update
        seen = np.array([isinstance(t.state, update) for t in found], bool)
        self._innovations = np.array([_innovation(t.state) for t in found if isinstance(t.state, update)])
        return Tracks(
            ids=np.array([self._id(t.id) for t in found], np.int64),
            boxes=np.hstack([centres - half, centres + half]),
            status=np.where(seen, Status.CONFIRMED, Status.COASTING).astype(np.uint8),
            state=means[:, _STATE],
            covariance=covariances[:, _STATE][:, :, _STATE],
        )

    def _made(self, info: Info) -> Any:
        part = self._part
        transition = part["models.transition.linear"]
        self._model = part["models.measurement.linear"].LinearGaussian(
            ndim_state=6, mapping=_CENTRE, noise_covar=np.eye(4) * ERROR**2
        )
        motion = transition.CombinedLinearGaussianTransitionModel(
            [transition.ConstantVelocity(ACCELERATION**2)] * 2 + [transition.RandomWalk(GROWTH**2)] * 2
        )
        predictor = part["predictor.kalman"].KalmanPredictor(motion)
        updater = part["updater.kalman"].KalmanUpdater(self._model)
        deleter = part["deleter.time"].UpdateTimeStepsDeleter(max(2, round(SECONDS * info.rate)))
        nearest = part["hypothesiser.distance"].DistanceHypothesiser(
            predictor, updater, part["measures"].Mahalanobis(), missed_distance=4.0
        )
        prior = part["types.state"].GaussianState(
            np.zeros((6, 1)), np.diag([0.0, SPEED**2, 0.0, SPEED**2, 0.0, 0.0]), timestamp=_EPOCH
        )
        return part["tracker.simple"].MultiTargetMixtureTracker(
            initiator=part["initiator.simple"].MultiMeasurementInitiator(
                prior_state=prior,
                deleter=part["deleter.time"].UpdateTimeStepsDeleter(2),
                data_associator=part["dataassociator.neighbour"].GNNWith2DAssignment(nearest),
                updater=updater,
                measurement_model=self._model,
                min_points=POINTS,
            ),
            deleter=deleter,
            detector=[],
            data_associator=part["dataassociator.probability"].JPDAwithEHM2(
                part["hypothesiser.probability"].PDAHypothesiser(
                    predictor,
                    updater,
                    clutter_spatial_density=CLUTTER,
                    prob_detect=DETECTED,
                    prob_gate=GATE,
                )
            ),
            updater=updater,
        )


def _innovation(updated: Any) -> float:
    """Return how far off a track's likeliest detection lay, squared, in units of the covariance."""
    single = updated.hypothesis
    if hasattr(single, "single_hypotheses"):
        single = max((one for one in single if one), key=lambda one: one.probability)
    expected = single.measurement_prediction
    off = np.asarray(single.measurement.state_vector - expected.state_vector, float).ravel()[:2]
    return float(off @ np.linalg.solve(np.asarray(expected.covar, float)[:2, :2], off))
