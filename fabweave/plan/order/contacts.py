"""Find which pieces meet, and what each finds in its way once the other is in place."""

from collections.abc import Sequence

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from fabweave.core.arrays import IntArray, frozen_value
from fabweave.piece.piece import Piece
from fabweave.plan.order.effort import State


@frozen_value
class Contacts:
    """Which pieces cross or join which, in terms of ``effort.State``.

    Parameters
    ----------
    n_stations : tuple of int
        Stations of each piece.
    alone : tuple of int
        The state in which each piece finds itself before any other is in place: it may cross
        itself, or join its own end.
    meets : tuple of tuples (other, here, there)
        For each piece every other that it meets, the bits of its own state that the other sets
        when it is in place first, and the bits of the other's state that it sets itself.
    component : (N,) int array
        Pieces that hang together have the same number, from 0 in order of their first pieces.
    """

    n_stations: tuple[int, ...]
    alone: tuple[int, ...]
    meets: tuple[tuple[tuple[int, int, int], ...], ...]
    component: IntArray


def find_contacts(pieces: Sequence[Piece]) -> Contacts:
    """Find what every piece meets, at its crossings and at its ends.

    Parameters
    ----------
    pieces : sequence of Piece
        All pieces of a job.

    Returns
    -------
    Contacts
        In time and memory proportional to the number of stations.
    """
    # Who carries each strand: (piece, station) twice where two lap there, in order of the thread.
    carriers: dict[tuple[int, bool], list[tuple[int, int]]] = {}
    for number, piece in enumerate(pieces):
        for station, strand in enumerate(
            zip(piece.crossings.tolist(), piece.over.tolist(), strict=True)
        ):
            carriers.setdefault(strand, []).append((number, station))
    begins = {piece.start_joint: number for number, piece in enumerate(pieces)}
    ends = {piece.end_joint: number for number, piece in enumerate(pieces)}
    alone, contacts = [], []
    for number, piece in enumerate(pieces):
        bits = State(len(piece.crossings))
        met: dict[int, int] = {}
        for station, (crossing, over) in enumerate(
            zip(piece.crossings.tolist(), piece.over.tolist(), strict=True)
        ):
            for second, (other, _) in enumerate(carriers.get((crossing, not over), ())):
                bit = bits.strand(station, over=over, second=bool(second))
                met[other] = met.get(other, 0) | bit
        for joint, others, end in (
            (piece.start_joint, ends, False),
            (piece.end_joint, begins, True),
        ):
            if joint is not None:
                met[others[joint]] = met.get(others[joint], 0) | bits.mate(end=end)
        alone.append(met.pop(number, 0))
        contacts.append(met)
    meets = tuple(
        tuple((other, here, contacts[other][number]) for other, here in sorted(met.items()))
        for number, met in enumerate(contacts)
    )
    return Contacts(
        tuple(len(piece.crossings) for piece in pieces), tuple(alone), meets, _components(meets)
    )


def _components(meets: Sequence[Sequence[tuple[int, int, int]]]) -> IntArray:
    """Give pieces that hang together the same number."""
    rows = np.repeat(np.arange(len(meets)), [len(met) for met in meets])
    columns = np.array([other for met in meets for other, _, _ in met], dtype=np.int64)
    graph = sparse.coo_array(
        (np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(len(meets), len(meets))
    )
    return np.asarray(csgraph.connected_components(graph, directed=False)[1], dtype=np.int64)
