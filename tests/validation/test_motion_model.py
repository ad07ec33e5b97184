import pytest

from tests.validation.motion_model import run


@pytest.mark.slow
def test_picture_follows_the_papers_densities():
    distances = run()
    for name in ("background, family", "background, measured", "vehicles, lanes"):
        assert distances[name] <= 0.10, distances
