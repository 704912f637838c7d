"""Hold how long hands take for what they do, and what an hour of them is worth."""

import math

from fabweave.stock.machine import Span

#: What one takes a practised hand, seconds, and what it is called. Taking up a strip (flexible, in
#: two hands), laying, sliding (obstructed, held) and aligning (obstructed): Boothroyd and Dewhurst,
#: as tabled by Whitney, Mechanical Assemblies, fig. 15-1, and in worked sheets, benthamopen.com
#: TOMEJ-10-173. Sorting and finding are estimates.
PRACTISED = {
    "sort": (5.0, "to take a piece out of its sheet and sort it"),
    "find": (5.0, "to find a piece"),
    "take": (4.5, "to take it up and turn it"),
    "over": (2.5, "to lay a strand over another"),
    "under": (8.5, "to slide one under"),
    "align": (6.0, "to bring holes or ends into line"),
}
#: What holding a joint takes, by its kind: a brush and a clip, pressing (a snap that is hard to
#: align), threading (obstructed and held), tape; the first and the last are estimates. Fasteners
#: are counted by themselves.
HOLDING_S = {"glue": 15.0, "dovetail": 5.0, "slot": 8.5, "none": 6.0}
#: A maker takes so many times as long as a practised hand that does nothing else: an estimate.
PACE: Span = (1.5, 3.0)
#: One number for both, where one is needed.
MIDDLE_PACE = math.sqrt(PACE[0] * PACE[1])
#: In this prices are told that no material and no list of stock names.
CURRENCY = "EUR"
#: An hour of the maker's own work; little more than a minimum wage.
LABOUR_EUR_H = 15.0
