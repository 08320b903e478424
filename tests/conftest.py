"""Settings that all tests share."""

import os

from hypothesis import settings

# A first call compiles, which no deadline allows for.  CI draws the same examples in every run.
settings.register_profile("here", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True, database=None)
settings.load_profile("ci" if os.environ.get("CI") else "here")
