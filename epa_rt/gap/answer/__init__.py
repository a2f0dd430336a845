"""The parts of an answer: numbers with intervals, who has an effect, the patched plant file."""
