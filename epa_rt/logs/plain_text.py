"""Text of others, as a log or a file of theirs holds it, made harmless for a terminal."""


def plain(text: str) -> str:
    """The text without what steers a terminal, turns its line round or fakes another line: each
    such sign becomes a blank or '?'. Line feeds stay, for they part the lines of our own texts.
    """
    if text.isascii() and text.isprintable():
        return text
    return "".join(c if c.isprintable() or c == "\n" else " " if c.isspace() else "?" for c in text)
