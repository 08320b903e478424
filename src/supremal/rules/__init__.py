"""How people say it: each module turns one way of writing a rule into an automaton."""
