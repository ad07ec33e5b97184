import pytest

from tests.benchmarks.lines import Line, table


@pytest.mark.parametrize(
    ("least", "most", "wanted", "verdict"),
    [
        (None, None, "", ""),
        (2.0, None, ">= 2", "ok"),
        (2.1, None, ">= 2.1", "MISSED"),
        (None, 2.0, "<= 2", "ok"),
        (None, 1.9, "<= 1.9", "MISSED"),
    ],
)
def test_a_line_says_what_is_wanted_and_whether_it_was_met(least, most, wanted, verdict):
    line = Line(what="speed", measured=2.0, least=least, most=most)
    assert (line.wanted, line.verdict) == (wanted, verdict)
    assert table([line]).splitlines()[1].split() == ["speed", "2.00", *wanted.split(), *verdict.split()]
