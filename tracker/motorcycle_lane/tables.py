"""Tables of statistics of one pixel's features: eqs. (5), (6), (8)-(16) of paper 3.

A table holds for each pixel the features seen most often, how often: p(v), and how often as background:
p(v|b), sorted by p(v), of equals the latest first. Every frame all entries fade by (1 - rate) and the one
seen grows by the rate. Fading all of them would touch the whole memory in each frame, so a common factor is
kept aside instead: an entry holds its value divided by that factor, grows by rate / factor, and all others
stay as they are. Values are the same up to rounding, and so is the order. Most pixels need their first entry
alone, so those of all pixels lie side by side; the others lie pixel by pixel, as they are asked.

Features are packed into 32 bits: three bytes of colour; two signed bytes of gradient; six times five bits of
colour before and now.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

COLOUR, GRADIENT, PAIR = 0, 1, 2

LATEST = np.float32(1.0001)
"""Of two entries as frequent the later one comes first; frequencies are the same up to this factor."""

# Three components of five bits, every ten bits: their places, bit 0, bits 0 to 7 and bit 8 of each.
LANES, ONES, REST, TOPS = (np.uint32(bits * 0x100401) for bits in (0x1F, 0x1, 0xFF, 0x100))


class Entries(NamedTuple):
    """Entries of a table, (P,) or (P, K): one or K of each pixel.

    Attributes:
        features: uint32.
        seen: float32, p(v) without the common factor; 0 is an empty entry.
        shared: float32, p(v|b) without its factor.
    """

    features: NDArray[np.uint32]
    seen: NDArray[np.float32]
    shared: NDArray[np.float32]

    @classmethod
    def empty(cls, *shape: int) -> Entries:
        """Return entries that are empty; memory is used as they are filled."""
        return cls(np.zeros(shape, np.uint32), np.zeros(shape, np.float32), np.zeros(shape, np.float32))


class Table(NamedTuple):
    """Statistics of one kind of feature, M entries for each of P pixels.

    Attributes:
        usual: (P,) the most frequent ones.
        rest: (P, M - 1) the others.
    """

    usual: Entries
    rest: Entries

    @classmethod
    def empty(cls, entries: int, pixels: int) -> Table:
        """Return a table without entries."""
        return cls(Entries.empty(pixels), Entries.empty(pixels, entries - 1))

    def begin(self, features: NDArray[np.uint32]) -> None:
        """Take features (P,) of the background for all that the pixels have ever shown."""
        self.usual.features[:] = features
        self.usual.seen[:] = self.usual.shared[:] = 1.0
        self.rest.seen[:] = 0.0

    def values(self, pixel: int) -> NDArray[np.float32]:
        """Return (M, 2) p(v) and p(v|b) of a pixel's entries, without their common factors."""
        usual, rest = self
        pairs = ((usual.seen, rest.seen), (usual.shared, rest.shared))
        return np.stack([np.append(first[pixel], others[pixel]) for first, others in pairs], 1)


@njit(cache=True)
def _near(a, b, tolerance):  # type: ignore[no-untyped-def]
    """Tell whether three components, each in five of ten bits, are all within a tolerance, in one go.

    Bit 8 of each ten is set by a + tolerance >= b, and in what is left again by a > b + tolerance.
    """
    offset = np.uint32(tolerance)
    above = a + (TOPS | ONES * offset) - b
    beyond = (above & REST) + ONES * (np.uint32(255) - offset - offset)
    return (above & ~beyond & TOPS) == TOPS


@njit(cache=True)
def same(kind, a, b, tolerance, floor):  # type: ignore[no-untyped-def]
    """Tell whether two features are identified with each other: eq. (8), for pairs (9).

    (8) is |a - b|^2 / (|a|^2 + |b|^2): a difference counts in proportion to the size. Below ``floor`` it is
    noise whatever the size, which also covers 0 / 0: two gradients of nothing but noise, in any direction,
    are the same.

    Args:
        kind: COLOUR, GRADIENT or PAIR.
        a: uint32.
        b: uint32.
        tolerance: delta; of a pair the largest difference of a component, in levels.
        floor: Distance |a - b| up to which features are the same; not used for pairs.
    """
    if a == b:
        return True
    if kind == PAIR:
        return _near(a & LANES, b & LANES, tolerance) and _near(
            (a >> np.uint32(5)) & LANES, (b >> np.uint32(5)) & LANES, tolerance
        )
    # Written out: a loop over components of which there are two or three is not unrolled.
    middle = np.int32(128 if kind == GRADIENT else 0)
    p, q = np.int32(a & 255) - middle, np.int32(b & 255) - middle
    apart, size = (p - q) * (p - q), p * p + q * q
    p, q = np.int32((a >> 8) & 255) - middle, np.int32((b >> 8) & 255) - middle
    apart, size = apart + (p - q) * (p - q), size + p * p + q * q
    if kind == COLOUR:
        p, q = np.int32((a >> 16) & 255), np.int32((b >> 16) & 255)
        apart, size = apart + (p - q) * (p - q), size + p * p + q * q
    return apart <= max(tolerance * size, floor * floor)


