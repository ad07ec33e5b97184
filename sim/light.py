"""Sun, sky and weather: from parameters and a seed to the `Light` that a renderer draws with."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.models import Light
from sim.params import LightParams
from sim.rng import stream

Floats = NDArray[np.float64]

_SUN_HIGH = np.array([1.0, 0.95, 0.87])
_SUN_LOW = np.array([1.0, 0.84, 0.64])
_CLEAR_ZENITH = np.array([0.040, 0.13, 0.39])
_CLEAR_HORIZON = np.array([0.30, 0.46, 0.68])
_MILKY_ZENITH = np.array([0.085, 0.20, 0.42])
_MILKY_HORIZON = np.array([0.44, 0.55, 0.68])
_OVERCAST_ZENITH = np.array([0.36, 0.39, 0.44])
_OVERCAST_HORIZON = np.array([0.60, 0.63, 0.67])
_RAIN_ZENITH = np.array([0.25, 0.27, 0.30])
_RAIN_HORIZON = np.array([0.40, 0.43, 0.46])
_NIGHT_ZENITH = np.array([0.00006, 0.00008, 0.00014])
_NIGHT_HORIZON = np.array([0.00025, 0.00022, 0.00024])
_MOON = np.array([0.0003, 0.00035, 0.0005])

CLOUD_SPREAD = 0.35
"""How far an episode's share of cloud may lie from the parameter, at half cover; less toward 0 and 1."""


def make_light(params: LightParams, seed: int) -> Light:
    """Draw the light of an episode.

    By day the sun stands 20 to 60 degrees high at any azimuth; clouds take from its light and turn the sky
    from blue to grey, rain dims and wets. At night a faint moon and the glow of towns are all but the lamps.

    Args:
        params: Time of day, clouds, haze, rain.
        seed: Of the episode; the sun's place and the clouds come from its stream ``light``.

    Returns:
        The light; colours are linear RGB.
    """
    rng = stream(seed, "light")
    elevation = np.radians(rng.uniform(20.0, 60.0))
    azimuth = rng.uniform(-np.pi, np.pi)
    warmth = rng.uniform(0.9, 1.1)
    clouds = int(rng.integers(1 << 31))
    sun = np.array(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    )
    # Days differ in cloud and in how clear the air is: from a deep blue sky to a milky one.
    spread, purity = rng.uniform(-CLOUD_SPREAD, CLOUD_SPREAD), rng.uniform(0.0, 1.0)
    cloud = float(np.clip(params.cloud + spread * 4 * params.cloud * (1 - params.cloud), 0, 1))
    cloud = max(cloud, min(1.0, 1.5 * params.rain))
    if params.time == "night":
        sun_colour, zenith, horizon = _MOON * (1 - 0.8 * cloud), _NIGHT_ZENITH, _NIGHT_HORIZON * (1 + cloud)
    else:
        height = np.sin(elevation)
        # Longer ways through the air take the blue out of the sun's light.
        colour = _mix(_SUN_LOW, _SUN_HIGH, min(1.0, height / 0.75))
        sun_colour = (
            4.4
            * colour
            * (0.72 + 0.28 * height)
            * (1 - 0.35 * cloud)
            * (1 - 0.97 * max(0.0, cloud - 0.7) / 0.3)
        )
        clear_zenith = _mix(_CLEAR_ZENITH, _MILKY_ZENITH, purity)
        clear_horizon = _mix(_CLEAR_HORIZON, _MILKY_HORIZON, purity)
        zenith = _mix(_mix(clear_zenith, _OVERCAST_ZENITH, cloud**2), _RAIN_ZENITH, params.rain) * warmth
        horizon = _mix(_mix(clear_horizon, _OVERCAST_HORIZON, cloud**2), _RAIN_HORIZON, params.rain)
    return Light(
        sun=sun,
        sun_colour=sun_colour,
        zenith=zenith,
        horizon=horizon,
        cloud=cloud,
        haze=params.haze + 0.004 * params.rain,
        night=params.time == "night",
        wet=min(1.0, 1.4 * params.rain),
        seed=clouds,
        street_lamps=params.street_lamps,
    )


def _mix(first: Floats, second: Floats, share: float) -> Floats:
    return np.asarray(first + (second - first) * share)
