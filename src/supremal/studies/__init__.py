"""Studies: one task learned many times, with many settings and seeds, on one core, all cores or a cluster."""
