"""Does the simulator look like a camera to a detector? Features of scenarios beside those of recordings.

``python -m tests.validation.realism`` prints medians and quartiles of what the in-car tracker's detector
finds in one frame, and whether the scenario's median lies within a factor of two of the recordings'.
``--sheet FILE.png`` writes frames of both, one above the other, which ``testtrack run ... --figure FILE.png``
shows in its report; ``--frames N`` says how many of each side.

All frames are brought to 640 x 360: recordings are resized, of the scenario's 640 x 480 the middle is taken.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from scenarios.spec import load
from scenarios.video import Video
from sim.render.gl import GlRenderer
from sim.scenes.in_car import InCarScene
from sim.sensor import Sensor
from tracker.in_car import segments
from tracker.in_car.features import corner_response, find_corners, find_lamps, working_picture

RECORDINGS = Path(__file__).resolve().parents[3] / "shared" / "real" / "in-car"
DAY = ("solidWhiteRight.mp4", "test_video.mp4", "empty_desert_road.mp4")
NIGHT = ("night_motorway.mp4",)
PAIRS = (
    ("in-car-day", DAY, ""),
    ("in-car-curve", DAY, ""),
    ("in-car-urban", DAY, "no recording of a town exists: against open roads by day"),
    ("in-car-stop-and-go", DAY, "no recording of dense traffic exists: against free traffic by day"),
    (
        "in-car-rain",
        DAY,
        "no recording of rain exists: against dry days, so brightness and contrast must differ",
    ),
    ("in-car-night", NIGHT, ""),
)
"""Scenario, recordings, and why they are no match."""
WIDTH, HEIGHT = 640, 360
CORNER_CELL, CORNER_LEAST = 16, 4e-4
"""A corner is the strongest of its cell, px, if its response reaches this."""
SETTLE = 30
"""Ticks between the frames that are taken of a scenario."""

Image = NDArray[np.uint8]
Grey = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Measure:
    """One number a frame; several where a frame has several, such as lengths."""

    name: str
    unit: str
    take: Callable[[Grey], NDArray[np.float64]]


def lines(grey: Grey) -> NDArray[np.float64]:
    """Horizontal line segments: (M, 6)."""
    derivative = segments.vertical_derivative(grey)
    return segments.find_segments(derivative, segments.edge_threshold(derivative))


def line_count(grey: Grey) -> NDArray[np.float64]:
    return np.array([float(len(lines(grey)))])


def line_lengths(grey: Grey) -> NDArray[np.float64]:
    found = lines(grey)
    return found[:, segments.X1] - found[:, segments.X0]


def long_lines(grey: Grey) -> NDArray[np.float64]:
    return np.array([float((line_lengths(grey) >= 24).sum())])


def corners(grey: Grey) -> NDArray[np.float64]:
    response, held = corner_response(grey, 0, len(grey)), np.zeros((0, 2), np.int64)
    return np.array([float(len(find_corners(response, held, CORNER_CELL, CORNER_LEAST, 4000)))])


def peaks(grey: Grey) -> NDArray[np.float64]:
    night = float(np.clip(2.0 - 2.0 * grey.mean() / 80.0, 0.0, 1.0))
    return np.array([float(len(find_lamps(grey, night)))])


def spectrum_slope(grey: Grey) -> NDArray[np.float64]:
    """Slope of log power over log frequency, mean over all directions, between 4 and 80 periods a height."""
    window = np.outer(np.hanning(grey.shape[0]), np.hanning(grey.shape[1]))
    power = np.abs(np.fft.fft2((grey - grey.mean()) * window)) ** 2
    radius = np.hypot(np.fft.fftfreq(grey.shape[0])[:, None], np.fft.fftfreq(grey.shape[1]))
    edges = np.geomspace(4 / HEIGHT, 80 / HEIGHT, 16)
    ring = np.digitize(radius, edges)
    level = [np.log(power[ring == i].mean()) for i in range(1, len(edges))]
    return np.array([np.polyfit(np.log(np.sqrt(edges[1:] * edges[:-1])), level, 1)[0]])


def noise(grey: Grey) -> NDArray[np.float64]:
    """Robust standard deviation of the noise, grey levels: calmest 80 % of the finest diagonal wavelet."""
    block = grey[: HEIGHT // 2 * 2, : WIDTH // 2 * 2].astype(float)
    detail = np.sort(
        np.abs(block[::2, ::2] - block[::2, 1::2] - block[1::2, ::2] + block[1::2, 1::2]).ravel() / 2
    )
    # The root mean square of a standard normal's smallest 80 % by magnitude is 0.6615.
    return np.array([np.sqrt(np.mean(detail[: int(0.8 * len(detail))] ** 2)) / 0.6615])


def brightness(grey: Grey) -> NDArray[np.float64]:
    return np.array([grey.mean()])


def contrast(grey: Grey) -> NDArray[np.float64]:
    return np.array([grey.std()])


MEASURES = (
    Measure("horizontal segments", "a frame", line_count),
    Measure("  of 24 px or more", "a frame", long_lines),
    Measure("  their length", "px", line_lengths),
    Measure("corners", "a frame", corners),
    Measure("lamp peaks", "a frame", peaks),
    Measure("spectral slope", "", spectrum_slope),
    Measure("noise", "grey levels", noise),
    Measure("mean brightness", "grey levels", brightness),
    Measure("contrast", "grey levels", contrast),
)


def recorded(path: Path, count: int) -> Iterator[Image]:
    """Yield ``count`` frames spread over a recording, 640 x 360."""
    with Video(path) as video:
        frames = [frame.image for frame in video.frames()]
    for i in np.linspace(0, len(frames) - 1, min(count, len(frames))).astype(int):
        yield np.asarray(cv2.resize(frames[i], (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA), np.uint8)


def simulated(name: str, count: int, seeds: int = 6) -> Iterator[Image]:
    """Yield about ``count`` frames of a scenario, spread over several seeds, 640 x 360."""
    spec = load(name)
    each = max(1, count // seeds)
    for seed in range(seeds):
        scene = InCarScene(spec.params, seed=seed, rate=spec.rate, seconds=(each * SETTLE + 1) / spec.rate)
        sensor = Sensor(spec.params.sensor, scene.stage.light, scene.camera, spec.rate, seed)
        with GlRenderer(scene.stage, scene.camera) as renderer:
            for tick in range(each * SETTLE):
                state = scene.step()
                if tick % SETTLE:
                    continue
                picture = renderer.render(state, scene.camera, scene.pose(state))
                image = sensor.expose(picture, tick, state.ego.speed if state.ego else 0.0)
                top = (image.shape[0] - HEIGHT) // 2
                yield image[top : top + HEIGHT]


def recordings(clips: Sequence[str], count: int) -> list[Image]:
    """Return about ``count`` frames of several recordings, equally many of each."""
    share = max(1, count // len(clips))
    return [image for clip in clips for image in recorded(RECORDINGS / clip, share)]


def strip(title: str, real: list[Image], synthetic: list[Image], columns: int = 6) -> Image:
    """Return recorded frames above simulated ones, each row labelled: (2 x 180, columns x 320, 3)."""
    rows = []
    for label, images in (("recorded", real), (title, synthetic)):
        chosen = [images[i] for i in np.linspace(0, len(images) - 1, columns).astype(int)]
        half = (WIDTH // 2, HEIGHT // 2)
        row = np.concatenate([cv2.resize(im, half, interpolation=cv2.INTER_AREA) for im in chosen], axis=1)
        for colour, width in (((0, 0, 0), 4), ((255, 255, 255), 1)):
            cv2.putText(row, label, (8, 20), cv2.FONT_HERSHEY_SIMPLEX, 0.55, colour, width, cv2.LINE_AA)
        rows.append(row)
    return np.asarray(np.concatenate(rows), np.uint8)


def png(image: Image) -> bytes:
    """Encode RGB as PNG."""
    return bytes(cv2.imencode(".png", image[..., ::-1])[1])


def compare(real: list[Image], synthetic: list[Image]) -> list[str]:
    """Return one printed line a measure."""
    rows = []
    greys = [[working_picture(image).grey for image in images] for images in (real, synthetic)]
    for measure in MEASURES:
        columns, medians = [], []
        for side in greys:
            values = np.concatenate([measure.take(grey) for grey in side])
            low, middle, high = np.percentile(values, (25, 50, 75)) if len(values) else (0.0, 0.0, 0.0)
            columns.append(f"{low:8.1f} {middle:8.1f} {high:8.1f}")
            medians.append(abs(float(middle)))
        ratio = medians[1] / medians[0] if medians[0] else (1.0 if medians[1] == 0 else np.inf)
        verdict = "yes" if 0.5 <= ratio <= 2.0 else "NO"
        rows.append(
            f"{measure.name:22s} {measure.unit:12s} {columns[0]}   {columns[1]}   {ratio:6.2f}  {verdict}"
        )
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--frames", type=int, default=60, help="of each side")
    parser.add_argument("--sheet", type=Path, help="where to write a contact sheet")
    options = parser.parse_args()
    strips = []
    for name, clips, caveat in PAIRS:
        missing = [clip for clip in clips if not (RECORDINGS / clip).is_file()]
        if missing:
            print(f"{name} left out, no such recording: {', '.join(missing)}")
            continue
        real = recordings(clips, options.frames)
        synthetic = list(simulated(name, options.frames))
        print(f"\n{name} ({len(synthetic)} frames) against {', '.join(clips)} ({len(real)} frames)")
        if caveat:
            print(f"({caveat})")
        print(f"{'':36s} {'recorded: 25 %, median, 75 %':26s}   {'simulated':26s}    ratio  within 2")
        print("\n".join(compare(real, synthetic)), flush=True)
        strips.append(strip(name, real, synthetic))
    if options.sheet and strips:
        options.sheet.write_bytes(png(np.concatenate(strips)))


if __name__ == "__main__":
    main()
