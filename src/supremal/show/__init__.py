"""Pictures, curves and the report: what a run found, for people to look at."""
