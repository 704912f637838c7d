"""Weigh the face and vertex conditions of a twill against its edge conditions."""

import math
import re
from dataclasses import dataclass
from fractions import Fraction

from fabweave.core.errors import InputError

_LEAST, _MOST = Fraction(1, 10), Fraction(10)


@dataclass(frozen=True)
class TwillWeights:
    """How much a broken face or vertex condition counts, where a broken edge condition counts 1.

    Edge conditions are the rhythm along each thread, over two and under two. Face and vertex
    conditions are what lines the steps of neighbouring threads up to diagonals.

    Parameters
    ----------
    face, vertex : Fraction
        The weights.

    References
    ----------
    Akleman, Chen, Chen, Xing, Gross, "Cyclic twill-woven objects", Computers & Graphics 35
    (2011), section 6.4.

    Examples
    --------
    >>> TwillWeights(Fraction(3, 2), Fraction(2)).whole
    (2, 3, 4)
    """

    face: Fraction = Fraction(1)
    vertex: Fraction = Fraction(1)

    @property
    def equal(self) -> bool:
        """Whether all conditions count alike."""
        return self.face == self.vertex == 1

    @property
    def whole(self) -> tuple[int, int, int]:
        """The least whole numbers in proportion: for edge, face and vertex conditions."""
        scale = math.lcm(self.face.denominator, self.vertex.denominator)
        return scale, int(self.face * scale), int(self.vertex * scale)

    def __str__(self) -> str:
        """Write the weights as :func:`parse_weights` reads them."""
        return f"{float(self.face):g}/{float(self.vertex):g}"


EQUAL = TwillWeights()


def parse_weights(text: str) -> TwillWeights:
    """Read the weights of face and vertex conditions.

    Raises
    ------
    InputError
        If the text is something else, or a weight is out of range.

    Examples
    --------
    >>> str(parse_weights("2/2")), str(parse_weights(" 1.50 / 3 "))
    ('2/2', '1.5/3')
    """
    found = re.fullmatch(r"(\d{1,2}(?:\.\d0*)?)\s*/\s*(\d{1,2}(?:\.\d0*)?)", text.strip(), re.ASCII)
    weights = TwillWeights(Fraction(found[1]), Fraction(found[2])) if found else None
    if weights is None or not all(_LEAST <= one <= _MOST for one in (weights.face, weights.vertex)):
        raise InputError(
            f"{text[:40]!r} are no weights of face and vertex conditions; write two numbers from "
            "0.1 to 10 with at most one decimal, such as 2/2"
        )
    return weights


def tidy_weights(text: str) -> str:
    """Return weights in their usual form."""
    return str(parse_weights(text))
