"""Read what is engraved from its strokes, without a font: the same letter always looks the same."""

import numpy as np

#: In parts of the height of a letter: the least gap between letters, and how alike they look.
GAP, SAME = 0.21, 0.02
#: How far strokes may be from the box that the map gives their label, millimetres.
SAME_MM = 0.02


def letters_of(piece, labels, drawing):
    """Yield the text of each label, without spaces, and the strokes of its letters, one high."""
    strokes = [shape.traced for shape in drawing.of("ENGRAVE_LABEL", piece.id)]
    for label in labels:
        half = np.array(label["box_mm"]) / 2 + SAME_MM
        runs = [_in_box(piece, label, points) for points in strokes]
        runs = sorted(
            (run for run in runs if np.all(np.abs(run) <= half)), key=lambda run: run[:, 0].min()
        )
        high, letters, reach = label["height_mm"], [], -np.inf
        for run in runs:
            if run[:, 0].min() > reach + GAP * high:
                letters.append([])
            letters[-1].append(run)
            reach = max(reach, run[:, 0].max())
        low = max(label["box_mm"][1], high) / 2 - high
        yield (
            label["text"].replace(" ", ""),
            [
                [(run - (min(one[:, 0].min() for one in letter), low)) / high for run in letter]
                for letter in letters
            ],
        )


def _in_box(piece, label, points):
    """Return points of a sheet from the middle of a label's box: along it, and up."""
    angle = np.deg2rad(label["rotation_deg"])
    middle = np.array([label["x"], label["y"]])
    way = np.array([np.cos(angle), np.sin(angle)])
    ends = piece.placed(np.array([middle, middle + way]))
    along = ends[1] - ends[0]
    away = points - ends[0]
    return np.stack((away @ along, away @ (-along[1], along[0])), axis=1)


def alike(one, two):
    """Say whether two letters have the same strokes, in whichever order and direction."""

    def same(run, other):
        return len(run) == len(other) and any(
            np.abs(run - way).max() <= SAME for way in (other, other[::-1])
        )

    return len(one) == len(two) and all(any(same(run, other) for other in two) for run in one)
