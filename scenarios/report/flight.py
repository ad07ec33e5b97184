"""What the report remembers of a flight: some pictures, the tracks' paths in the mosaic, who came back."""

from __future__ import annotations

from collections import defaultdict, deque
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from scenarios.report.history import Thinned
from scenarios.report.pictures import jpeg
from tracker.aerial.stabilisation import transform
from tracker.types import Diagnostics, Predictions, Status, Tracks

Floats = NDArray[np.float64]

PICTURES = 40
"""Most frames that are kept."""
PATCH, ENLARGED = (44, 26), 3
"""Px of a patch, cut along the vehicle's heading, and how many times as large it is drawn."""
PATCHES, PATCH_EVERY = 2, 8
"""Patches of a track that are kept, and frames from one to the next."""
HIDDEN = 15
"""Frames for which a track must have been hidden for its return to be noted."""


@dataclass(frozen=True, slots=True)
class KeptFrame:
    """A frame as a file, with what was expected in it.

    Attributes:
        index: Its number in the run, from 0.
        data: JPEG.
        to_mosaic: (3, 3).
        tracks: Of the frame.
        predictions: Of the hidden vehicles; None where nothing was shown.
    """

    index: int
    data: bytes
    to_mosaic: Floats
    tracks: Tracks
    predictions: Predictions | None

    def image(self) -> NDArray[np.uint8]:
        """Return the picture (H, W, 3), RGB."""
        picture = cv2.imdecode(np.frombuffer(self.data, np.uint8), cv2.IMREAD_COLOR)
        assert picture is not None
        return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB), np.uint8)


@dataclass(frozen=True, slots=True)
class Path:
    """A track in the mosaic.

    Attributes:
        ticks: (K,) the frames in which it was there.
        points: (K, 2) px of the mosaic.
        seen: (K,) whether it was seen, else expected.
    """

    ticks: NDArray[np.int64]
    points: Floats
    seen: NDArray[np.bool_]

    def pieces(self) -> list[tuple[int, int]]:
        """Return the rows [begin, end) of each stretch in which it was seen."""
        edges = np.flatnonzero(np.diff(np.concatenate([[False], self.seen, [False]]).astype(np.int8)))
        return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


@dataclass(slots=True)
class Return:
    """A track that was hidden and is seen again.

    Attributes:
        track: Its id.
        last: The last frame in which it had been seen.
        first: The first in which it is seen again.
        error: Px between where it was expected last and where it was found, in the mosaic.
        distance: The same in standard deviations of the forecast, where covariances were shown.
        before: Patches from before.
        after: Patches since.
        others: The last patch of each other track that was hidden then, by id, the nearest one first.
    """

    track: int
    last: int
    first: int
    error: float
    distance: float
    before: list[NDArray[np.uint8]]
    after: list[NDArray[np.uint8]]
    others: dict[int, NDArray[np.uint8]]