@njit(cache=True)
def all_same(kind, entries, features, tolerance, floor):  # type: ignore[no-untyped-def]
    """Tell of (P,) pairs of features what `same` tells of one."""
    count = features.size
    found = np.empty(count, np.bool_)
    if kind == PAIR:
        for i in range(count):
            a, b = entries[i], features[i]
            early = _near(a & LANES, b & LANES, tolerance)
            found[i] = early & _near((a >> np.uint32(5)) & LANES, (b >> np.uint32(5)) & LANES, tolerance)
        return found
    # Whole numbers below 2^24: float32 holds them as they are.
    a, b, noise = entries.view(np.uint8), features.view(np.uint8), floor * floor
    middle = np.float32(128.0 if kind == GRADIENT else 0.0)
    third = np.float32(0.0 if kind == GRADIENT else 1.0)
    for i in range(count):
        p0, q0 = np.float32(a[4 * i]) - middle, np.float32(b[4 * i]) - middle
        p1, q1 = np.float32(a[4 * i + 1]) - middle, np.float32(b[4 * i + 1]) - middle
        p2, q2 = np.float32(a[4 * i + 2]) * third, np.float32(b[4 * i + 2]) * third
        apart = (p0 - q0) * (p0 - q0) + (p1 - q1) * (p1 - q1) + (p2 - q2) * (p2 - q2)
        size = p0 * p0 + q0 * q0 + p1 * p1 + q1 * q1 + p2 * p2 + q2 * q2
        found[i] = (apart <= tolerance * size) | (apart <= noise)
    return found


@njit(cache=True)
def evidence(kind, table, features, at, first, tolerance, floor):  # type: ignore[no-untyped-def]
    """Sum p(v) and p(v|b) over the first N entries that are identified with a feature: eqs. (15), (16).

    Args:
        kind: COLOUR, GRADIENT or PAIR.
        table: Of P pixels.
        features: (P,) uint32.
        at: (K,) the pixels asked for.
        first: N.
        tolerance: As in `same`.
        floor: As in `same`.

    Returns:
        Two (K,) float32, both without their common factors.
    """
    usual, rest = table.usual, table.rest
    seen, shared = np.zeros(at.size, np.float32), np.zeros(at.size, np.float32)
    for a in range(at.size):
        i = at[a]
        if same(kind, usual.features[i], features[i], tolerance, floor):
            seen[a], shared[a] = usual.seen[i], usual.shared[i]
        for k in range(first - 1):
            if rest.seen[i, k] == 0.0:
                break
            if same(kind, rest.features[i, k], features[i], tolerance, floor):
                seen[a] += rest.seen[i, k]
                shared[a] += rest.shared[i, k]
    return seen, shared


@njit(cache=True)
def totals(table, at, first):  # type: ignore[no-untyped-def]
    """Sum p(v) and p(v|b) over all of the first N entries of pixels ``at``; two (K,) as in `evidence`."""
    seen, shared = table.usual.seen[at], table.usual.shared[at]
    for a in range(at.size):
        for k in range(first - 1):
            if table.rest.seen[at[a], k] == 0.0:
                break
            seen[a] += table.rest.seen[at[a], k]
            shared[a] += table.rest.shared[at[a], k]
    return seen, shared


@njit(cache=True)
def approach(p_b, is_background, rate):  # type: ignore[no-untyped-def]
    """Let p(b) (P,) of each pixel follow whether it is background (P,), in place: eq. (10)."""
    for i in range(p_b.size):
        p_b[i] += rate * (np.float32(is_background[i]) - p_b[i])


@njit(cache=True, error_model="numpy")
def fade(factors, is_background, rate):  # type: ignore[no-untyped-def]
    """Let what was learnt of background pixels fade, in place, and return by how much the newest grows.

    Args:
        factors: (P,) float32, common factors of p(v|b).
        is_background: (P,) bool; the others stay as they are.
        rate: float32, alpha.

    Returns:
        (P,) float32, rate / factor of background pixels, 0 of others, as `learn` takes it.
    """
    nothing, whole = np.float32(0.0), np.float32(1.0)
    grow = np.empty(factors.size, np.float32)
    for i in range(factors.size):
        factors[i] *= whole - rate if is_background[i] else whole
        part = rate / factors[i]
        grow[i] = part if is_background[i] else nothing
    return grow


