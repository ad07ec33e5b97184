"""What the camera does to a picture: windscreen, lens, exposure, noise and the recorder's compression."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sim.camera import Camera
from sim.models import Light
from sim.params import SensorParams
from sim.render.types import Picture
from sim.rng import stream

Floats32 = NDArray[np.float32]
Image = NDArray[np.uint8]

_DAY_LEVEL, _NIGHT_LEVEL = 112.0, 9.0
_DAY_GAIN, _NIGHT_GAIN = (0.72, 1.35), (0.8, 1.25)
_WIPER_SECONDS = 1.6
_GLARE = 0.35


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _develop(
    planes: NDArray[np.uint8],
    falloff: NDArray[np.float32],
    gain: float,
    tile: NDArray[np.float32],
    shifts: NDArray[np.int64],
    amplitude: NDArray[np.float32],
    out: NDArray[np.uint8],
) -> None:
    """Exposure, vignetting and noise, row by row.

    Planes and rows of scratch let the compiler take sixteen pixels at a time; so do comparisons in place of
    `min` and `max`, and looking up the table in a loop of its own.

    Args:
        planes: (3, H, W) red, green and blue.
        falloff: (H, W) factors.
        gain: Another factor.
        tile: Noise, larger than the picture.
        shifts: (4, 2) where in the tile the noise begins: that of all colours, of red, of green, of blue.
        amplitude: (256,) the noise's standard deviation.
        out: (3, H, W) takes the result.
    """
    # Most of the noise is common to all three colours: coders and denoisers thin out the rest.
    shared, own = np.float32(0.8), np.float32(0.6)
    black, white, half = np.float32(0.0), np.float32(255.0), np.float32(0.5)
    _, rows, columns = planes.shape
    strength = np.float32(gain)
    red, green, blue = np.empty((3, columns), np.float32)
    grey, deviation = np.empty(columns, np.int32), np.empty(columns, np.float32)
    for i in range(rows):
        red_in, green_in, blue_in = planes[0, i], planes[1, i], planes[2, i]
        red_out, green_out, blue_out = out[0, i], out[1, i], out[2, i]
        lens = falloff[i]
        common = tile[shifts[0, 0] + i, shifts[0, 1] : shifts[0, 1] + columns]
        red_noise = tile[shifts[1, 0] + i, shifts[1, 1] : shifts[1, 1] + columns]
        green_noise = tile[shifts[2, 0] + i, shifts[2, 1] : shifts[2, 1] + columns]
        blue_noise = tile[shifts[3, 0] + i, shifts[3, 1] : shifts[3, 1] + columns]
        for j in range(columns):
            share = strength * lens[j]
            r, g, b = share * red_in[j], share * green_in[j], share * blue_in[j]
            mean = np.float32(0.25) * (r + g + g + b)
            grey[j] = np.int32(mean if mean < white else white)
            red[j] = r if r < white else white
            green[j] = g if g < white else white
            blue[j] = b if b < white else white
        for j in range(columns):
            deviation[j] = amplitude[grey[j]]
        for j in range(columns):
            lift = half + deviation[j] * shared * common[j]
            alone = deviation[j] * own
            r = red[j] + lift + alone * red_noise[j]
            g = green[j] + lift + alone * green_noise[j]
            b = blue[j] + lift + alone * blue_noise[j]
            r, g, b = r if r > black else black, g if g > black else black, b if b > black else black
            r, g, b = r if r < white else white, g if g < white else white, b if b < white else white
            red_out[j], green_out[j], blue_out[j] = np.int32(r), np.int32(g), np.int32(b)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _refract(
    image: NDArray[np.uint8], soft: NDArray[np.uint8], places: NDArray[np.float64], radii: NDArray[np.float64]
) -> None:
    """Put drops on the windscreen: each shows upside down what of ``soft`` lies around it.

    ``soft`` is the scene out of focus, at an eighth of its size.
    """
    rows, columns = image.shape[:2]
    for drop in range(radii.size):
        x, y, radius = places[drop, 0], places[drop, 1], radii[drop]
        reach = int(np.ceil(1.8 * radius))
        for i in range(max(int(y) - reach, 0), min(int(y) + reach, rows)):
            for j in range(max(int(x) - reach, 0), min(int(x) + reach, columns)):
                across, down = (j + 0.5 - x) / radius, (i + 0.5 - y) / (1.15 * radius)
                share = 0.6 * min(max(1.5 - np.sqrt(across * across + down * down), 0.0), 1.0)
                if share == 0.0:
                    continue
                row = min(max(int(y / 8 - 5 * down), 0), soft.shape[0] - 1)
                column = min(max(int(x / 8 - 5 * across), 0), soft.shape[1] - 1)
                bright = 1.0 + 0.1 * min(max(down, -1.0), 1.0)
                for c in range(3):
                    value = image[i, j, c] + share * (bright * soft[row, column, c] - image[i, j, c])
                    image[i, j, c] = np.uint8(min(max(value, 0.0), 255.0))


class Sensor:
    """Turns rendered pictures into recorded frames.

    The exposure follows the pictures, so frames are to be given in order; noise and rain depend on the seed
    and the tick alone.

    Args:
        params: Noise, blur, vignetting, lag of the exposure, compression.
        light: Night limits the exposure; how wet the road is says how hard it rains.
        camera: Size and principal point.
        rate: Frames a second.
        seed: The episode's.
    """

    def __init__(self, params: SensorParams, light: Light, camera: Camera, rate: int, seed: int) -> None:
        self._params, self._light, self._camera, self._rate, self._seed = params, light, camera, rate, seed
        self._gain: float | None = None
        self._last = 0
        self._rain = min(1.0, light.wet / 1.4)
        self._falloff = falloff(camera, params.vignetting)
        self._tile = noise_tile(seed, camera)
        self._amplitude = noise_amplitude(params.noise)
        self._planes = np.empty((2, 3, camera.height, camera.width), np.uint8)

    def expose(self, picture: Picture, tick: int, speed: float, *, stops: float = 0.0) -> Image:
        """Record one frame.

        Args:
            picture: As rendered; it is left as it is.
            tick: The frame's number.
            speed: Of the camera, m/s: it slants the rain.
            stops: By which more light is let in than the camera would choose.

        Returns:
            (H, W, 3) uint8.
        """
        import cv2

        image = picture.colour
        if self._rain > 0:
            image = self._through_rain(image, tick, speed)
        if self._params.blur > 0:
            image = np.asarray(cv2.GaussianBlur(image, (0, 0), self._params.blur))
        if self._params.sharpening > 0:
            share = self._params.sharpening
            image = np.asarray(
                cv2.addWeighted(image, 1 + share, cv2.GaussianBlur(image, (0, 0), 1.1), -share, 0)
            )
        if self._light.night:
            image = _glare(image)
        # Coded values go with the root of the light.
        gain = self._exposure(image, tick) * 2.0 ** (stops / 2)
        rng = stream(self._seed, "sensor", "noise", tick)
        room = np.array(self._tile.shape) - image.shape[:2]
        shifts = rng.integers(0, room, size=(4, 2))
        planes, out = self._planes
        cv2.split(image, list(planes))
        _develop(planes, self._falloff, gain, self._tile, shifts, self._amplitude, out)
        return self._recorded(out)

    def _exposure(self, image: Image, tick: int) -> float:
        """Follow the picture's mean brightness with the camera's lag."""
        mean = float(image[::8, ::8].mean())
        level, (low, high) = (_NIGHT_LEVEL, _NIGHT_GAIN) if self._light.night else (_DAY_LEVEL, _DAY_GAIN)
        wanted = float(np.clip((level / max(mean, 1.0)) ** 0.6, low, high))
        elapsed = (tick - self._last) / self._rate
        if self._gain is None or elapsed <= 0 or self._params.exposure_lag == 0:
            self._gain = wanted
        else:
            self._gain += (wanted - self._gain) * -np.expm1(-elapsed / self._params.exposure_lag)
        self._last = tick
        return self._gain

    def _recorded(self, planes: Image) -> Image:
        """Put (3, H, W) ``planes`` together; code and decode, as the recorder would."""
        import cv2

        red, green, blue = planes
        if self._params.compression == 0:
            return np.asarray(cv2.merge([red, green, blue]))
        quality = [cv2.IMWRITE_JPEG_QUALITY, 100 - self._params.compression]
        _, code = cv2.imencode(".jpg", cv2.merge([blue, green, red]), quality)
        return np.asarray(cv2.imdecode(code, cv2.IMREAD_COLOR_RGB))

    def _through_rain(self, image: Image, tick: int, speed: float) -> Image:
        """Lay streaks before the scene, drops on the windscreen and the grey of falling water over all."""
        import cv2

        veil = 0.05 if self._light.night else 0.16
        mean = image[::4, ::4].mean(axis=(0, 1))
        share = veil * self._rain
        table = np.arange(256)[:, None] * (1 - share) + mean * share
        image = np.asarray(cv2.LUT(image, np.clip(table + 0.5, 0, 255).astype(np.uint8)[None]))
        image = self._streaked(image, tick, speed)
        return self._dropped(image, tick)

    def _streaked(self, image: Image, tick: int, speed: float) -> Image:
        import cv2

        height, width = image.shape[:2]
        rng = stream(self._seed, "sensor", "streaks", tick)
        count = rng.poisson(220 * self._rain * width * height / 307200)
        x, y = rng.uniform(0, width, count), rng.uniform(0, height, count)
        depth = rng.uniform(1.5, 9.0, count)
        # A drop falls at 8 m/s and comes nearer at the car's speed, for the 1/60 s that the shutter is open.
        drop = self._camera.focal * 8.0 / 60 / depth
        nearer = 1 / np.maximum(1 - speed / 60 / depth, 0.5) - 1
        dx, dy = (x - self._camera.cx) * nearer, (y - self._camera.cy) * nearer + drop
        layer = np.zeros((height, width), np.uint8)
        strength = rng.uniform(5, 22, count) * (0.35 if self._light.night else 1.0)
        ends = np.stack([x, y, x + dx, y + dy], axis=1)
        for (x0, y0, x1, y1), value in zip(
            np.round(ends * 16).astype(int).tolist(), strength.tolist(), strict=True
        ):
            cv2.line(layer, (x0, y0), (x1, y1), value, 1, cv2.LINE_AA, 4)
        layer = cv2.GaussianBlur(layer, (3, 3), 0)
        return np.asarray(cv2.add(image, cv2.merge([layer, layer, layer])))

    def _dropped(self, image: Image, tick: int) -> Image:
        """Show the scene upside down and out of focus in each drop that fell since the wiper last passed."""
        import cv2

        height, width = image.shape[:2]
        period = max(1, round(_WIPER_SECONDS * self._rate))
        sweep, age = divmod(tick, period)
        rng = stream(self._seed, "sensor", "drops", sweep)
        count = rng.poisson(70 * self._rain)
        born = rng.uniform(0, period, count)
        size = width / 640 * np.exp(rng.normal(1.5, 0.45, count))
        places = np.stack([rng.uniform(0, width, count), rng.uniform(0, height, count)], axis=1)
        small = cv2.resize(image, (width // 8, height // 8), interpolation=cv2.INTER_AREA)
        soft = cv2.GaussianBlur(small, (0, 0), 1.2)
        out = image.copy()
        falling = born <= age
        _refract(out, np.asarray(soft), places[falling], size[falling])
        return out


def falloff(camera: Camera, loss: float) -> Floats32:
    """Return (H, W) factors on coded values: light is lost as by cos^4, ``loss`` of it in the corners."""
    x = (np.arange(camera.width) + 0.5 - camera.width / 2)[None, :]
    y = (np.arange(camera.height) + 0.5 - camera.height / 2)[:, None]
    radius = (x * x + y * y) / (camera.width**2 + camera.height**2) * 4
    # Coded values go with the root of the light.
    return np.sqrt(1 - loss * radius).astype(np.float32)


def noise_tile(seed: int, camera: Camera) -> Floats32:
    """Make noise of unit variance, larger than the frame, a little smooth as demosaicing leaves it."""
    import cv2

    rng = stream(seed, "sensor", "tile")
    shape = (camera.height + 192, camera.width + 192)
    fine = rng.standard_normal(shape, np.float32)
    soft = 0.75 * cv2.GaussianBlur(fine, (0, 0), 0.55) + 0.5 * cv2.GaussianBlur(
        rng.standard_normal(shape, np.float32), (0, 0), 1.4
    )
    return np.asarray(soft / soft.std(), np.float32)


def noise_amplitude(noise: float) -> Floats32:
    """Return the noise's standard deviation for each of 256 coded values.

    Photon noise has a variance that grows with the light; coding by the square root makes it even, so what
    is left is the reader's noise in the dark, and less of all near white where the curve is flat.

    Args:
        noise: Standard deviation at mid grey.
    """
    value = np.arange(256) / 255.0
    curve = (
        np.sqrt(1.0 + 0.03 / (value + 0.08))
        * np.clip(1.25 - 0.6 * value, 0.4, 1.0)
        * np.clip(0.15 + 3 * value, 0, 1)
    )
    return np.asarray(noise * curve / curve[128], np.float32)


def _glare(image: Image) -> Image:
    """Spread what is brighter than the sensor can tell, as lenses and windscreens do."""
    import cv2

    height, width = image.shape[:2]
    bright = cv2.subtract(image, np.full(3, 190.0))
    small = cv2.resize(bright, (width // 4, height // 4), interpolation=cv2.INTER_AREA)
    near = cv2.GaussianBlur(small, (0, 0), 1.5)
    wide = cv2.GaussianBlur(small, (0, 0), 9.0)
    halo = cv2.resize(
        cv2.addWeighted(near, 1.0, wide, 1.6, 0), (width, height), interpolation=cv2.INTER_LINEAR
    )
    return np.asarray(cv2.addWeighted(image, 1.0, halo, _GLARE * 3, 0))
