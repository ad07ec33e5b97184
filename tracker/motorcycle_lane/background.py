"""Statistical background model: Li, Huang, Gu, Tian, TIP 13(11), 2004; eqs. (1)-(18) of paper 3.

Each pixel learns how often it shows which colour, gradient and pair of successive colours, and how often as
background. A pixel that differs neither from the background image nor from the frame before is background;
one that keeps still is judged by colour and gradient, eq. (7), one that moves by its pair of colours,
eq. (4). What stays for long becomes background at once, eqs. (12)-(14).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.motorcycle_lane.change import corner, differences
from tracker.motorcycle_lane.tables import COLOUR, GRADIENT, PAIR, Table, evidence, foreign, learn, same, turn

FADED = np.float32(1e-20)
"""A common factor that has fallen so far is taken into the tables."""


class StatMode(StrEnum):
    """What p(v|b) in the tables is.

    Attributes:
        JOINT: As (10) is printed it fades in every frame and becomes P(v and b): a colour is background only
            where the background is seen more than half of the time.
        CONDITIONAL: It fades and grows only in frames where the pixel is background: P(v|b) proper. Needed
            where traffic is dense; what is left behind is absorbed half as fast.
    """

    JOINT = "joint"
    CONDITIONAL = "conditional"


@dataclass(frozen=True, slots=True, kw_only=True)
class BackgroundParameters:
    """Parameters of the background model.

    Attributes:
        mode: Reading of the statistics.
        rate: alpha. Raising it absorbs stopped objects sooner and forgets rare background sooner.
        start_frames: Frames of training, in which a pixel is background if it shows its most frequent colour.
            Raising it learns through denser traffic, and takes longer. The first 1 / alpha frames all weigh
            the same, so alpha begins at 1 and is a thirtieth after 30 frames.
        image_rate: beta of the background image. Raising it follows the light faster, and noise too.
        colours: N, M of the colour table: entries used, and kept. Raising them holds rarer background.
        gradients: N, M of the gradient table.
        pairs: N, M of the table of colour pairs.
        tolerance: delta of eq. (8), for colours and gradients. Raising it takes larger changes of brightness
            for the same feature, and pale objects for background.
        colour_floor: Distance of two colours, grey levels, that is only noise. Raising it makes dark pixels
            as tolerant as bright ones.
        gradient_floor: tau_e: distance of two gradients, in levels of 8 Sobel units, that is only noise; two
            or three standard deviations. Raising it ignores weak texture.
        pair_tolerance: delta of eq. (9), of 32 levels.
        once_off: M of eq. (13). Raising it absorbs stopped objects later.
        least_change: Grey levels that are always noise. Raising it loses pale objects, lowering it sends
            noisy pixels through the tables, which takes time.
        most_change: Grey levels that never are noise.
        flash_share: Share of foreground pixels from which the light must have changed. Raising it withstands
            denser traffic.
        flash_frames: Successive frames of such a share before all is learnt anew.
        follow_light: Whether the background image behind foreground follows the light of the rest, so it
            fits when it is seen again.
        uncovered: Whether a pixel that moved and now equals the background image is background, whatever its
            pair of colours. As printed the pair decides, and the strip that an object has just uncovered is
            foreground.
    """

    mode: StatMode = StatMode.CONDITIONAL
    rate: float = 0.005
    start_frames: int = 30
    image_rate: float = 0.1
    colours: tuple[int, int] = (15, 25)
    gradients: tuple[int, int] = (15, 25)
    pairs: tuple[int, int] = (25, 40)
    tolerance: float = 0.01
    colour_floor: float = 15.0
    gradient_floor: float = 8.0
    pair_tolerance: int = 2
    once_off: float = 0.85
    least_change: int = 15
    most_change: int = 30
    flash_share: float = 0.5
    flash_frames: int = 3
    follow_light: bool = True
    uncovered: bool = True


PAPER = BackgroundParameters(
    mode=StatMode.JOINT,
    tolerance=0.005,
    colour_floor=0.0,
    least_change=10,
    follow_light=False,
    uncovered=False,
)
"""As printed, with OpenCV's values where the paper's are lost."""


Features = tuple[NDArray[np.uint32], NDArray[np.uint32], NDArray[np.uint32]]


class Limits(NamedTuple):
    """What the kernel needs of the parameters."""

    colours: int
    gradients: int
    pairs: int
    tolerance: float
    colour_floor: float
    gradient_floor: float
    pair_tolerance: int
    once_off: np.float32
    image_rate: np.float32
    uncovered: bool


class BackgroundModel:
    """Background model of one camera.

    Attributes:
        parameters: As given.
    """

    def __init__(self, width: int, height: int, parameters: BackgroundParameters | None = None) -> None:
        self.parameters = p = BackgroundParameters() if parameters is None else parameters
        self._shape = height, width
        pixels = height * width
        self._tables = (
            Table.empty(p.colours[1], pixels),
            Table.empty(p.gradients[1], pixels),
            Table.empty(p.pairs[1], pixels),
        )
        self._limits = Limits(
            p.colours[0],
            p.gradients[0],
            p.pairs[0],
            p.tolerance,
            p.colour_floor,
            p.gradient_floor,
            p.pair_tolerance,
            np.float32(p.once_off),
            np.float32(p.image_rate),
            p.uncovered,
        )
        self._background = np.zeros((pixels, 3), np.float32)
        self._previous = np.zeros((pixels, 3), np.uint8)
        # p(b) of each pixel: one for all tables, since all learn from the same frames.
        self._p_b = np.zeros(pixels, np.float32)
        self._factor = np.float32(1.0)
        self._factor_shared = np.ones(pixels, np.float32)
        # Whether p(v|b) has a factor of its own, by pixel: in conditional mode once the training is over.
        self._conditional = False
        # Weight of what came before p(v|b) and p(b) were last begun.
        self._earlier = np.float32(0.0)
        self._frames = 0
        self._flashing = 0

    @property
    def background(self) -> NDArray[np.uint8]:
        """The background image, (H, W, 3) RGB."""
        return np.asarray(self._background.round().astype(np.uint8).reshape(*self._shape, 3))

    @property
    def training(self) -> bool:
        """Whether the next frame belongs to the training."""
        return self._frames < self.parameters.start_frames

    def statistics(self, row: int, column: int) -> tuple[NDArray[np.float64], ...]:
        """Return what a pixel has learnt: (K, 2) p(v) and p(v|b) of colours, gradients and pairs."""
        i = row * self._shape[1] + column
        shared = self._factor_shared[i] if self._conditional else self._factor
        factors = np.array([self._factor, shared], np.float64)
        both = (np.stack([table.seen[:, i], table.shared[:, i]], 1) for table in self._tables)
        return tuple(factors * values[values[:, 0] > 0] for values in both)

    def apply(self, image: NDArray[np.uint8]) -> NDArray[np.bool_]:
        """Classify and learn one frame.

        Args:
            image: (H, W, 3) uint8 RGB.

        Returns:
            (H, W) foreground, raw: see `tracker.motorcycle_lane.blobs.clean`.

        Raises:
            ValueError: If the image has another size than the model.
        """
        if image.shape != (*self._shape, 3):
            raise ValueError(f"image is {image.shape}, wanted {(*self._shape, 3)}")
        p = self.parameters
        pixels = np.ascontiguousarray(image).reshape(-1, 3)
        previous = pixels if self._frames == 0 else self._previous
        features = _features(pixels, previous, gradient(image))
        if self._frames == 0:
            self._begin(pixels, features)
            mask = np.zeros(len(pixels), np.bool_)
        else:
            if self._frames == p.start_frames // 2:
                self._begin_background()
            if self._frames == p.start_frames:
                self._settle()
            mask = self._step(pixels, features)
            flash = mask.mean() > p.flash_share and not self.training
            self._flashing = self._flashing + 1 if flash else 0
        self._previous = pixels.copy()
        self._frames += 1
        if self._flashing == p.flash_frames:
            self._frames = self._flashing = 0
        return mask.reshape(self._shape)

    def _step(self, pixels: NDArray[np.uint8], features: Features) -> NDArray[np.bool_]:
        """Classify a frame, then learn from it; returns the foreground (P,)."""
        p, one = self.parameters, np.float32(1.0)
        far, moved, far_counts, moved_counts = differences(pixels, self._background, self._previous)
        background, light = _classify(
            pixels,
            features,
            far > corner(far_counts, p.least_change, p.most_change),
            moved > corner(moved_counts, p.least_change, p.most_change),
            self._background,
            self._tables,
            self._p_b,
            self._factor,
            self._factor_shared if self._conditional else np.full(1, self._factor),
            self.training,
            self._limits,
        )
        foreground = ~background
        if p.follow_light:
            _carry(self._background, foreground, light)
        rate = np.float32(max(p.rate, 1.0 / (self._frames + 1)))
        self._earlier *= one - rate
        self._factor *= one - rate
        self._p_b += rate * (background - self._p_b)
        if self._conditional:
            self._factor_shared[background] *= one - rate
            grow_shared = background * (rate / self._factor_shared)
        else:
            grow_shared = background * (rate / self._factor)
        for kind, table, feature, tolerance, floor in zip(
            (COLOUR, GRADIENT, PAIR),
            self._tables,
            features,
            (p.tolerance, p.tolerance, p.pair_tolerance),
            (p.colour_floor, p.gradient_floor, 0.0),
            strict=True,
        ):
            learn(kind, table, feature, rate / self._factor, grow_shared, tolerance, floor)
        if not self.training:
            _turn_once_off(
                foreground,
                self._tables,
                self._p_b,
                self._factor,
                self._factor_shared if self._conditional else np.full(1, self._factor),
                self._limits,
            )
        self._take_in()
        return foreground

    def _begin(self, pixels: NDArray[np.uint8], features: Features) -> None:
        """Take a frame for background, the only thing that each pixel has ever shown."""
        for table, feature in zip(self._tables, features, strict=True):
            table.seen[:] = 0.0
            table.features[0] = feature
            table.seen[0] = table.shared[0] = 1.0
        self._background[:] = pixels
        self._p_b[:] = 1.0
        self._factor, self._earlier = np.float32(1.0), np.float32(0.0)
        self._conditional = False

    def _begin_background(self) -> None:
        """Forget what went for background so far: only now is it known what each pixel shows most often."""
        for table in self._tables:
            table.shared[:] = 0.0
        self._p_b[:] = 0.0
        self._earlier = np.float32(1.0)

    def _settle(self) -> None:
        """End the training: p(b) and p(v and b), seen in a part of it, stand for the whole."""
        share = np.float32(1.0) - self._earlier
        self._p_b /= share
        if self.parameters.mode is StatMode.JOINT:
            for table in self._tables:
                table.shared[:] /= share
            return
        self._conditional = True
        self._factor_shared[:] = 1.0
        scale = self._factor / (share * np.maximum(self._p_b, np.float32(1e-6)))
        for table in self._tables:
            table.shared[:] *= scale

    def _take_in(self) -> None:
        """Take common factors that have become small into the tables, and begin them again."""
        if self._factor < FADED:
            for table in self._tables:
                table.seen[:] *= self._factor
                if not self._conditional:
                    table.shared[:] *= self._factor
            self._factor = np.float32(1.0)
        if self._conditional and self._factor_shared.min() < FADED:
            faded = np.flatnonzero(self._factor_shared < FADED)
            for table in self._tables:
                table.shared[:, faded] *= self._factor_shared[faded]
            self._factor_shared[faded] = 1.0


def gradient(image: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Return (P,) gradients of the grey image: 256 levels each of x (low byte) and y, 128 is none."""
    grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
    along = cv2.Sobel(grey, cv2.CV_16S, 1, 0, ksize=3)
    across = cv2.Sobel(grey, cv2.CV_16S, 0, 1, ksize=3)
    return np.asarray((along.ravel() // 8 + 128) | (across.ravel() // 8 + 128) << 8).view(np.uint16)


@njit(cache=True)
def _colour(pixels, i):  # type: ignore[no-untyped-def]
    return (np.uint32(pixels[i, 0]) << 16) | (np.uint32(pixels[i, 1]) << 8) | np.uint32(pixels[i, 2])


@njit(cache=True)
def _coarse(colour):  # type: ignore[no-untyped-def]
    """Return a colour in 32 levels a channel, 15 bits."""
    return ((colour >> 9) & 0x7C00) | ((colour >> 6) & 0x3E0) | ((colour >> 3) & 0x1F)


@njit(cache=True)
def _features(pixels, previous, gradients):  # type: ignore[no-untyped-def]
    """Return the colours, gradients and pairs of colours of all pixels, (P,) uint32 each, packed."""
    count = pixels.shape[0]
    colours, edges, pairs = (
        np.empty(count, np.uint32),
        np.empty(count, np.uint32),
        np.empty(count, np.uint32),
    )
    for i in range(count):
        colours[i] = _colour(pixels, i)
        edges[i] = gradients[i]
        pairs[i] = (_coarse(_colour(previous, i)) << 15) | _coarse(_colour(pixels, i))
    return colours, edges, pairs


@njit(cache=True)
def _classify(  # type: ignore[no-untyped-def]
    pixels, features, far, moved, background, tables, p_b, factor, factors_shared, training, limits
):
    """Tell background from foreground: eqs. (4), (7); and keep the background image: eqs. (17), (18).

    Returns (P,) bool, and by what factor each channel of the background that is seen grew.
    """
    colours, edges, pairs = features
    is_background = np.empty(colours.size, np.bool_)
    before, after = np.zeros(3), np.zeros(3)
    for i in range(colours.size):
        changed = far[i] or (moved[i] and not limits.uncovered)
        is_b = True
        if changed:
            factor_shared = factors_shared[i % factors_shared.size]
            if training:
                is_b = same(
                    COLOUR, tables[0].features[0, i], colours[i], limits.tolerance, limits.colour_floor
                )
            elif moved[i]:
                v, vb = evidence(PAIR, tables[2], i, pairs[i], limits.pairs, limits.pair_tolerance, 0.0)
                is_b = 2.0 * vb * factor_shared * p_b[i] > v * factor
            else:
                c, cb = evidence(
                    COLOUR, tables[0], i, colours[i], limits.colours, limits.tolerance, limits.colour_floor
                )
                e, eb = evidence(
                    GRADIENT,
                    tables[1],
                    i,
                    edges[i],
                    limits.gradients,
                    limits.tolerance,
                    limits.gradient_floor,
                )
                is_b = 2.0 * cb * factor_shared * eb * factor_shared * p_b[i] > c * factor * e * factor
        is_background[i] = is_b
        if is_b:
            weight = np.float32(1.0) if changed else limits.image_rate
            for c in range(3):
                before[c] += background[i, c]
                background[i, c] += weight * (np.float32(pixels[i, c]) - background[i, c])
                after[c] += background[i, c]
    light = np.ones(3, np.float32)
    for c in range(3):
        if before[c] > 0.0:
            light[c] = after[c] / before[c]
    return is_background, light


@njit(cache=True)
def _turn_once_off(foreground, tables, p_b, factor, factors_shared, limits):  # type: ignore[no-untyped-def]
    """Make background of what has stayed for long: eqs. (13), (14), judged by colour."""
    sizes = (limits.colours, limits.gradients, limits.pairs)
    for i in np.flatnonzero(foreground):
        factor_shared = factors_shared[i % factors_shared.size]
        if foreign(tables[0], i, sizes[0], p_b[i], factor, factor_shared) > limits.once_off:
            for k in range(3):
                turn(tables[k], i, sizes[k], p_b[i], factor, factor_shared)
            p_b[i] = np.float32(1.0) - p_b[i]


@njit(cache=True)
def _carry(background, mask, light):  # type: ignore[no-untyped-def]
    """Let the background behind the foreground follow the light of what is seen."""
    for i in range(mask.size):
        if mask[i]:
            for c in range(3):
                background[i, c] = min(background[i, c] * light[c], np.float32(255.0))
