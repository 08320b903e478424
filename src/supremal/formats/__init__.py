"""What files say: supremal's own JSON, read strictly."""

from supremal.formats.documents import Model, read_automaton, read_model, read_reward_machine

__all__ = ["Model", "read_automaton", "read_model", "read_reward_machine"]
