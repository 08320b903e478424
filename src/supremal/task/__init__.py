"""A task and what is done with it: check, supervise, learn, evaluate, write down."""
