"""Spoil the manual: the check of it objects, and no other."""

import base64
import re
import zlib

import pytest
from pdf_writer import pdf_bytes
from verify_writers import write_manual

from fabweave.verify import verify_job
from fabweave.verify.read.manual import read_manual


def failed(folder):
    return set(verify_job(folder).failed)


def at(texts, wanted):
    return next(number for number, text in enumerate(texts) if text == wanted)


def rename_a_piece(texts):
    texts[:] = ["A99" if text == "A1" else text for text in texts]


def exchange_two_pieces_on_the_map(texts):
    one, two = at(texts, "A1"), at(texts, "A2")
    texts[one], texts[two] = texts[two], texts[one]


def lose_a_thread_on_the_map(texts):
    texts[at(texts, "Thread A")] = "Yarn A"


def on_the_map(texts):
    """Return where the first sign of the map stands."""
    return next(k for k in range(at(texts, "Thread A"), len(texts)) if texts[k] in ("●", "○"))


def turn_a_strand_on_the_map(texts):
    cell = on_the_map(texts)
    texts[cell] = "○" if texts[cell] == "●" else "●"


def lose_a_crossing_on_the_map(texts):
    del texts[on_the_map(texts) : on_the_map(texts) + 2]


def cross_another_piece_on_the_map(texts):
    texts[on_the_map(texts) + 1] = "A1"


def place_it_in_another_step(texts):
    cell = next(number for number, text in enumerate(texts) if "; steps: A1 " in text)
    texts[cell] = re.sub(r"A1 (\d+)", r"A1 9\1", texts[cell])


def say_another_joint_on_the_map(texts):
    cell = next(number for number, text in enumerate(texts) if re.fullmatch(r"#\d+", text))
    texts[cell] += "9"


def lose_a_sheet(texts):
    texts[:] = [text for text in texts if not text.startswith("sheet_01")]


def lose_a_step(texts):
    first, second = at(texts, "Step 1"), at(texts, "Step 2")
    del texts[first:second]


def exchange_two_steps(texts):
    one, two = at(texts, "Step 1"), at(texts, "Step 2")
    texts[one], texts[two] = texts[two], texts[one]


def exchange_the_words_of_two_steps(texts):
    one, two = at(texts, "Step 1"), at(texts, "Step 2")
    texts[one + 3 : one + 5], texts[two + 3 : two + 5] = (
        texts[two + 3 : two + 5],
        texts[one + 3 : one + 5],
    )


def change_a_step(texts):
    texts[at(texts, "Step 2") + 2] += "?"
    texts[at(texts, "Step 2") + 1] = "Do not put"


def on_a_card(texts):
    """Return where the first sign of a card stands."""
    start = at(texts, "Step 2")
    return next(k for k in range(start, len(texts)) if texts[k] in ("●", "○"))


def turn_over_to_under(texts):
    cell = on_a_card(texts)
    texts[cell] = "○" if texts[cell] == "●" else "●"


def cross_another_piece(texts):
    texts[on_a_card(texts) + 1] += "1"


def say_another_joint(texts):
    start = at(texts, "Step 1")
    cell = next(k for k in range(start, len(texts)) if re.fullmatch(r"#\d+>\w+", texts[k]))
    texts[cell] = texts[cell].replace("#", "#1")


def lose_a_station(texts):
    del texts[on_a_card(texts) : on_a_card(texts) + 2]


def lose_a_card(texts):
    start = at(texts, "Step 2")
    key = texts[start + 2].split(" ")[0]
    card = next(k for k in range(start, len(texts)) if texts[k] == key)
    last = next(k for k in range(card + 1, len(texts)) if texts[k] == key)
    del texts[card:last]


def complete_a_crossing_on_a_card(texts):
    texts.insert(on_a_card(texts) + 2, "⊕")


def in_a_picture(texts):
    """Return where the last sign stands in the picture of a step."""
    end = at(texts, "Step 3")
    return next(k for k in range(end - 1, 0, -1) if texts[k] in ("●", "○"))


def turn_a_strand_in_a_picture(texts):
    cell = in_a_picture(texts)
    texts[cell] = "○" if texts[cell] == "●" else "●"


def lose_a_name_in_a_picture(texts):
    del texts[in_a_picture(texts) : in_a_picture(texts) + 2]


def name_a_neighbour_twice(texts):
    cell = in_a_picture(texts)
    texts[cell:cell] = texts[cell : cell + 2]


def lose_a_sign(texts):
    del texts[in_a_picture(texts)]


def complete_another_crossing(texts):
    texts.insert(at(texts, "⊕"), "⊕")


def lose_a_scale(texts):
    del texts[at(texts, "1 : 2.5")]


def a_time(texts):
    return next(number for number, text in enumerate(texts) if re.fullmatch(r"\d+ min, .*", text))