class Flight:
    """Gathers a flight frame by frame; only of trackers that show how frames lie in a mosaic."""

    def __init__(self) -> None:
        self.frames: list[KeptFrame] = []
        self.returns: list[Return] = []
        self._thinned = Thinned(PICTURES)
        self._rows: dict[int, list[tuple[int, float, float, bool]]] = defaultdict(list)
        self._patches: dict[int, deque[tuple[int, NDArray[np.uint8]]]] = {}
        self._expected: dict[int, tuple[Floats, Floats | None]] = {}

    def add(self, index: int, image: NDArray[np.uint8], tracks: Tracks, diagnostics: Diagnostics) -> None:
        """Take in frame ``index`` of the run, from 0."""
        if diagnostics.homography is None:
            return
        to_mosaic = np.array(diagnostics.homography, float)
        centres = tracks.boxes.reshape(-1, 2, 2).mean(1) if tracks.state is None else tracks.state[:, :2]
        places = transform(to_mosaic, centres.reshape(-1, 2))
        expected: dict[int, tuple[Floats, Floats | None]] = {}
        for row, (track, status) in enumerate(zip(tracks.ids.tolist(), tracks.status, strict=True)):
            if status == Status.TENTATIVE:
                continue
            seen = status == Status.CONFIRMED
            if seen and track in self._expected:
                self._returned(index, track, centres[row])
            if not seen:
                expected[track] = centres[row], _covariance(diagnostics.predictions, track)
            self._rows[track].append((index, *places[row].tolist(), bool(seen)))
        self._expected = expected
        self._keep_patches(index, image, tracks, centres)
        if self._thinned.wants(index):
            self.frames.append(
                KeptFrame(index, jpeg(image), to_mosaic, tracks, _copied(diagnostics.predictions))
            )
            if self._thinned.added():
                self.frames = self.frames[::2]

    def paths(self) -> dict[int, Path]:
        """Return each track's path."""
        found = {}
        for track, rows in self._rows.items():
            ticks, x, y, seen = zip(*rows, strict=True)
            found[track] = Path(np.array(ticks), np.column_stack([x, y]), np.array(seen, bool))
        return found

    def _returned(self, index: int, track: int, centre: Floats) -> None:
        last = next((row[0] for row in reversed(self._rows[track]) if row[3]), index)
        known = self._patches.get(track)
        if known is None or index - last <= HIDDEN:
            return
        point, covariance = self._expected[track]
        apart = centre - point
        distance = np.nan
        if covariance is not None:
            distance = float(np.sqrt(apart @ np.linalg.solve(covariance, apart)))
        hidden = [other for other in self._expected if other != track and other in self._patches]
        hidden.sort(key=lambda other: float(np.hypot(*(self._expected[other][0] - centre))))
        self.returns.append(
            Return(
                track=track,
                last=last,
                first=index,
                error=float(np.hypot(*apart)),
                distance=distance,
                before=[patch for _, patch in known],
                after=[],
                others={other: self._patches[other][-1][1] for other in hidden},
            )
        )

    def _keep_patches(self, index: int, image: NDArray[np.uint8], tracks: Tracks, centres: Floats) -> None:
        """Keep patches of what is seen, and add them to the returns that still want some."""
        wanted = {each.track: each for each in self.returns if len(each.after) < PATCHES}
        for row in np.flatnonzero(tracks.status == Status.CONFIRMED).tolist():
            track = int(tracks.ids[row])
            known = self._patches.setdefault(track, deque(maxlen=PATCHES))
            fresh = track in wanted and not wanted[track].after
            if known and index - known[-1][0] < PATCH_EVERY and not fresh:
                continue
            heading = np.array([1.0, 0.0]) if tracks.state is None else tracks.state[row, 2:]
            patch = cut(image, centres[row], heading)
            known.append((index, patch))
            if track in wanted:
                wanted[track].after.append(patch)


def cut(image: NDArray[np.uint8], centre: Floats, heading: Floats) -> NDArray[np.uint8]:
    """Cut a vehicle out, its heading to the right: a patch of `PATCH` px, `ENLARGED`."""
    length = float(np.hypot(*heading))
    cosine, sine = heading / length if length > 1e-6 else (1.0, 0.0)
    size = ENLARGED * np.array(PATCH)
    turn = np.array([[cosine, -sine], [sine, cosine]]) / ENLARGED
    place = np.column_stack([turn, centre - turn @ (0.5 * size) - 0.5])
    warped = cv2.warpAffine(
        image,
        place,
        (int(size[0]), int(size[1])),
        flags=cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_REPLICATE,
    )
    return np.asarray(warped, np.uint8)


def _covariance(predictions: Predictions | None, track: int) -> Floats | None:
    if predictions is None or track not in predictions.ids:
        return None
    return np.asarray(predictions.covariances[predictions.ids == track][0])


def _copied(predictions: Predictions | None) -> Predictions | None:
    if predictions is None:
        return None
    return Predictions(
        ids=predictions.ids.copy(),
        centres=predictions.centres.copy(),
        covariances=predictions.covariances.copy(),
    )
