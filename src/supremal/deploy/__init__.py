"""Supervisors away from supremal: as JSON, Python, C and structured text, each with tests of its own."""
