"""How to learn it by trying: Algorithm 1 of the paper and its relatives, compiled."""
