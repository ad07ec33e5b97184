"""What holds for all tests."""

from hypothesis import settings

# No test is timed: the first example of many compiles a kernel.
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")
