"""From frames to traces: the part that paper 1's rules and our tracker share."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tracker.in_car import profile as prof
from tracker.in_car import segments as seg
from tracker.in_car.features import Features, Picture, find_features, working_picture
from tracker.in_car.traces import TraceSet, TraceStore
from tracker.types import Frame, Info

# Where the focal length is not given: a horizontal field of view of 55 degrees, common among dash cameras.
FOCAL_PER_WIDTH = 0.95
MIN_HITS = 4


class FrontEnd:
    """Features, profiles and traces, frame by frame.

    Attributes:
        focal: Px of the original picture, a default where it is not known.
        horizon: Row of the horizon, px of the original picture; it may be set between frames.
        centre_x: Column of the focus of expansion likewise.
        profiles: Of the last frame, by name, one value per column of the original picture.
        picture: The last frame, small.
        features: Of the last frame, working px.
    """

    def __init__(self, info: Info) -> None:
        """Get ready for an episode."""
        known = info.intrinsics
        self.focal = known.focal if known else FOCAL_PER_WIDTH * info.width
        self.horizon = known.cy if known else 0.5 * info.height
        self.centre_x = known.cx if known else 0.5 * info.width
        self._columns = info.width
        self._rate = info.rate
        self._store = TraceStore(rate=info.rate)
        self.profiles: dict[str, NDArray[np.float32]] = {}
        self.picture: Picture
        self.features: Features

    def step(self, frame: Frame) -> TraceSet:
        """Take the next frame and return the live traces."""
        self.look(working_picture(frame.image))
        return self.trace()

    def look(self, picture: Picture) -> None:
        """Find the features of a picture."""
        self.picture = picture
        top, bottom = self.band()
        self.features = find_features(picture, top, bottom)

    def trace(self, shift: float = 0.0, boxes: Mapping[int, NDArray[np.float64]] | None = None) -> TraceSet:
        """Condense the features, continue the traces.

        Args:
            shift: Vertical jump of the picture since the last frame, working px, where it is known.
            boxes: (4,) working px, in which traces stay that belong to a vehicle, by their ids.
        """
        picture, features = self.picture, self.features
        width = picture.grey.shape[1]
        lines, lamps = features.segments, features.lamps
        length = lines[:, seg.X1] - lines[:, seg.X0]
        segment_profile = prof.smooth(
            prof.condense(lines[:, [seg.X0, seg.X1]], np.minimum(length, 40.0), width), prof.SMOOTHING
        )
        lamp_spans = np.stack([lamps[:, 0] - 0.5, lamps[:, 0] + 0.5], 1)
        lamp_profile = prof.smooth(prof.condense(lamp_spans, np.ones(len(lamps)), width), prof.SMOOTHING)
        centres = prof.find_centres(features, segment_profile, self.horizon / picture.scale)
        self._store.bound(boxes or {})
        self._store.step(centres, shift)
        self.profiles = {
            name: self._stretch(values)
            for name, values in (
                ("segments", segment_profile),
                ("intensity", prof.intensity(picture, *self.band())),
                ("peaks", lamp_profile),
            )
        }
        return self._traces(centres)

    def band(self) -> tuple[int, int]:
        """Return the rows [top, bottom) that are condensed, working px."""
        height, width = self.picture.grey.shape
        return prof.band_rows(self.horizon / self.picture.scale, height, width)

    def _stretch(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        if len(values) == self._columns:
            return values
        places = (np.arange(self._columns) + 0.5) * len(values) / self._columns - 0.5
        return np.interp(places, np.arange(len(values)), values).astype(np.float32)

    def _traces(self, centres: prof.Centres) -> TraceSet:
        scale, live = self.picture.scale, self._store.live
        shown = live["hits"] >= MIN_HITS
        slope, error = self._store.slopes()
        trace_of = np.zeros(len(centres.x), np.int64)
        seen = shown & (live["source"] >= 0)
        trace_of[live["source"][seen]] = live["id"][seen]
        supports = trace_of[centres.owners]
        ripe = live[shown]
        return TraceSet(
            ids=ripe["id"].copy(),
            x=ripe["mean"][:, 0, 0] * scale,
            y=ripe["mean"][:, 1, 0] * scale,
            v=slope[shown] * scale,
            sigma_v=error[shown] * scale,
            width=ripe["width"] * scale,
            age=ripe["age"] / self._rate,
            missed=ripe["missed"].copy(),
            points=centres.points[supports > 0] * scale,
            point_traces=supports[supports > 0],
        )
