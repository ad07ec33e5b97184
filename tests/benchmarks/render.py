"""The GL renderer against pyrender: milliseconds a frame, by pass, and the ratio, measured in one run.

Run with ``python -m tests.benchmarks.render``. Both draw the same frames of a shipped scenario in turns,
shadowed and antialiased, with identity and depth; that they agree is checked before a ratio is printed. Both
have drawn each view once before it counts: what they keep of it is in place.
"""

from __future__ import annotations

import statistics
import time
from collections import defaultdict
from collections.abc import Callable
from typing import Any

import numpy as np

from scenarios.spec import load
from sim.render.context import context
from sim.render.gl import GlRenderer
from sim.render.pbr import PbrRenderer
from sim.scenes.in_car import InCarScene
from sim.sensor import Sensor
from tests.benchmarks.lines import Line, table

SCENARIO = "in-car-day"
FRAMES = 16
EVERY = 5
PASSES = ("_shadow_pass", "_main_pass", "_contact_pass", "_sky_pass", "_halo_pass", "_read")
AGREEMENT = 0.999


def timed(times: list[float], work: Callable[..., Any], *args: Any) -> Any:
    """Call ``work``, append its milliseconds to ``times``, return its result."""
    start = time.perf_counter()
    result = work(*args)
    times.append(1e3 * (time.perf_counter() - start))
    return result


def timed_pass(times: list[float], work: Callable[..., Any]) -> Callable[..., Any]:
    """Wrap one pass so that all it asked of OpenGL is done before the clock stops."""

    def wrapped(*args: Any, **options: Any) -> Any:
        context().finish()
        start = time.perf_counter()
        result = work(*args, **options)
        context().finish()
        times.append(1e3 * (time.perf_counter() - start))
        return result

    return wrapped


def main() -> list[Line]:
    """Print medians over the frames, and return the ratios."""
    spec = load(SCENARIO)
    scene = InCarScene(spec.params, seed=0, rate=spec.rate, seconds=10.0)
    times: dict[str, list[float]] = defaultdict(list)
    with GlRenderer(scene.stage, scene.camera) as fast, PbrRenderer(scene.stage, scene.camera) as slow:
        sensor = Sensor(spec.params.sensor, scene.stage.light, scene.camera, spec.rate, 0)
        views = []
        for tick in range(FRAMES * EVERY):
            state = scene.step()
            if tick % EVERY == 0:
                views.append((state, scene.camera, scene.pose(state)))
        equal = []
        for before, view in zip([views[-1], *views[:-1]], views, strict=True):
            # The camera moves: while it stands, the ground is kept.
            fast.render(*before)
            slow.render(*view)
            picture = timed(times["GlRenderer.render"], fast.render, *view)
            other = timed(times["PbrRenderer.render"], slow.render, *view)
            timed(times["GlRenderer.silhouettes"], fast.silhouettes, *view)
            fast.render(*before)
            drawn = timed(times["GlRenderer.begin"], fast.begin, *view)
            timed(times["GlRenderer.finish"], fast.finish, drawn)
            timed(times["Sensor.expose"], sensor.expose, picture, view[0].tick, 20.0)
            equal.append(float(np.mean(picture.ids == other.ids)))
        for name in PASSES:
            setattr(fast, name, timed_pass(times[f"  {name.strip('_')}"], getattr(fast, name)))
        for view in views:
            fast.render(*view)
    if min(equal) < AGREEMENT:
        raise RuntimeError(f"the renderers differ: only {min(equal):.5f} of a frame's ids are equal")
    for name, values in times.items():
        print(f"{name:24s} {statistics.median(values):7.2f} ms")
    print(f"{'equal ids':24s} {min(equal):7.5f}")
    print(
        "GlRenderer: shadows on, ids and depth in the same pass, edges smoothed after drawing (one sample a "
        "pixel).\nPbrRenderer: shadows on, ids in a second pass, edges by four samples a pixel, "
        "which is better and dearer."
    )
    drawn, other_drawn, exposed = (
        np.array(times[name]) for name in ("GlRenderer.render", "PbrRenderer.render", "Sensor.expose")
    )
    ratio, with_sensor = other_drawn / drawn, (other_drawn + exposed) / (drawn + exposed)
    return [
        Line(what="pyrender / GL renderer", measured=float(np.median(ratio)), least=4.0),
        Line(what="the same, sensor included", measured=float(np.median(with_sensor))),
    ]


if __name__ == "__main__":
    print(table(main()))
