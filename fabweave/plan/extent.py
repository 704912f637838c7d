"""Say how large a job may be for pictures of its steps, and for a viewer in one page."""

from fabweave.core.finding import Note

#: A manual of more steps has no picture of each: nobody could leaf through it.
MOST_PICTURED = 2_000
#: More crossings than these are no page that a browser shows at ease.
MOST_VIEWED = 30_000


def extent_notes(n_crossings: int, n_steps: int) -> list[Note]:
    """Say what a job is too large for, and what to use in its place.

    Parameters
    ----------
    n_crossings, n_steps : int

    Returns
    -------
    list of Note
        Nothing for most jobs.

    Examples
    --------
    >>> extent_notes(30_000, 2_000)
    []
    >>> extent_notes(100, 2_001)[0][:48]
    'assembly.pdf tells its 2,001 steps without a pic'
    """
    notes: list[str] = []
    if n_steps > MOST_PICTURED:
        notes.append(
            f"assembly.pdf tells its {n_steps:,} steps without a "
            f"picture of each: more than {MOST_PICTURED:,} pictures are too many to leaf through"
        )
    if n_crossings > MOST_VIEWED:
        told = (
            f"assembly.html is left out: {n_crossings:,} crossings are more than a browser shows "
            f"at ease ({MOST_VIEWED:,})"
        )
        instead = (
            "model.glb shows the object, assembly.pdf the steps, and stations.csv every piece "
            "station by station"
        )
        notes.append(Note("extent", told, instead))
    return Note.each("extent", notes)
