"""Name the threads with letters that nobody mistakes for digits."""

#: No I, O or Q: engraved, they pass for 1 and 0.
ALPHABET = "ABCDEFGHJKLMNPRSTUVWXYZ"


def thread_labels(count: int) -> tuple[str, ...]:
    """Return distinct labels A … Z, AA, AB … for the given number of threads.

    Examples
    --------
    >>> thread_labels(25)[-3:]
    ('Z', 'AA', 'AB')
    """
    labels = []
    for number in range(count):
        text, rest = "", number + 1
        while rest:
            rest, digit = divmod(rest - 1, len(ALPHABET))
            text = ALPHABET[digit] + text
        labels.append(text)
    return tuple(labels)
