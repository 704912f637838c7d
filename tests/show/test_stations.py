"""The table of each piece, on a small map: a ring of one piece, and a thread of two."""

from crossing_maps import piece_record, small_map, station_record, step_record

from fabweave.plan.crossing_map import CrossingRecord, JointRecord, StrandRecord
from fabweave.plan.csv_tables import crossing_table, piece_stations, station_table


def crossing(number, over, under):
    strands = [StrandRecord(thread=0, piece=piece, station=k) for piece, k in (over, under)]
    return CrossingRecord(
        id=number,
        edge=(0, 1),
        position=(1.5, -2.0, number),
        over=strands[0],
        under=strands[1],
        fastened=True,
    )


def joint(number, *pieces):
    return JointRecord(
        id=number, pieces=pieces, crossing=7, kind="glue", holes=(), hole_mm=None, lap_mm=9.0,
        grip_mm=None,
    )  # fmt: skip


def piece(name, joints, *stations):
    return piece_record(name, [], joints=joints, stations=stations)


def station(number, over, partner, x, y, joint=None, hole_mm=None):
    return station_record(
        number, over=over, partner=partner, x=x, y=y, joint=joint, hole_mm=hole_mm
    )


MAP = small_map(
    crossings=[crossing(7, ("A1", 2), ("B1", 0)), crossing(8, ("B2", 1), ("A1", 1))],
    joints=[joint(1, "A1", "A1"), joint(2, "B1", "B2")],
    pieces=[
        piece("A1", (1, 1), station(7, True, "B1", 0, 0, 1), station(8, False, "B2", 3, 4),
              station(7, True, "B1", 6, 8, 1)),
        piece("B1", (None, 2), station(7, False, "A1", 5, 5, 2, 3.3)),
        piece("B2", (2, None), station(7, False, "A1", 0, 0, 2, 3.3),
              station(8, True, "A1", 0, 12.34)),
    ],
    steps=[step_record(1), step_record(2, crossings=(8,)), step_record(3, crossings=(7,))],
)  # fmt: skip


def test_the_table_of_stations():
    assert station_table(MAP).splitlines() == [
        "piece,station,crossing,distance_mm,lies,partner,partner_station,joint,mate,hole_mm,step",
        "A1,0,7,0.0,over,B1,0,1,A1,,3",
        "A1,1,8,5.0,under,B2,1,,,,2",
        "A1,2,7,10.0,over,B1,0,1,A1,,3",
        "B1,0,7,0.0,under,A1,2,2,B2,3.3,3",
        "B2,0,7,0.0,under,A1,2,2,B1,3.3,3",
        "B2,1,8,12.3,over,A1,1,,,,2",
    ]
    assert list(piece_stations(MAP)) == ["A1", "B1", "B2"]


def test_the_table_of_crossings():
    assert crossing_table(MAP).splitlines() == [
        "crossing,over_piece,over_station,under_piece,under_station,joint,hole_mm,x,y,z",
        "7,A1,2,B1,0,2,3.3,1.5,-2.0,7",
        "8,B2,1,A1,1,,,1.5,-2.0,8",
    ]
