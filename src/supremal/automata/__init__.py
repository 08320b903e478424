"""What can happen: alphabets, automata, their products and their languages."""
