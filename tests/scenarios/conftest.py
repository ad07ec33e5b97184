"""What tests of whole episodes share."""

import pytest

from sim.render.context import RenderUnavailableError, context


@pytest.fixture(scope="session")
def gl():
    """Skip where nothing can be drawn."""
    try:
        context()
    except RenderUnavailableError as error:
        pytest.skip(str(error))
