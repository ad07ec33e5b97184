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
        self._previous: NDArray[np.uint8] | None = None
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
        gradients = gradient(image)
        mask = np.zeros(len(pixels), np.bool_)
        if self._previous is None or self._frames == 0:
            self._begin(pixels, gradients)
        else:
            if self._frames == p.start_frames // 2:
                self._begin_background()
            if self._frames == p.start_frames:
                self._settle()
            far, moved, far_counts, moved_counts = differences(pixels, self._background, self._previous)
            rate = np.float32(max(p.rate, 1.0 / (self._frames + 1)))
            self._factor *= np.float32(1.0) - rate
            self._earlier *= np.float32(1.0) - rate
            foreground, light = _step(
                pixels,
                self._previous,
                gradients,
                far > corner(far_counts, p.least_change, p.most_change),
                moved > corner(moved_counts, p.least_change, p.most_change),
                self._background,
                *self._tables,
                self._p_b,
                self._factor,
                self._factor_shared,
                rate,
                self.training,
                self._conditional,
                self._limits,
                mask,
            )
            if self._factor < FADED:
                self._take_in()
            if p.follow_light:
                _carry(self._background, mask, light)
            flash = foreground > p.flash_share * len(pixels) and not self.training
            self._flashing = self._flashing + 1 if flash else 0
        self._previous = pixels.copy()
        self._frames += 1
        if self._flashing == p.flash_frames:
            self._frames = self._flashing = 0
        return mask.reshape(self._shape)

    def _begin(self, pixels: NDArray[np.uint8], gradients: NDArray[np.uint16]) -> None:
        """Take a frame for background, the only thing that each pixel has ever shown."""
        for table in self._tables:
            table.seen[:] = 0.0
        self._background[:] = pixels
        self._p_b[:] = 1.0
        self._factor, self._earlier = np.float32(1.0), np.float32(0.0)
        self._conditional = False
        _fill(pixels, gradients, *self._tables)

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
        """Multiply the tables by the common factor and begin it again."""
        for table in self._tables:
            table.seen[:] *= self._factor
            if not self._conditional:
                table.shared[:] *= self._factor
        self._factor = np.float32(1.0)


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
def _fill(pixels, gradients, colours, edges, pairs):  # type: ignore[no-untyped-def]
    """Put the features of one frame in the first place."""
    for i in range(pixels.shape[0]):
        colour = np.uint32(_colour(pixels, i))
        features = (colour, np.uint32(gradients[i]), np.uint32((_coarse(colour) << 15) | _coarse(colour)))
        for table, feature in zip((colours, edges, pairs), features):  # noqa: B905 - numba knows no strict
            table.features[0, i] = feature
            table.seen[0, i] = table.shared[0, i] = 1.0


@njit(cache=True)
def _step(  # type: ignore[no-untyped-def]
    pixels,
    previous,
    gradients,
    far,
    moved,
    background,
    colours,
    edges,
    pairs,
    p_b,
    factor,
    factor_shared,
    rate,
    training,
    conditional,
    limits,
    mask,
):
    """Classify all pixels and learn from them.

    Returns how many are foreground, and by what factor each channel of the background that is seen grew.
    """
    delta, one = limits.tolerance, np.float32(1.0)
    floor_c, floor_e, delta_p = limits.colour_floor, limits.gradient_floor, limits.pair_tolerance
    grow = rate / factor
    count = 0
    red, green, blue, more_red, more_green, more_blue = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(pixels.shape[0]):
        colour = np.uint32(_colour(pixels, i))
        edge = np.uint32(gradients[i])
        pair = np.uint32((_coarse(_colour(previous, i)) << 15) | _coarse(colour))
        changed = far[i] or (moved[i] and not limits.uncovered)
        shared_factor = factor_shared[i] if conditional else factor / (one - rate)
        if not changed:
            is_b = True
        elif training:
            is_b = same(COLOUR, colours.features[0, i], colour, delta, floor_c)
        elif moved[i]:
            v, vb = evidence(PAIR, pairs, i, pair, limits.pairs, delta_p, floor_c)
            v *= factor / (one - rate)
            vb *= shared_factor
            is_b = 2.0 * vb * p_b[i] > v
        else:
            v, vb = evidence(COLOUR, colours, i, colour, limits.colours, delta, floor_c)
            e, eb = evidence(GRADIENT, edges, i, edge, limits.gradients, delta, floor_e)
            v *= (factor / (one - rate)) * e * (factor / (one - rate))
            vb *= shared_factor * eb * shared_factor
            is_b = 2.0 * vb * p_b[i] > v
        if is_b:
            red += background[i, 0]
            green += background[i, 1]
            blue += background[i, 2]
            weight = one if changed else limits.image_rate
            for c in range(3):
                background[i, c] += weight * (np.float32(pixels[i, c]) - background[i, c])
            more_red += background[i, 0]
            more_green += background[i, 1]
            more_blue += background[i, 2]
        p_b[i] += rate * ((one if is_b else np.float32(0.0)) - p_b[i])
        shared_factor = factor
        if conditional:
            if is_b:
                factor_shared[i] *= one - rate
            shared_factor = factor_shared[i]
        grow_shared = rate / shared_factor if is_b else np.float32(0.0)
        learn(COLOUR, colours, i, colour, grow, grow_shared, delta, floor_c)
        learn(GRADIENT, edges, i, edge, grow, grow_shared, delta, floor_e)
        learn(PAIR, pairs, i, pair, grow, grow_shared, delta_p, floor_c)
        if is_b:
            if conditional and shared_factor < FADED:
                for table in (colours, edges, pairs):
                    for k in range(table.shared.shape[0]):
                        table.shared[k, i] *= shared_factor
                factor_shared[i] = one
            continue
        mask[i] = True
        count += 1
        if training or foreign(colours, i, limits.colours, p_b[i], factor, shared_factor) <= limits.once_off:
            continue
        turn(colours, i, limits.colours, p_b[i], factor, shared_factor)
        turn(edges, i, limits.gradients, p_b[i], factor, shared_factor)
        turn(pairs, i, limits.pairs, p_b[i], factor, shared_factor)
        p_b[i] = one - p_b[i]
    light = (
        more_red / red if red > 0.0 else 1.0,
        more_green / green if green > 0.0 else 1.0,
        more_blue / blue if blue > 0.0 else 1.0,
    )
    return count, light


@njit(cache=True)
def _carry(background, mask, light):  # type: ignore[no-untyped-def]
    """Let the background behind the foreground follow the light of what is seen."""
    for i in range(mask.size):
        if mask[i]:
            for c in range(3):
                background[i, c] = min(background[i, c] * light[c], np.float32(255.0))
