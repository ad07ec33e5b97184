import subprocess
import sys

import numpy as np
import pytest

from sim.rng import stream


def test_the_same_name_gives_the_same_stream():
    assert np.array_equal(stream(3, "traffic", 1).random(8), stream(3, "traffic", 1).random(8))


def test_seeds_and_names_give_different_streams():
    draws = [
        stream(seed, *names).random(4).tobytes()
        for seed in (0, 1, 2**40)
        for names in (("traffic",), ("ego",), ("traffic", "parked"), ("traffic", 1), ("traffic", 11))
    ]
    assert len(set(draws)) == len(draws)


def test_streams_are_uncorrelated():
    a, b = stream(0, "traffic").normal(size=20_000), stream(0, "ego").normal(size=20_000)
    assert abs(np.corrcoef(a, b)[0, 1]) < 0.03


def test_a_stream_does_not_depend_on_the_hash_seed():
    code = "from sim.rng import stream; print(stream(7, 'light').random(3).tolist())"
    outs = [
        subprocess.run(
            [sys.executable, "-c", code],
            env={"PYTHONHASHSEED": seed, "PATH": ""},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in ("0", "12345")
    ]
    assert outs[0] == outs[1] == f"{stream(7, 'light').random(3).tolist()}\n"


def test_a_negative_seed_is_an_error():
    with pytest.raises(ValueError, match=">= 0"):
        stream(-1, "traffic")