@njit(cache=True)
def _put(entries, at, feature, seen, shared):  # type: ignore[no-untyped-def]
    """Write an entry."""
    entries.features[at], entries.seen[at], entries.shared[at] = feature, seen, shared


@njit(cache=True)
def learn(kind, table, features, grow, grow_shared, tolerance, floor):  # type: ignore[no-untyped-def]
    """Count one feature of each pixel: eqs. (10), (11), after the common factors have faded.

    Of several identified entries the most frequent grows. An unknown feature takes the last entry's place,
    with p(v|b) = rate only if it was background: as printed, (11) would make any new colour background at
    its second sight.

    Args:
        kind: COLOUR, GRADIENT or PAIR.
        table: M >= 2 entries for each of P pixels.
        features: (P,) uint32.
        grow: float32, rate / factor of p(v).
        grow_shared: (P,) float32, rate / factor of p(v|b) where the pixel is background, else 0.
        tolerance: As in `same`.
        floor: As in `same`.
    """
    usual, rest = table.usual, table.rest
    last, nothing = rest.seen.shape[1] - 1, np.float32(0.0)
    # Nearly all pixels show their first entry: that is told, and counted, without a branch.
    shown = all_same(kind, usual.features, features, tolerance, floor)
    for i in range(features.size):
        usual.seen[i] += grow if shown[i] else nothing
        usual.shared[i] += grow_shared[i] if shown[i] else nothing
    for i in range(features.size):
        if shown[i]:
            continue
        feature = features[i]
        k, known = 0, False
        while rest.seen[i, k] > 0.0:
            known = same(kind, rest.features[i, k], feature, tolerance, floor)
            if known or k == last:
                break
            k += 1
        seen, shared = grow, grow_shared[i]
        if known:
            feature = rest.features[i, k]
            seen += rest.seen[i, k]
            shared += rest.shared[i, k]
        while k > 0 and rest.seen[i, k - 1] <= seen * LATEST:
            _put(rest, (i, k), rest.features[i, k - 1], rest.seen[i, k - 1], rest.shared[i, k - 1])
            k -= 1
        if k == 0 and usual.seen[i] <= seen * LATEST:
            _put(rest, (i, 0), usual.features[i], usual.seen[i], usual.shared[i])
            _put(usual, i, feature, seen, shared)
        else:
            _put(rest, (i, k), feature, seen, shared)


@njit(cache=True)
def _turned(seen, shared, p_b, factor, factor_shared):  # type: ignore[no-untyped-def]
    """Return what p(v|b) of one entry becomes in `turn`, without its factor."""
    whole, whole_shared = seen * factor, shared * factor_shared
    if 2.0 * whole_shared * p_b > whole:
        return shared
    return (whole - p_b * whole_shared) / ((np.float32(1.0) - p_b) * factor_shared)


@njit(cache=True)
def turn(table, at, first, p_b, factor, factors_shared):  # type: ignore[no-untyped-def]
    """Make what was foreground background: eq. (14).

    What was background by eq. (4) stays so, as it is: as printed it would turn into foreground, and be a
    ghost for as long again when what has been absorbed leaves.

    Args:
        table: Of P pixels.
        at: (K,) the pixels to turn.
        first: N.
        p_b: (K,) their p(b) before.
        factor: Common factor of p(v).
        factors_shared: (K,) common factor of p(v|b).
    """
    usual, rest = table.usual, table.rest
    for a in range(at.size):
        i = at[a]
        usual.shared[i] = _turned(usual.seen[i], usual.shared[i], p_b[a], factor, factors_shared[a])
        for k in range(first - 1):
            if rest.seen[i, k] == 0.0:
                break
            rest.shared[i, k] = _turned(rest.seen[i, k], rest.shared[i, k], p_b[a], factor, factors_shared[a])


@njit(cache=True)
def found_anew(kind, table, features, at, whole, tolerance, floor):  # type: ignore[no-untyped-def]
    """Take what pixels show for what their background always shows; what else it has shown stays known.

    Args:
        kind: COLOUR, GRADIENT or PAIR.
        table: Of P pixels.
        features: (P,) uint32, learnt already.
        at: (K,) the pixels.
        whole: (K,) float32, what p(v|b) becomes, without its common factor.
        tolerance: As in `same`.
        floor: As in `same`.
    """
    usual, rest = table.usual, table.rest
    for a in range(at.size):
        i = at[a]
        if same(kind, usual.features[i], features[i], tolerance, floor):
            usual.shared[i] = whole[a]
            continue
        for k in range(rest.seen.shape[1]):
            if rest.seen[i, k] == 0.0:
                break
            if same(kind, rest.features[i, k], features[i], tolerance, floor):
                rest.shared[i, k] = whole[a]
                break