def take_longer(texts):
    minutes, rest = texts[a_time(texts)].split(" ", 1)
    texts[a_time(texts)] = f"{int(minutes) + 1} {rest}"


def begin_an_hour_later(texts):
    texts[a_time(texts)] = texts[a_time(texts)].replace(", 0 h", ", 1 h")


def see_it_from_nowhere(texts):
    texts[at(texts, "Seen from the front right and above.")] = "Seen from the moon."


def turn_it_before_the_first_step(texts):
    cell = at(texts, "Seen from the front right and above.")
    texts[cell] = "Turn the object to see it from the front right and above."


def count_a_piece_less(texts):
    cell = next(number for number, text in enumerate(texts) if text.startswith("With these, "))
    texts[cell] = re.sub(r"\d+ of", "1 of", texts[cell])


def name_a_new_piece_late(texts):
    cell = next(number for number, text in enumerate(texts) if text.startswith("With these, "))
    texts[cell + 1], texts[cell + 2] = texts[cell + 2], texts[cell + 1]


def find_it_on_another_sheet(texts):
    cell = next(number for number, text in enumerate(texts) if text.endswith(" (sheet 1)"))
    texts[cell] = texts[cell].replace("sheet 1", "sheet 9")


def a_place(texts):
    return next(number for number, text in enumerate(texts) if re.search(r" at \d+, \d+", text))


def move_a_piece_on_its_sheet(texts):
    cell = a_place(texts)
    texts[cell] = re.sub(r" at (\d+)", lambda found: f" at {int(found[1]) + 2}", texts[cell])


def name_another_sheet(texts):
    texts[a_place(texts)] = texts[a_place(texts)].replace("sheet_01", "sheet_02")


def tell_of_more_alike(texts):
    texts[a_place(texts)] += ", kind 77 (x 5)"


def count_a_station_more(texts):
    cell = a_place(texts) - 1
    count, word = texts[cell].split()[-2:]
    texts[cell] = f"99 mm, {int(count) + 1} {word}"


SPOILED = [
    rename_a_piece, lose_a_sheet, lose_a_step, exchange_two_steps, exchange_the_words_of_two_steps,
    change_a_step, turn_over_to_under, cross_another_piece, place_it_in_another_step,
    say_another_joint, lose_a_station, lose_a_card, cross_another_piece_on_the_map,
    complete_a_crossing_on_a_card, exchange_two_pieces_on_the_map,
    lose_a_thread_on_the_map, move_a_piece_on_its_sheet, name_another_sheet, tell_of_more_alike,
    count_a_station_more, turn_a_strand_on_the_map, lose_a_crossing_on_the_map,
    say_another_joint_on_the_map, turn_a_strand_in_a_picture, lose_a_name_in_a_picture,
    name_a_neighbour_twice, lose_a_sign, complete_another_crossing, lose_a_scale, take_longer,
    begin_an_hour_later, see_it_from_nowhere, turn_it_before_the_first_step, count_a_piece_less,
    name_a_new_piece_late, find_it_on_another_sheet,
]  # fmt: skip


@pytest.mark.parametrize("kind", ["octahedron", "saddle"])
def test_the_manual_is_right(specimen, job, kind):
    folder = job(kind)
    write_manual(specimen(kind), folder)
    assert failed(folder) == set()


@pytest.mark.parametrize("spoil", SPOILED)
def test_a_spoiled_manual_is_found(specimen, job, spoil):
    folder = job()
    write_manual(specimen("octahedron"), folder, edit=spoil)
    # The viewer shows each step from where the manual says.
    moved = {"viewer"} if spoil is see_it_from_nowhere else set()
    assert failed(folder) == {"manual"} | moved


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"%PDF-1.4\n",
        pdf_bytes(b"BT (a) Tj ET").removesuffix(b"%%EOF\n"),
        pdf_bytes(b"BT ET"),
        pdf_bytes(),
        pdf_bytes(b"nothing packed", filters=b"/Filter /FlateDecode"),
        pdf_bytes(b"\x00\xff~>", filters=b"/Filter [ /ASCII85Decode ]"),
        # A little that unpacks to very much.
        pdf_bytes(zlib.compress(bytes(1 << 29), 9), filters=b"/Filter /FlateDecode"),
    ],
)
def test_what_is_no_manual_cannot_be_read(job, data):
    folder = job()
    (folder / "assembly.pdf").write_bytes(data)
    assert failed(folder) == {"files", "manual"}


def test_escapes_and_packing(tmp_path):
    shown = rb"(\(a\\b\) \351\t\r) Tj"
    packed = base64.a85encode(zlib.compress(shown)) + b"~>"
    path = tmp_path / "texts.pdf"
    filters = b"/Filter [ /ASCII85Decode /FlateDecode ]"
    for data in (pdf_bytes(shown), pdf_bytes(packed, filters=filters)):
        path.write_bytes(data)
        assert [page.texts for page in read_manual(path)] == [("(a\\b) \xe9\t\r",)]
