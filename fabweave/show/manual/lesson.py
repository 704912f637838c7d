"""Write the sheet for a teacher: what to prepare, how a lesson goes, and what to find out."""

from fabweave.core.messages import agree
from fabweave.plan.crossing_map import CrossingMap
from fabweave.show.manual.book import LEADING, Book
from fabweave.show.manual.parts_list import bags_of

LESSON = "For the teacher"
_HEAD = 12.0


def write_lesson(book: Book, crossing_map: CrossingMap, seconds: float) -> None:
    """Write what a teacher wants to know of a job.

    Parameters
    ----------
    book : Book
    crossing_map : CrossingMap
    seconds : float
        How long all steps take hands that are at it for the first time.
    """
    book.page(LESSON)
    threads, crossings = len(crossing_map.threads), len(crossing_map.crossings)
    bags, steps = len(bags_of(crossing_map)), len(crossing_map.steps)
    rings = sum(thread.closed for thread in crossing_map.threads)
    for head, lines in (
        ("Before the lesson", (
            "Cut the sheets, and sort the pieces into bags: their labels are the last page.",
            f"For each group of two to four children: {agree(bags, '{n} [bag|bags]')}, the "
            "fasteners and clips of page 1, and one manual or a tablet with assembly.html.",
            "Build steps 1 to 5 yourself. Legs of brads are sharp: bend them flat at once.",
        )),
        ("The lesson", (
            "5 minutes: look at page 1 and at a strip. Find its name, its start, a tick, a hole.",
            f"{seconds / 60.0:.0f} minutes: {steps} steps. One child reads, one holds, one weaves; "
            "change places after each picture of the whole, and compare.",
            "5 minutes: take off the last clips, look for names that are still seen, and ask.",
        )),
        ("To find out", (
            f"Follow one strip with a finger until you are back. How many threads are there? "
            f"({threads}, of which {agree(rings, '{n} [is a ring|are rings]')}.)",
            f"Count the crossings of each thread, and add. Why is it twice the number of all "
            f"crossings? ({2 * crossings} and {crossings}: two strands meet at each.)",
            "Over and under: which rule do you see along a strip? Does it hold everywhere?",
            "Count the gaps around you: which have three sides, four, five? What would happen to "
            "a flat net of six-sided gaps if one had five?",
        )),
        ("What often goes wrong", (
            "A strip lies the wrong way round: its name and arrow are on the outer face.",
            "Over for under: at the next picture of the whole a name is still seen. Take the strip "
            "out as far as there.",
            "An end slips out: a clip was taken off too early.",
        )),
    ):  # fmt: skip
        book.y -= 8.0 + LEADING * _HEAD
        book.text(book.left, book.y, head, size=_HEAD, bold=True)
        for line in lines:
            book.room(40.0, LESSON)
            book.tick_box(book.left, book.y - 17.0)
            book.y = book.block(book.left + 18.0, book.y - 4.0, line, book.right - book.left - 18.0)
