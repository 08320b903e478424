"""What each choice is worth: decision processes, reward machines, their product, safety and planning."""
