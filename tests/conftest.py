"""Settings that all tests share."""

import os
import signal

from hypothesis import settings

# A first call compiles, which no deadline allows for.  CI draws the same examples in every run.
settings.register_profile("here", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True, database=None)
settings.load_profile("ci" if os.environ.get("CI") else "here")

# What a shell starts in the background ignores Ctrl-C, and so do its children; some tests are about Ctrl-C.
signal.signal(signal.SIGINT, signal.default_int_handler)
