"""Records one tracker on one episode while it runs, and writes its report at the end."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from scenarios.files import moved_in
from scenarios.log import EpisodeLog
from scenarios.report.annotate import STRIP, annotate
from scenarios.report.film import Film
from scenarios.report.flight import Flight
from scenarios.report.history import History, Thinned
from scenarios.report.moment import SCALE, MomentChooser
from scenarios.report.page import Recording, write_page
from scenarios.report.pictures import Picture, jpeg
from scenarios.report.series import scored_boxes
from sim.truth.types import FrameTruth
from tracker.types import Diagnostics, Tracks

FILM_SECONDS = 180.0
"""A longer run is filmed to here only: the video goes into the page, and a page has to open.

A flight is mapped to here only, too."""
STILLS = 6
"""Frames shown beneath the video."""


class Recorder:
    """Streams what a tracker makes of an episode into a video and the data of the report.

    Memory stays flat however long the run is. Use it as a context manager: `finish` writes the report; a run
    that is broken off before leaves nothing behind.
    """

    def __init__(
        self, directory: Path, *, width: int, height: int, rate: float, title: str, scene: str = "in-car"
    ) -> None:
        """Get ready.

        Args:
            directory: Where ``report.html`` will stand; made if it is not there.
            width: Of the frames, px.
            height: Of the frames, px.
            rate: Frames a second.
            title: Of the report.
            scene: Which scene's truth is drawn.
        """
        self.scene = scene
        self.directory = directory
        self.width = width
        self.height = height
        self.rate = rate
        self.title = title
        traced = scene == "in-car"
        self._scale, self._strip = (1, STRIP) if traced else (SCALE, 0)
        self._moments = MomentChooser()
        self._flight = Flight()
        self._has_traces = traced
        self._frames = 0
        self._history = History()
        self._stills = Thinned(2 * STILLS)
        self._kept: list[Picture] = []

    def __enter__(self) -> Self:
        self._made = not self.directory.exists()
        self.directory.mkdir(parents=True, exist_ok=True)
        self._scratch = tempfile.TemporaryDirectory(prefix=".report-", dir=self.directory)
        self._film = Film(
            Path(self._scratch.name) / "film.mp4",
            width=self._scale * self.width,
            height=self._scale * self.height + self._strip,
            rate=self.rate,
        )
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._film.close()
        self._scratch.cleanup()
        if self._made and not any(self.directory.iterdir()):
            self.directory.rmdir()

    def frame(
        self,
        image: NDArray[np.uint8],
        tracks: Tracks,
        diagnostics: Diagnostics | None = None,
        truth: FrameTruth | None = None,
    ) -> None:
        """Take in the next frame.

        Args:
            image: (H, W, 3) uint8 RGB, as the tracker saw it.
            tracks: What it returned.
            diagnostics: What else it shows.
            truth: Of the frame; its scored objects are drawn in white.
        """
        index = self._frames
        self._frames += 1
        diagnostics = diagnostics or Diagnostics()
        self._history.add(index, tracks, diagnostics.profiles, diagnostics.traces)
        self._moments.consider(index, image, tracks, diagnostics)

        filmed = index < FILM_SECONDS * self.rate
        kept = self._stills.wants(index)
        if filmed:
            self._flight.add(index, image, tracks, diagnostics)
        if not filmed and not kept:
            return
        time = index / self.rate
        canvas = annotate(
            image,
            tracks=tracks,
            traces=diagnostics.traces,
            truth_boxes=None if truth is None else scored_boxes(truth, self.width, self.height, self.scene),
            caption=f"{time:.2f} s",
            scale=self._scale,
            strip=self._strip,
        )
        if filmed:
            self._film.write(canvas)
        if kept:
            self._kept.append(Picture(f"{time:.1f} s", jpeg(canvas), "image/jpeg"))
            if self._stills.added():
                self._kept = self._kept[::2]

    def finish(
        self,
        log: EpisodeLog | None,
        scores: Mapping[str, Any] | None,
        scenario: Mapping[str, Any] | None,
        *,
        focal: float | None = None,
        figures: Sequence[Picture] = (),
    ) -> Path:
        """Write the report.

        Args:
            log: Of the episode; None for a recording, of which no truth is known.
            scores: The document that ``--json`` prints for this run; of a recording it has no scores in it.
            scenario: As resolved, plain values by name; None for a recording.
            focal: Of the camera, px, where the scenario does not say it.
            figures: More pictures to show, such as frames of a recording beside simulated ones.

        Returns:
            The path of ``report.html``, one file that needs no other.
        """
        self._film.close()
        # Spread over the run; at the very first frame a tracker knows nothing yet.
        choice = np.unique(np.linspace(min(1, len(self._kept) - 1), len(self._kept) - 1, STILLS).round())
        recording = Recording(
            title=self.title,
            width=self.width,
            rate=self.rate,
            frames=self._frames,
            history=self._history,
            film=self._film.path if self._film.frames else None,
            film_frames=self._film.frames,
            stills=tuple(self._kept[int(k)] for k in choice) if self._kept else (),
            moment=self._moments.chosen,
            flight=self._flight,
            has_traces=self._has_traces,
            figures=tuple(figures),
            focal=focal,
        )
        path = self.directory / "report.html"
        with moved_in(path) as part:
            write_page(part, recording, log=log, scores=scores, scenario=scenario)
        return path
