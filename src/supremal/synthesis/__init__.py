"""What can be enforced: controllability, and the closest behaviour that a supervisor can keep."""
