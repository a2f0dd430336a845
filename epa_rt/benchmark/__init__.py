"""The blind benchmark: cases whose truth is sealed, diagnosed by processes that cannot read it,
then scored.
"""
