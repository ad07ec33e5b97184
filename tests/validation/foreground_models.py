"""How well foreground masks fit: our background model beside OpenCV's MOG2 and KNN on the lane's scenes.

``python -m tests.validation.foreground_models [--seeds A:B] [--scenarios NAME...]`` prints F, precision and
recall of the pixels in all scored frames (scoring.md 13: shadows are background, and who has stood for 3 s
does not count). Every model sees the same frames; every mask gets the same median filter and hole filling.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from itertools import count

import cv2
import numpy as np
from numpy.typing import NDArray

from scenarios import spec
from scenarios.loop import run_episode
from scenarios.score.foreground import total_counts
from scenarios.score.frames import scored_frames
from scenarios.score.summary import DEFAULTS
from tracker.blobs import clean
from tracker.motorcycle_lane.background import PAPER, BackgroundModel
from tracker.motorcycle_lane.tracker import MotorcycleLaneTracker
from tracker.types import Diagnostics, Frame, Info, Tracks

SCENARIOS = ("lane-day", "lane-dense", "lane-wrong-way", "lane-parked", "lane-cloudy", "lane-flash")
WINDOW = 3
"""Of the median filter, px; as in the trackers."""
SHADOWED = 127
"""OpenCV's mark of a shadow; foreground is above."""

Mask = NDArray[np.bool_]
Apply = Callable[[NDArray[np.uint8]], Mask]


class MaskOnly:
    """A tracker that follows nothing and shows a foreground mask.

    Args:
        make: Builds the model of an episode: from a picture (H, W, 3) to its raw mask (H, W).
    """

    has_boxes = False

    def __init__(self, make: Callable[[Info], Apply]) -> None:
        self._make = make
        self.diagnostics = Diagnostics()

    def start(self, info: Info) -> None:
        """Forget everything and get ready for an episode."""
        self._apply = self._make(info)
        self.diagnostics = Diagnostics()

    def step(self, frame: Frame) -> Tracks:
        """Return no tracks."""
        self.diagnostics = Diagnostics(mask=clean(self._apply(frame.image), window=WINDOW))
        return Tracks.none()


def tracking(info: Info) -> Apply:
    """What our tracker shows: trees tell riders from shadows, at the size that riders turn out to have."""
    tracker = MotorcycleLaneTracker()
    tracker.start(info)
    ticks = count()

    def apply(image: NDArray[np.uint8]) -> Mask:
        tick = next(ticks)
        tracker.step(Frame(image=image, tick=tick, time=tick / info.rate))
        assert tracker.diagnostics.mask is not None
        return tracker.diagnostics.mask

    return apply


def opencv(make: Callable[[], cv2.BackgroundSubtractor]) -> Callable[[Info], Apply]:
    """One of OpenCV's models, its own shadow detection on."""

    def built(_: Info) -> Apply:
        model = make()
        return lambda image: np.asarray(model.apply(image) > SHADOWED)

    return built


MODELS: dict[str, Callable[[Info], Apply]] = {
    "tracker": tracking,
    "ours, shadows kept": lambda info: BackgroundModel(info.width, info.height).apply,
    "as printed": lambda info: BackgroundModel(info.width, info.height, PAPER).apply,
    "MOG2": opencv(cv2.createBackgroundSubtractorMOG2),
    "KNN": opencv(cv2.createBackgroundSubtractorKNN),
}


def main(argv: Sequence[str] | None = None) -> None:
    """Print a line a scenario and model."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", default="0:3", metavar="A:B", help="half-open; 0:3 by default")
    parser.add_argument("--scenarios", nargs="+", default=SCENARIOS, metavar="NAME")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", dest="overrides")
    given = parser.parse_args(argv)
    begin, _, end = given.seeds.partition(":")
    cv2.setNumThreads(1)  # KNN's masks differ from run to run with more
    print(f"{'scenario':16}{'model':20}{'F':>7}{'precision':>11}{'recall':>8}")
    for name in given.scenarios:
        scenario = spec.load(name, given.overrides)
        counts = {model: np.zeros(3, np.int64) for model in MODELS}
        for seed in range(int(begin), int(end)):
            trackers = {model: MaskOnly(make) for model, make in MODELS.items()}
            for log in run_episode(scenario, seed, trackers):
                counts[log.tracker] += total_counts(log, list(scored_frames(log, params=DEFAULTS)), DEFAULTS)
        for model, (hits, marked, wanted) in counts.items():
            f, precision, recall = 2 * hits / (marked + wanted), hits / marked, hits / wanted
            print(f"{name:16}{model:20}{f:7.3f}{precision:11.3f}{recall:8.3f}", flush=True)


if __name__ == "__main__":
    main()
