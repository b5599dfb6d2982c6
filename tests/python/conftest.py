"""For all tests: hypothesis draws the same examples each time, and how long one takes fails none; Ctrl-C is
heeded, though a shell lets what it starts in the background ignore it, which is handed down."""

import signal

from hypothesis import settings

settings.register_profile("bslam", deadline=None, derandomize=True)
settings.load_profile("bslam")
signal.signal(signal.SIGINT, signal.default_int_handler)
