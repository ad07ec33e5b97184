"""What the weather does from tick to tick: passing clouds, light that comes on, plants in the wind."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.params import LaneLightParams
from sim.rng import stream
from sim.world import Bodies, Kind, Lighting

Floats = NDArray[np.float64]

SHADED = 0.12
"""Share of the sun's light that comes through the cloud that it breaks out of."""
LAMP = (0.55, 0.50, 0.38)
"""What a strong lamp adds to the light of the sky, as a part of it: red, green, blue."""

_WAVES = 4


class ChangingLight:
    """The light of an episode as a function of time.

    Clouds that pass are a sum of slow waves, which take up to `LaneLightParams.passing` of the sun's light
    and a third as much of the sky's.

    Args:
        params: Which changes there are.
        seed: Of the episode.
    """

    def __init__(self, params: LaneLightParams, seed: int) -> None:
        self._params = params
        rng = stream(seed, "light", "passing")
        self._periods = rng.uniform(3.0, 11.0, _WAVES)
        self._phases = rng.uniform(0, 2 * np.pi, _WAVES)

    def at(self, time: float) -> Lighting:
        """Return the light at ``time`` seconds."""
        p, came = self._params, time >= self._params.flash_at
        wave = np.sin(2 * np.pi * time / self._periods + self._phases).mean()
        covered = p.passing / (1 + np.exp(-5.0 * wave))
        sun, sky = 1.0 - covered, 1.0 - covered / 3
        if p.flash == "sun" and not came:
            sun *= SHADED
        lamp = LAMP if p.flash == "lamp" and came else (0.0, 0.0, 0.0)
        red, green, blue = (float(sky * (1 + share)) for share in lamp)
        return Lighting(sun=(float(sun),) * 3, sky=(red, green, blue))


class Wind:
    """How the plants among some scenery lean, as a function of time.

    Every plant swings about a lean to leeward at its own pace, a tall one slowly; gusts run through all.

    Args:
        scenery: What stands there.
        strength: Amplitude, metres a metre of height.
        seed: Of the episode.
    """

    def __init__(self, scenery: Bodies, strength: float, seed: int) -> None:
        rng, count = stream(seed, "wind"), len(scenery)
        plant = np.isin(scenery.kinds, (Kind.TREE, Kind.BUSH))
        self._strength = strength * plant * rng.uniform(0.6, 1.4, count)
        way = rng.uniform(0, 2 * np.pi)
        self._along = np.array([np.cos(way), np.sin(way)])
        # Tall trees swing slowly.
        own = 2 * np.pi / (0.9 + 0.16 * scenery.sizes[:, 2])
        self._pace = own[:, None] * rng.uniform(0.8, 1.25, (count, 3)) * [1.0, 1.9, 0.7]
        self._phase = rng.uniform(0, 2 * np.pi, (count, 3))
        # A gust reaches what stands to leeward later.
        self._late = scenery.positions[:, :2] @ self._along / 9.0
        self._gust = rng.uniform(0, 2 * np.pi)

    def at(self, time: float) -> Floats:
        """Return (S, 2) leans at ``time`` seconds, as `sim.world.Bodies.leans`."""
        gust = 0.55 + 0.45 * np.sin(2 * np.pi * (time - self._late) / 5.3 + self._gust)
        swing = np.sin(self._pace * time + self._phase)
        along = gust * (0.5 + 0.8 * swing[:, 0] + 0.35 * swing[:, 1])
        aside = gust * 0.5 * swing[:, 2]
        across = np.array([-self._along[1], self._along[0]])
        lean = along[:, None] * self._along + aside[:, None] * across
        return np.asarray(self._strength[:, None] * lean)
