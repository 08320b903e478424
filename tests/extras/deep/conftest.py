"""One thread: the networks are small, and the machine may have more to do."""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")  # torch reads it when it is imported
