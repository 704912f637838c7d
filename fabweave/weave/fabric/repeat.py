"""Describe fabrics that repeat: twills over a and under b, and satins."""

import math
import re
from dataclasses import dataclass, replace

from fabweave.core.errors import InputError

#: Longest repeat; a window of passes fits a 64-bit integer.
_LONGEST = 60


@dataclass(frozen=True)
class Fabric:
    """A fabric whose every thread repeats one sequence, shifted from thread to thread.

    Crossings carry labels modulo ``repeat``, which step by 1 from crossing to crossing along the
    weft and by ``shift`` along the warp; the warp lies on top where the label is less than
    ``over``.

    Parameters
    ----------
    over : int
        How many weft threads the warp passes over in a repeat.
    under : int
        How many it passes under.
    shift : int
        Steps from one weft thread to the next. 1 makes a twill: then the warp goes over ``over``
        in succession and under ``under``. A shift and its negative are one fabric in two hands:
        the smaller of both is kept.
    hand : {"", "S", "Z"}
        Which of the two is wanted; "" if either will do. Seen from outside with the warp upright,
        the diagonal of Z rises to the right and that of S to the left.

    Examples
    --------
    >>> fabric = Fabric(3, 1)
    >>> fabric.repeat, str(fabric), str(Fabric(4, 1, 2))
    (4, '3/1', 'satin:5/2')
    """

    over: int
    under: int
    shift: int = 1
    hand: str = ""

    def __post_init__(self) -> None:
        """Refuse what is not a fabric, and write the shift as the smaller of the two ways round."""
        if self.over < 1 or self.under < 1:
            raise InputError(
                f"a fabric goes over 1 or more and under 1 or more, not {self.over}/{self.under}"
            )
        if self.repeat > _LONGEST:
            raise InputError(f"a fabric repeats after at most {_LONGEST}, not {self.repeat}")
        common = math.gcd(self.shift, self.repeat)
        if common > min(self.over, self.under):
            good = [
                str(s)
                for s in range(1, self.repeat // 2 + 1)
                if math.gcd(s, self.repeat) <= min(self.over, self.under)
            ]
            raise InputError(
                f"with the shift {self.shift} some threads of a {self.over}/{self.under} fabric "
                f"would always lie on one side and fall off; shifts that work: {', '.join(good)}"
            )
        shift = self.shift % self.repeat
        object.__setattr__(self, "shift", min(shift, self.repeat - shift))

    @property
    def repeat(self) -> int:
        """Number of crossings after which a thread's sequence repeats."""
        return self.over + self.under

    @property
    def handed(self) -> bool:
        """Whether the fabric differs from its mirror image."""
        return 2 * self.shift != self.repeat

    def __str__(self) -> str:
        """Write the fabric as :func:`parse_fabric` reads it."""
        if self.hand:
            return f"{self.over}/{self.under}/{'-' if self.hand == 'S' else ''}{self.shift}"
        if self.shift != 1:
            if self.under == 1:
                return f"satin:{self.repeat}/{self.shift}"
            if self.over == 1:
                return f"sateen:{self.repeat}/{self.shift}"
        return f"{self.over}/{self.under}" + (f"/{self.shift}" if self.shift != 1 else "")


def parse_fabric(text: str) -> Fabric:
    """Read a fabric: ``a/b``, ``a/b/shift``, ``satin:n/shift`` or ``sateen:n/shift``.

    Parameters
    ----------
    text : str
        How many weft threads the warp passes over and under, and the shift from one weft thread
        to the next. A positive shift leads the diagonal to the right, a negative one to the left;
        where it is left out, it is 1 to either side. A satin shows the warp: over n - 1, under 1.
        A sateen shows the weft. Both have either hand.

    Returns
    -------
    Fabric

    Raises
    ------
    InputError
        If the text is something else, or the fabric would fall apart.

    Examples
    --------
    >>> parse_fabric("3/1"), parse_fabric("2/2/-1")
    (Fabric(over=3, under=1, shift=1, hand=''), Fabric(over=2, under=2, shift=1, hand='S'))
    >>> parse_fabric("satin:5/2")
    Fabric(over=4, under=1, shift=2, hand='')
    """
    twill = re.fullmatch(r"(\d{1,3})/(\d{1,3})(?:/(-?\d{1,3}))?", text.strip(), re.ASCII)
    if twill:
        fabric = Fabric(int(twill[1]), int(twill[2]), int(twill[3] or 1))
        if twill[3] is None or not fabric.handed:
            return fabric
        right = int(twill[3]) % fabric.repeat == fabric.shift
        return replace(fabric, hand="Z" if right else "S")
    satin = re.fullmatch(r"(satin|sateen):(\d{1,3})/(-?\d{1,3})", text.strip(), re.ASCII)
    if not satin:
        raise InputError(
            f"{text[:40]!r} is not a fabric; write a/b such as 3/1 or 2/2, a/b/shift such as "
            "2/2/1, or satin:n/shift such as satin:5/2"
        )
    ends, shift = int(satin[2]), int(satin[3])
    if ends < 3 or math.gcd(ends, shift) != 1:
        good = [str(s) for s in range(1, min(ends, _LONGEST) // 2 + 1) if math.gcd(s, ends) == 1]
        raise InputError(
            f"a {satin[1]} needs a repeat of 3 threads or more, and a shift that has no common "
            f"divisor with it, unlike {ends}/{shift}"
            + (f"; shifts that {ends} allows: {', '.join(good)}" if ends >= 3 else "")
        )
    return Fabric(ends - 1, 1, shift) if satin[1] == "satin" else Fabric(1, ends - 1, shift)
