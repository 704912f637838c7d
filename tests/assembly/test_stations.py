"""The table of each piece, on a small plan: a ring of one piece, and a thread of two."""

from fabweave.assembly.stations import piece_stations, station_table


def strand(piece, station):
    return {"thread": 0, "piece": piece, "station": station}


def station(crossing, over, partner, x, y, joint=None, hole_mm=None):
    return {"crossing": crossing, "over": over, "partner": partner, "x": x, "y": y,
            "joint": joint, "hole_mm": hole_mm}  # fmt: skip


PLAN = {
    "crossings": [
        {"id": 7, "over": strand("A1", 2), "under": strand("B1", 0)},
        {"id": 8, "over": strand("B2", 1), "under": strand("A1", 1)},
    ],
    "joints": [
        {"id": 1, "pieces": ["A1", "A1"]},
        {"id": 2, "pieces": ["B1", "B2"]},
    ],
    "pieces": [
        {"id": "A1", "joints": [1, 1],
         "stations": [station(7, True, "B1", 0, 0, 1), station(8, False, "B2", 3, 4),
                      station(7, True, "B1", 6, 8, 1)]},
        {"id": "B1", "joints": [None, 2], "stations": [station(7, False, "A1", 5, 5, 2, 3.3)]},
        {"id": "B2", "joints": [2, None],
         "stations": [station(7, False, "A1", 0, 0, 2, 3.3), station(8, True, "A1", 0, 12.34)]},
    ],
    "steps": [
        {"step": 1, "crossings": []},
        {"step": 2, "crossings": [8]},
        {"step": 3, "crossings": [7]},
    ],
}  # fmt: skip


def test_the_table_of_stations():
    assert station_table(PLAN).splitlines() == [
        "piece,station,crossing,distance_mm,lies,partner,partner_station,joint,mate,hole_mm,step",
        "A1,0,7,0.0,over,B1,0,1,A1,,3",
        "A1,1,8,5.0,under,B2,1,,,,2",
        "A1,2,7,10.0,over,B1,0,1,A1,,3",
        "B1,0,7,0.0,under,A1,2,2,B2,3.3,3",
        "B2,0,7,0.0,under,A1,2,2,B1,3.3,3",
        "B2,1,8,12.3,over,A1,1,,,,2",
    ]
    assert list(piece_stations(PLAN)) == ["A1", "B1", "B2"]
