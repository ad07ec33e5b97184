"""Marginals of random matchings: how probable each pair of a row and a column is, exactly.

A matching pairs some rows with some columns, none twice; its weight is the product of its pairs' odds. The
sum over all matchings is of the permanent's kind, so the rows are taken one after another and only the set of
used columns is remembered, and of that only the columns that earlier rows have wanted and later ones still
want: what EHM does with its nodes (Maskell, Briers, Wright, 2004). The state is a bit mask; a column's bit is
free again after the last row that wants it, so a long chain of neighbours costs as little as its widest
place. Rows and columns may change places, whichever is cheaper.
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def components(wanted):  # type: ignore[no-untyped-def]
    """Number the connected components of a bipartite graph.

    Args:
        wanted: (N, M) bool.

    Returns:
        (N,) and (M,) int64, the component of each row and column, from 0 in the order of the rows; columns
        that no row wants have -1.
    """
    rows, columns = wanted.shape
    of_row, of_column = np.full(rows, -1, np.int64), np.full(columns, -1, np.int64)
    stack = np.empty(rows, np.int64)
    count = 0
    for first in range(rows):
        if of_row[first] >= 0:
            continue
        of_row[first], stack[0], height = count, first, 1
        while height:
            height -= 1
            i = stack[height]
            for j in range(columns):
                if wanted[i, j] and of_column[j] < 0:
                    of_column[j] = count
                    for other in range(rows):
                        if wanted[other, j] and of_row[other] < 0:
                            of_row[other], stack[height] = count, other
                            height += 1
        count += 1
    return of_row, of_column


@njit(cache=True)
def plan(wanted):  # type: ignore[no-untyped-def]
    """Choose the order of the rows and the columns' bits; the next row is one that widens the state least.

    Args:
        wanted: (R, C) bool.

    Returns:
        Order (R,) of the rows; the bit (C,) of each column, -1 if a single row or none wants it; the position
        (C,) in the order of the last row that wants it; and the width (R,) of the state in bits at each row.
    """
    rows, columns = wanted.shape
    left = np.zeros(columns, np.int64)
    for i in range(rows):
        left += wanted[i]
    shared = left > 1
    order, widths = np.empty(rows, np.int64), np.zeros(rows, np.int64)
    bits, last = np.full(columns, -1, np.int64), np.full(columns, -1, np.int64)
    taken, done = np.zeros(columns, np.bool_), np.zeros(rows, np.bool_)
    for k in range(rows):
        best, least = -1, columns + 1
        for i in range(rows):
            if done[i]:
                continue
            growth = 0
            for j in range(columns):
                if wanted[i, j] and shared[j]:
                    growth += (bits[j] < 0) - (left[j] == 1)
            if growth < least:
                best, least = i, growth
        order[k], done[best] = best, True
        for j in range(columns):
            if wanted[best, j] and shared[j] and bits[j] < 0:
                bits[j] = np.argmin(taken)
                taken[bits[j]] = True
        widths[k] = columns - np.argmax(taken[::-1]) if taken.any() else 0
        for j in range(columns):
            if wanted[best, j]:
                left[j] -= 1
                if left[j] == 0:
                    last[j] = k
                    if shared[j]:
                        taken[bits[j]] = False
    return order, bits, last, widths


@njit(cache=True)
def states(widths):  # type: ignore[no-untyped-def]
    """Return how many states a plan goes through, as a float, since it may be beyond all integers."""
    return np.sum(2.0**widths)


@njit(cache=True, fastmath={"reassoc", "contract"})
def marginals(odds, order, bits, last, widths):  # type: ignore[no-untyped-def]
    """Sum over all matchings after a plan, forward and backward.

    Args:
        odds: (R, C) float64, the weight of each pair against both staying alone, >= 0; up to about 1e15,
            beyond which products may leave the range of float64.
        order: (R,) as from `plan`, like the rest.
        bits: (C,)
        last: (C,)
        widths: (R,)

    Returns:
        (R, C) probability of each pair.
    """
    rows, columns = odds.shape
    starts = np.zeros(rows + 1, np.int64)
    for k in range(rows):
        starts[k + 1] = starts[k] + (1 << widths[k])
    forward = np.zeros(starts[rows])
    widest = 1 << widths.max()
    after, backward = np.zeros(widest), np.zeros(widest)
    # Columns that nobody else wants need no memory: they share the row's staying alone.
    alone = np.ones(rows)
    for k in range(rows):
        for j in range(columns):
            if bits[j] < 0:
                alone[k] += odds[order[k], j]
    forward[0] = 1.0
    for k in range(rows - 1):
        here = forward[starts[k] : starts[k + 1]]
        size = here.size
        for m in range(size):
            after[m] = alone[k] * here[m]
        for j in range(columns):
            weight = odds[order[k], j]
            if bits[j] >= 0 and weight > 0.0:
                bit = 1 << bits[j]
                for base in range(0, size, 2 * bit):
                    for m in range(base, base + bit):
                        after[m + bit] += weight * here[m]
        for j in range(columns):
            if bits[j] >= 0 and last[j] == k:
                bit = 1 << bits[j]
                for base in range(0, size, 2 * bit):
                    for m in range(base, base + bit):
                        after[m] += after[m + bit]
                        after[m + bit] = 0.0
        following = forward[starts[k + 1] : starts[k + 2]]
        common = min(size, following.size)
        following[:common] = after[:common] / after[:common].max()
    found = np.zeros((rows, columns))
    backward[0] = 1.0
    known = 1
    for k in range(rows - 1, -1, -1):
        here = forward[starts[k] : starts[k + 1]]
        size = here.size
        common = min(size, known)
        after[:common] = backward[:common]
        after[common:size] = 0.0
        for j in range(columns):
            if bits[j] >= 0 and last[j] == k:
                bit = 1 << bits[j]
                for base in range(0, size, 2 * bit):
                    for m in range(base, base + bit):
                        after[m + bit] = after[m]
        single = 0.0
        for m in range(size):
            single += here[m] * after[m]
            backward[m] = alone[k] * after[m]
        total = alone[k] * single
        row = found[order[k]]
        for j in range(columns):
            weight = odds[order[k], j]
            if weight == 0.0:
                continue
            if bits[j] < 0:
                row[j] = weight * single
                continue
            bit, pair = 1 << bits[j], 0.0
            for base in range(0, size, 2 * bit):
                for m in range(base, base + bit):
                    pair += here[m] * after[m + bit]
                    backward[m] += weight * after[m + bit]
            row[j] = weight * pair
            total += row[j]
        row /= total
        backward[:size] /= backward[:size].max()
        known = size
    return found


@njit(cache=True)
def propagate(odds, tolerance, rounds):  # type: ignore[no-untyped-def]
    """Approximate the marginals by loopy belief propagation (Williams and Lau, IEEE T-AES 50(4), 2014).

    The messages always converge, faster where pairs are less sure. Errors are largest where a few rows
    compete for the same columns; in the project's reference case the largest is 0.026.

    Args:
        odds: (R, C) as in `marginals`.
        tolerance: Greatest change of a message at which the rounds end; smaller takes longer.
        rounds: Most rounds.

    Returns:
        (R, C) probability of each pair.
    """
    rows, columns = odds.shape
    free = np.ones((rows, columns))
    claims = np.zeros((rows, columns))
    for _ in range(rounds):
        for i in range(rows):
            total = 1.0
            for j in range(columns):
                total += odds[i, j] * free[i, j]
            for j in range(columns):
                claims[i, j] = odds[i, j] / max(total - odds[i, j] * free[i, j], 1.0)
        change = 0.0
        for j in range(columns):
            total = 1.0
            for i in range(rows):
                total += claims[i, j]
            for i in range(rows):
                value = 1.0 / max(total - claims[i, j], 1.0)
                change = max(change, abs(value - free[i, j]))
                free[i, j] = value
        if change < tolerance:
            break
    found = odds * free
    for i in range(rows):
        found[i] /= 1.0 + found[i].sum()
    return found
