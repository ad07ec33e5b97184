"""Statistical background model: Li, Huang, Gu, Tian, TIP 13(11), 2004; eqs. (1)-(18) of paper 3.

Each pixel learns how often it shows which colour, gradient and pair of successive colours, and how often as
background. A pixel that differs neither from the background image nor from the frame before is background;
one that keeps still is judged by colour and gradient, eq. (7), one that moves by its pair of colours,
eq. (4). What stays for long becomes background at once, eqs. (12)-(14).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.motorcycle_lane.change import carry, corner, differences, histogram, keep, unhide
from tracker.motorcycle_lane.features import Features, extract
from tracker.motorcycle_lane.tables import (
    COLOUR,
    GRADIENT,
    PAIR,
    Entries,
    Table,
    all_same,
    approach,
    evidence,
    fade,
    found_anew,
    learn,
    totals,
    turn,
)

ROUNDING = 0.01
"""All p(v) of a pixel exceed 1 by less."""
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
        flash_share: By how much the share of foreground pixels must have grown at once for the light to have
            changed. Raising it withstands larger objects, and misses a sun that only shines on a part.
        flash_frames: Successive frames of such a share before all is learnt anew.
        follow_light: Whether the background image behind foreground follows the light of the rest, so it
            fits when it is seen again; also when all is learnt anew.
        uncovered: Whether a pixel that moved and now equals the background image is background, whatever its
            pair of colours. As printed the pair decides, and the strip that an object has just uncovered is
            foreground.
        rims: Whether what is changed beside foreground is learnt as foreground, too, though it looks like
            background. As printed, every pixel of an object that does is written into the background image
            and into the tables as background, and the next object is the less seen there.
        revise: Whether, as long as all frames weigh the same, what a pixel shows most often becomes its
            background, though the training saw another.
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
    least_change: int = 12
    most_change: int = 30
    flash_share: float = 0.25
    flash_frames: int = 1
    follow_light: bool = True
    uncovered: bool = True
    rims: bool = True
    revise: bool = True

    def __post_init__(self) -> None:
        for name in ("colours", "gradients", "pairs"):
            used, kept = getattr(self, name)
            if not (1 <= used <= kept and kept >= 2):
                raise ValueError(f"{name} is {(used, kept)}, wanted N, M with 1 <= N <= M and M >= 2")


PAPER = BackgroundParameters(
    mode=StatMode.JOINT,
    tolerance=0.005,
    colour_floor=0.0,
    least_change=10,
    flash_share=0.5,
    flash_frames=3,
    follow_light=False,
    uncovered=False,
    rims=False,
    revise=False,
)
"""As printed, with OpenCV's values where the paper's are lost."""


class BackgroundModel:
    """Background model of one camera.

    Attributes:
        parameters: As given.
    """

    def __init__(self, width: int, height: int, parameters: BackgroundParameters | None = None) -> None:
        self.parameters = p = BackgroundParameters() if parameters is None else parameters
        self._shape = height, width
        pixels = height * width
        self._tables = tuple(Table.empty(most, pixels) for _, most in (p.colours, p.gradients, p.pairs))
        self._background = np.zeros((3, pixels), np.float32)
        self._picture: NDArray[np.uint8] | None = None  # the same in bytes, once it is asked for
        self._previous = np.zeros(pixels, np.uint32)
        self._p_b = np.zeros(pixels, np.float32)  # one for all tables: all learn from the same frames
        self._factor = np.float32(1.0)
        self._factor_shared = np.ones(pixels, np.float32)
        # Whether p(v|b) has a factor of its own, by pixel: in conditional mode once the training is over.
        self._conditional = False
        # Weight of what came before p(v|b) and p(b) were last begun.
        self._earlier = np.float32(0.0)
        self._frames = self._flashing = 0
        # Foreground of the last frame that was no flash, and its share.
        self._foreground = np.zeros(pixels, np.bool_)
        self._calm = 0.0

    @property
    def background(self) -> NDArray[np.uint8]:
        """The background image, (H, W, 3) RGB."""
        if self._picture is None:
            channels = [cv2.convertScaleAbs(channel) for channel in self._background.reshape(3, *self._shape)]
            self._picture = np.asarray(cv2.merge(channels))
        return self._picture

    @property
    def training(self) -> bool:
        """Whether the next frame belongs to the training."""
        return self._frames < self.parameters.start_frames

    def statistics(self, row: int, column: int) -> tuple[NDArray[np.float64], ...]:
        """Return what a pixel has learnt: (K, 2) p(v) and p(v|b) of colours, gradients and pairs."""
        i = row * self._shape[1] + column
        shared = self._factor_shared[i] if self._conditional else self._factor
        factors = np.array([self._factor, shared], np.float64)
        both = (table.values(i) for table in self._tables)
        return tuple(factors * values[values[:, 0] > 0] for values in both)

    def apply(self, image: NDArray[np.uint8]) -> NDArray[np.bool_]:
        """Classify and learn one frame.

        Args:
            image: (H, W, 3) uint8 RGB.

        Returns:
            (H, W) foreground, raw: see `tracker.blobs.clean`.

        Raises:
            ValueError: If the image has another size than the model.
        """
        if image.shape != (*self._shape, 3):
            raise ValueError(f"image is {image.shape}, wanted {(*self._shape, 3)}")
        p = self.parameters
        image = np.ascontiguousarray(image)
        if self._frames == 0:
            self._begin(image)
            mask = np.zeros(len(self._p_b), np.bool_)
        else:
            if self._frames == p.start_frames // 2:
                self._begin_background()
            if self._frames == p.start_frames:
                self._settle()
            mask = self._step(image)
            share = np.count_nonzero(mask) / mask.size
            flash = share > self._calm + p.flash_share and not self.training
            self._flashing = self._flashing + 1 if flash else 0
            if self._flashing == p.flash_frames:
                mask = self._begin_again(image, mask)
            if self._flashing == 0:
                self._foreground, self._calm = mask, np.count_nonzero(mask) / mask.size
        self._frames += 1
        return mask.reshape(self._shape)

    def _step(self, image: NDArray[np.uint8]) -> NDArray[np.bool_]:
        """Classify a frame, then learn from it; returns the foreground (P,)."""
        self._picture = None
        p, one = self.parameters, np.float32(1.0)
        features = extract(image, self._previous)
        far, moved = differences(features[0], self._background, self._previous)
        self._previous = features[0]
        is_far = far > corner(histogram(far), p.least_change, p.most_change)
        is_moved = moved > corner(histogram(moved), p.least_change, p.most_change)
        changed = is_far if p.uncovered else is_far | is_moved
        background = self._classify(features, changed, is_moved)
        found = ~background
        foreground = self._with_rims(found, changed) if p.rims else found
        background = ~foreground
        light = keep(self._background, features[0], background, changed, p.image_rate)
        if p.follow_light:
            carry(self._background, foreground, light)
        rate = np.float32(max(p.rate, 1.0 / (self._frames + 1)))
        self._earlier *= one - rate
        self._factor *= one - rate
        approach(self._p_b, background, rate)
        grow = rate / self._factor
        grow_shared = fade(self._factor_shared, background, rate) if self._conditional else background * grow
        for kind, table, feature, tolerance, floor in self._kinds(features):
            learn(kind, table, feature, grow, grow_shared, tolerance, floor)
        if not self.training:
            self._turn_once_off(np.flatnonzero(foreground))
            if p.revise and self._frames * p.rate < 1.0:
                self._revise(image, features, np.flatnonzero(found))
        self._take_in()
        return found

    def _kinds(self, features: Features) -> Iterator[tuple[int, Table, NDArray[np.uint32], float, float]]:
        """Yield each kind of feature with its table, what the frame shows, and what tells two apart."""
        p = self.parameters
        tolerances = p.tolerance, p.tolerance, p.pair_tolerance
        floors = p.colour_floor, p.gradient_floor, 0.0
        yield from zip((COLOUR, GRADIENT, PAIR), self._tables, features, tolerances, floors, strict=True)

    def _entries(self) -> Iterator[Entries]:
        """Yield the usual entries and the rest of each table."""
        for table in self._tables:
            yield from table

    def _with_rims(self, foreground: NDArray[np.bool_], changed: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return (P,) foreground and what is changed beside more than specks of it."""
        picture = foreground.reshape(self._shape).view(np.uint8)
        near = cv2.dilate(cv2.medianBlur(picture, 3), np.ones((3, 3), np.uint8))
        return np.asarray(foreground | (changed & near.reshape(-1).view(np.bool_)))

    def _classify(
        self, features: Features, changed: NDArray[np.bool_], moved: NDArray[np.bool_]
    ) -> NDArray[np.bool_]:
        """Tell what of the changed pixels is background, too: eqs. (4), (7), (15), (16)."""
        p = self.parameters
        colours, gradients, pairs = self._tables
        background = ~changed
        if self.training:
            at = np.flatnonzero(changed)
            seen, _ = evidence(COLOUR, colours, features[0], at, 1, p.tolerance, p.colour_floor)
            background[at] = seen > 0.0
            return background
        at = np.flatnonzero(changed & moved)
        v, vb = evidence(PAIR, pairs, features[2], at, p.pairs[0], p.pair_tolerance, 0.0)
        background[at] = 2.0 * vb * self._shared_factors(at) * self._p_b[at] > v * self._factor
        at = np.flatnonzero(changed & ~moved)
        c, cb = evidence(COLOUR, colours, features[0], at, p.colours[0], p.tolerance, p.colour_floor)
        # A colour that never was background is none, whatever the gradient.
        at, c, cb = (values[cb > 0.0] for values in (at, c, cb))
        e, eb = evidence(GRADIENT, gradients, features[1], at, p.gradients[0], p.tolerance, p.gradient_floor)
        shared = self._shared_factors(at)
        background[at] = 2.0 * cb * shared * eb * shared * self._p_b[at] > c * self._factor * e * self._factor
        return background

    def _turn_once_off(self, at: NDArray[np.int64]) -> None:
        """Make background of what has stayed for long: eqs. (13), (14), judged by colour.

        Args:
            at: Pixels that are foreground.
        """
        p = self.parameters
        # All p(v) sum to 1 at most, and most pixels have seen too much background by one colour alone.
        least = self._p_b[at] * self._tables[0].usual.shared[at] * self._shared_factors(at)
        at = at[least < 1.0 + ROUNDING - p.once_off]
        seen, shared = totals(self._tables[0], at, p.colours[0])
        foreign = seen * self._factor - self._p_b[at] * shared * self._shared_factors(at)
        at = at[foreign > p.once_off]
        for table, (used, _) in zip(self._tables, (p.colours, p.gradients, p.pairs), strict=True):
            turn(table, at, used, self._p_b[at], self._factor, self._shared_factors(at))
        self._p_b[at] = 1.0 - self._p_b[at]

    def _revise(self, image: NDArray[np.uint8], features: Features, at: NDArray[np.int64]) -> None:
        """Make background of what a pixel shows now and has shown most often: traffic had stood there.

        Args:
            image: (H, W, 3) RGB.
            features: Of the frame.
            at: Pixels that are foreground.
        """
        p = self.parameters
        usual = self._tables[0].usual
        at = at[all_same(COLOUR, usual.features[at], features[0][at], p.tolerance, p.colour_floor)]
        self._p_b[at] = np.maximum(self._p_b[at], usual.seen[at] * self._factor)
        whole = np.ones(len(at), np.float32) if self._conditional else self._p_b[at]
        whole /= self._shared_factors(at)
        for kind, table, feature, tolerance, floor in self._kinds(features):
            found_anew(kind, table, feature, at, whole, tolerance, floor)
        self._background[:, at] = image.reshape(-1, 3)[at].T

    def _shared_factors(self, at: NDArray[np.int64]) -> NDArray[np.float32]:
        """Return the common factor of p(v|b) of some pixels."""
        return self._factor_shared[at] if self._conditional else np.full(len(at), self._factor)

    def _begin(self, image: NDArray[np.uint8]) -> None:
        """Take a frame for background, the only thing that each pixel has ever shown."""
        features = extract(image)
        for table, feature in zip(self._tables, features, strict=True):
            table.begin(feature)
        self._background[:], self._picture = image.reshape(-1, 3).T, None
        self._previous = features[0]
        self._p_b[:] = 1.0
        self._factor, self._earlier = np.float32(1.0), np.float32(0.0)
        self._conditional = False

    def _begin_again(self, image: NDArray[np.uint8], mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Learn all anew after the light has changed at once; returns the foreground (P,).

        As printed the next frame is the first of a training. But what hides the background now did so before,
        so that the background is known, and needs none.
        """
        self._flashing = 0
        if not self.parameters.follow_light:
            self._frames = -1
            return mask
        shown = unhide(image, self.background, self._foreground.reshape(self._shape))
        self._begin(shown)
        self._conditional = self.parameters.mode is StatMode.CONDITIONAL
        self._factor_shared[:] = 1.0
        self._frames = self.parameters.start_frames
        return self._step(image)

    def _begin_background(self) -> None:
        """Forget what went for background so far: only now is it known what each pixel shows most often."""
        for entries in self._entries():
            entries.shared[:] = 0.0
        self._p_b[:] = 0.0
        self._earlier = np.float32(1.0)

    def _settle(self) -> None:
        """End the training: p(b) and p(v and b), seen in a part of it, stand for the whole."""
        share = np.float32(1.0) - self._earlier
        self._p_b /= share
        if self.parameters.mode is StatMode.JOINT:
            for entries in self._entries():
                entries.shared[:] /= share
            return
        self._conditional = True
        self._factor_shared[:] = 1.0
        scale = self._factor / (share * np.maximum(self._p_b, np.float32(1e-6)))
        for entries in self._entries():
            entries.shared.T[:] *= scale

    def _take_in(self) -> None:
        """Take common factors that have become small into the tables, and begin them again."""
        if self._factor < FADED:
            for entries in self._entries():
                entries.seen[:] *= self._factor
                if not self._conditional:
                    entries.shared[:] *= self._factor
            self._factor = np.float32(1.0)
        if self._conditional and self._factor_shared.min() < FADED:
            faded = np.flatnonzero(self._factor_shared < FADED)
            for entries in self._entries():
                entries.shared.T[..., faded] *= self._factor_shared[faded]
            self._factor_shared[faded] = 1.0
