from __future__ import annotations

import hashlib
import subprocess
import sys

import numpy as np
import pytest

from sim.models import Surface
from sim.textures import SIZE, texture_array

ONCE = {Surface.SIGN, Surface.PLATE, Surface.TAIL_LAMP, Surface.HEAD_LAMP, Surface.RUBBER, Surface.PALETTE}


def test_shape_type_and_cache():
    layers = texture_array()
    assert layers.shape == (len(Surface), SIZE, SIZE, 4)
    assert layers.dtype == np.uint8
    assert texture_array() is layers
    assert not layers.flags.writeable


@pytest.mark.parametrize("surface", [s for s in Surface if s not in ONCE], ids=lambda s: s.name)
def test_layers_repeat_without_a_seam(surface):
    """The step across the border is no larger than the largest steps inside."""
    layer = texture_array()[surface, ..., :3].astype(float)
    for axis in (0, 1):
        inner = np.abs(np.diff(layer, axis=axis)).mean(axis=(1 - axis, 2))
        seam = np.abs(layer.take(0, axis) - layer.take(-1, axis)).mean()
        assert seam <= 1.2 * inner.max() + 1.0


def test_same_in_another_process():
    code = "import hashlib, sim.textures as t; print(hashlib.sha256(t.texture_array()).hexdigest())"
    here = hashlib.sha256(texture_array()).hexdigest()
    there = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env={"PYTHONHASHSEED": "7"}
    )
    assert there.stdout.strip() == here


def test_windows_are_marked_and_foliage_has_gaps():
    layers = texture_array()
    panes = layers[Surface.FACADE, ..., 3] > 127
    assert 0.05 < panes.mean() < 0.4
    assert layers[Surface.FACADE][panes][:, :3].mean() < 60
    leaves = layers[Surface.FOLIAGE, ..., :3].astype(float)
    assert leaves[..., 1].mean() > leaves[..., 2].mean()
    assert np.percentile(leaves.mean(axis=-1), 5) < 35
