"""For all tests: hypothesis draws the same examples each time, and how long one takes fails none."""

from hypothesis import settings

settings.register_profile("bslam", deadline=None, derandomize=True)
settings.load_profile("bslam")
