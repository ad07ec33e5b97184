import pytest

from tests.validation.occurrence import run


@pytest.mark.slow
def test_vehicles_lie_in_the_rows_that_the_paper_says():
    found = run()
    assert found["share in the band"] == pytest.approx(0.9, abs=0.05)
    assert found["total variation of rows"] <= 0.10
