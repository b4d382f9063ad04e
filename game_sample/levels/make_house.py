#!/usr/bin/env python3
"""Writes the demo level: a two-storey house at dusk with ten rooms, twelve light sets and three doors.

    python3 make_house.py [FOLDER]

makes house.gltf (direct light of lamps is left to the renderer, as in a game) and house_full.gltf, the demo's (baked
too, with furniture that light grids light and more places for things that move), with their geometry in house.bin. Metres; x east, y up, z south; the ground floor is y = 0. Python's standard
library only; the same bytes every time.
"""

import math
import pathlib
import sys

sys.dont_write_bytecode = True

from gltf import Gltf, look_along
from solids import Solids, quads

# ---------------------------------------------------------------------------------------------------- materials
# (name, linear Rec.709 base colour, emission in cd/m2 or None). Colours stay within what paint and wood reflect.


def paint(name, *color):
    return (name, list(color), None)


WHITE = paint("white_paint", 0.75, 0.74, 0.71)
CEILING = paint("ceiling_paint", 0.80, 0.80, 0.79)
RED = paint("red_paint", 0.62, 0.07, 0.05)
GREEN = paint("green_paint", 0.14, 0.48, 0.13)
BLUE = paint("blue_paint", 0.10, 0.20, 0.58)
YELLOW = paint("yellow_paint", 0.72, 0.55, 0.20)
OAK = paint("oak_floor", 0.42, 0.27, 0.15)
TILES = paint("pale_tiles", 0.60, 0.62, 0.62)
CONCRETE = paint("concrete", 0.35, 0.34, 0.32)
RENDER = paint("outside_render", 0.62, 0.58, 0.50)
ROOF = paint("roof_gravel", 0.28, 0.27, 0.26)
GRASS = paint("grass", 0.10, 0.19, 0.06)
DARK_WOOD = paint("dark_wood", 0.20, 0.10, 0.05)
PINE = paint("pine", 0.60, 0.42, 0.22)
STEEL = paint("steel", 0.45, 0.46, 0.48)
LACQUER = paint("white_lacquer", 0.78, 0.78, 0.77)
CLOTH_TEAL = paint("teal_cloth", 0.08, 0.30, 0.32)
CLOTH_RED = paint("red_cloth", 0.50, 0.08, 0.10)
LINEN = paint("linen", 0.70, 0.68, 0.62)
BOOKS = paint("book_spines", 0.35, 0.16, 0.12)
DOOR = paint("door_paint", 0.66, 0.60, 0.48)
SHADE = paint("lamp_shade", 0.55, 0.50, 0.42)

WARM, NEUTRAL, COOL = (1.0, 0.78, 0.52), (1.0, 0.90, 0.76), (0.86, 0.94, 1.0)
ALARM = (1.0, 0.08, 0.05)


def glowing(name, color, luminance_scale_cd_m2):
    return (name, [0.6, 0.6, 0.6], [round(channel * luminance_scale_cd_m2, 3) for channel in color])


# ---------------------------------------------------------------------------------------------------- the shell

WALL = 0.2
DOMAIN = (-6.4, 17.6, -0.6, 8.0, -4.0, 14.4)
GROUND_Y = -0.15
LOWER = (0.0, 2.6)  # floor and ceiling of the ground floor
UPPER = (2.8, 5.4)

# name: (x0, x1, z0, z1), storey, floor, walls, {side: another wall}
ROOMS = {
    "living": ((0.2, 5.2, 4.2, 8.2), LOWER, OAK, WHITE, {"west": RED}),
    "kitchen": ((0.2, 5.2, 0.2, 4.0), LOWER, TILES, WHITE, {"west": YELLOW}),
    "hall": ((5.4, 7.8, 1.8, 8.2), LOWER, TILES, WHITE, {}),
    "corridor": ((5.4, 11.0, 0.2, 1.6), LOWER, OAK, WHITE, {}),
    "cellar": ((8.0, 11.0, 1.8, 4.4), LOWER, CONCRETE, CONCRETE, {}),
    "den": ((8.0, 11.0, 4.6, 8.2), LOWER, OAK, WHITE, {"east": RED, "north": RED}),
    "landing": ((5.4, 7.8, 0.2, 8.2), UPPER, OAK, WHITE, {}),
    "bedroom": ((0.2, 5.2, 4.2, 8.2), UPPER, OAK, WHITE, {"west": BLUE, "north": BLUE}),
    "study": ((0.2, 5.2, 0.2, 4.0), UPPER, OAK, GREEN, {"south": WHITE}),
    "bathroom": ((8.0, 11.0, 0.2, 3.4), UPPER, TILES, LACQUER, {}),
}

# Openings through the walls, each with the wall's own thickness: (x0, x1, y0, y1, z0, z1).
DOORWAYS = {
    "front": (5.6, 6.6, 0.0, 2.1, 8.2, 8.4),
    "living": (5.2, 5.4, 0.0, 2.1, 5.0, 6.6),
    "den": (7.8, 8.0, 0.0, 2.1, 7.25, 8.05),
    "hall_corridor": (5.6, 6.6, 0.0, 2.1, 1.6, 1.8),
    "kitchen_corridor": (5.2, 5.4, 0.0, 2.1, 0.5, 1.4),
    "kitchen_living": (1.2, 3.2, 0.0, 2.2, 4.0, 4.2),
    "corridor_cellar": (9.0, 9.9, 0.0, 2.1, 1.6, 1.8),
    "landing_study": (5.2, 5.4, 2.8, 4.9, 2.4, 3.3),
    "landing_bedroom": (5.2, 5.4, 2.8, 4.9, 4.6, 5.5),
    "landing_bathroom": (7.8, 8.0, 2.8, 4.9, 1.0, 1.8),
}
WINDOWS = {
    "living_south_west": (0.9, 2.3, 0.9, 2.2, 8.2, 8.4),
    "living_south_east": (3.1, 4.5, 0.9, 2.2, 8.2, 8.4),
    "living_west": (0.0, 0.2, 0.9, 2.2, 5.4, 7.0),
    "kitchen_west": (0.0, 0.2, 1.1, 2.2, 1.2, 2.8),
    "kitchen_north": (2.2, 3.8, 1.1, 2.2, 0.0, 0.2),
    "corridor_east": (11.0, 11.2, 1.1, 2.1, 0.5, 1.3),
    "den_south": (8.8, 10.4, 0.9, 2.2, 8.2, 8.4),
    "den_east": (11.0, 11.2, 0.9, 2.2, 5.6, 7.0),
    "bedroom_south_west": (1.0, 2.4, 3.7, 5.0, 8.2, 8.4),
    "bedroom_south_east": (3.2, 4.6, 3.7, 5.0, 8.2, 8.4),
    "bedroom_west": (0.0, 0.2, 3.7, 5.0, 5.5, 6.9),
    "study_north": (1.6, 3.4, 3.7, 5.0, 0.0, 0.2),
    "study_west": (0.0, 0.2, 3.7, 5.0, 1.4, 2.8),
    "bathroom_east": (11.0, 11.2, 4.2, 5.0, 1.4, 2.2),
    "landing_south": (5.9, 7.3, 3.7, 5.0, 8.2, 8.4),
    "landing_north": (6.0, 7.2, 3.7, 5.0, 0.0, 0.2),
}

STAIR_X, STAIR_FOOT_Z, STAIR_HEAD_Z = (6.8, 7.8), 6.9, 3.65
TREADS, TREAD, RISE = 13, 0.25, 0.2  # the fourteenth rise is the landing's edge


def room_box(name):
    (x0, x1, z0, z1), (y0, y1), *_ = ROOMS[name]
    return (x0, x1, y0, y1, z0, z1)


def shell():
    solids = Solids(DOMAIN)
    solids.solid((DOMAIN[0], DOMAIN[1], DOMAIN[2], GROUND_Y, DOMAIN[4], DOMAIN[5]), "ground")
    solids.solid((5.2, 7.0, DOMAIN[2], -0.02, 8.4, 9.6), "front_step")
    solids.solid((0.0, 11.2, DOMAIN[2], 2.8, 0.0, 8.4))
    solids.solid((0.0, 8.0, 2.8, 5.6, 0.0, 8.4))
    solids.solid((8.0, 11.2, 2.8, 5.6, 0.0, 3.6))
    solids.solid((5.2, 7.0, 2.4, 2.55, 8.4, 9.6))  # canopy over the front door
    for name in ROOMS:
        solids.air(room_box(name), name)
    for box in DOORWAYS.values():
        solids.air(box, "doorways")
    for box in WINDOWS.values():
        solids.air(box, "windows")
        solids.solid(middle_bar(box), "window_bars")
    solids.air((*STAIR_X, LOWER[1], UPPER[0], STAIR_HEAD_Z, 7.2), "stairwell")
    return solids


def middle_bar(window):
    """A bar of 5 cm x 5 cm that halves a window, in the middle of the wall."""
    x0, x1, y0, y1, z0, z1 = window
    x, z = (x0 + x1) / 2, (z0 + z1) / 2
    return tuple(round(end, 4) for end in (x - 0.025, x + 0.025, y0, y1, z - 0.025, z + 0.025))


# A face with its normal to the east is the room's west wall.
SIDE_OF_NORMAL = {(0, 1): "west", (0, -1): "east", (2, 1): "north", (2, -1): "south"}


def shell_surface(label, region, axis, sign):
    """(node name, material, texels per metre or None) of the shell's faces with that normal."""
    by_label = {"ground": (GRASS, 1), "front_step": (CONCRETE, None), "window_bars": (LACQUER, None)}
    if label:
        return label, *by_label[label]
    if region in ROOMS:
        _, _, floor, walls, others = ROOMS[region]
        if axis == 1:
            return (region + "_floor", floor, None) if sign > 0 else (region + "_ceiling", CEILING, None)
        side = SIDE_OF_NORMAL[axis, sign]
        return (f"{region}_wall_{side}", others[side], None) if side in others else (region + "_walls", walls, None)
    if region == "outside":
        return ("roof", ROOF, 2) if (axis, sign) == (1, 1) else ("outside_walls", RENDER, 2)
    return region, LACQUER, None


def add_shell(gltf):
    nodes = {}
    for (label, region, axis, sign), by_coordinate in shell().faces().items():
        name, material, density = shell_surface(label, region, axis, sign)
        nodes.setdefault((name, material[0]), (material, density, []))[2].append((axis, sign, by_coordinate))
    for (name, _), (material, density, parts) in sorted(nodes.items()):
        extras = {"dimmer_lighting": "lightmap"}
        if density:
            extras["dimmer_texel_density"] = density
        parts.sort(key=lambda part: part[:2])
        gltf.mesh(name, [quads(*part) for part in parts], material, extras)


# ---------------------------------------------------------------------------------------------------- furniture


def add_boxes(gltf, name, material, boxes, domain, holes=(), extras=None, origin=(0, 0, 0)):
    """One closed solid out of boxes; faces on the domain's boundary (the floor it stands on, say) are left out."""
    solids = Solids(domain)
    for box in boxes:
        solids.solid(box)
    for box in holes:
        solids.air(box, "outside")
    parts = [
        quads(axis, sign, by_coordinate)
        for (_, _, axis, sign), by_coordinate in sorted(solids.faces().items(), key=lambda item: item[0][2:])
    ]
    gltf.mesh(name, parts, material, extras, origin)


def above(box, y):
    """The part of a box above y: where things on a table top are."""
    return (box[0], box[1], y, box[3], box[4], box[5])


def table(x0, x1, z0, z1, floor, height, leg=0.06, top=0.04):
    legs = [(x, x + leg, floor, floor + height - top, z, z + leg) for x in (x0, x1 - leg) for z in (z0, z1 - leg)]
    return [*legs, (x0, x1, floor + height - top, floor + height, z0, z1)]


def shelves(x0, x1, z0, z1, floor, height, boards, axis):
    """A bookcase: back at the low (axis > 0) or high (axis < 0) x side, two cheeks, boards."""
    thick = 0.03
    back = (x0, x0 + thick) if axis > 0 else (x1 - thick, x1)
    boxes = [(*back, floor, floor + height, z0, z1)]
    boxes += [(x0, x1, floor, floor + height, z, z + thick) for z in (z0, z1 - thick)]
    for board in range(boards + 1):
        y = floor + (height - thick) * board / boards
        boxes.append((x0, x1, round(y, 4), round(y + thick, 4), z0, z1))
    return boxes


def add_living(gltf):
    room = room_box("living")
    sofa = [(1.3, 3.5, 0.0, 0.42, 7.1, 8.0), (1.3, 3.5, 0.42, 0.8, 7.75, 8.0)]
    sofa += [(1.1, 1.3, 0.0, 0.6, 7.1, 8.0), (3.5, 3.7, 0.0, 0.6, 7.1, 8.0)]
    add_boxes(gltf, "sofa", CLOTH_TEAL, sofa, room)
    add_boxes(gltf, "coffee_table", DARK_WOOD, table(1.8, 3.0, 5.9, 6.5, 0.0, 0.42), room)
    add_boxes(gltf, "living_shelves", PINE, shelves(4.85, 5.2, 6.9, 8.0, 0.0, 2.0, 5, -1), room)
    books = [(4.95, 5.15, 0.025 + 0.394 * i, 0.28 + 0.394 * i, 7.0, 7.35 + 0.11 * i) for i in range(1, 5)]
    books_domain = (4.85, 5.17, 0.0, 2.6, 6.93, 7.97)
    add_boxes(gltf, "living_books", BOOKS, books, books_domain)
    add_boxes(gltf, "tv_board", LACQUER, [(3.5, 4.9, 0.0, 0.45, 4.2, 4.6)], room)
    add_boxes(gltf, "floor_lamp_stand", STEEL, [(0.58, 0.82, 0.0, 0.03, 7.48, 7.72), (0.69, 0.71, 0.03, 1.3, 7.59, 7.61)],
              (room[0], room[1], 0.0, 1.3, room[4], room[5]))
    add_boxes(gltf, "floor_lamp_shade", glowing("floor_lamp_glow", WARM, 700), [(0.53, 0.87, 1.3, 1.62, 7.43, 7.77)], room,
              extras={"dimmer_light_set": "living"})


def add_kitchen(gltf):
    room = room_box("kitchen")
    add_boxes(gltf, "kitchen_block", LACQUER, [(0.2, 4.4, 0.0, 0.86, 0.2, 0.78)], (*room[:3], 0.86, *room[4:]))
    add_boxes(gltf, "worktop", DARK_WOOD, [(0.2, 4.42, 0.86, 0.9, 0.2, 0.82)], room)
    cupboards = [(0.2, 1.9, 1.5, 2.2, 0.2, 0.55), (3.95, 5.0, 1.5, 2.2, 0.2, 0.55)]
    add_boxes(gltf, "wall_cupboards", LACQUER, cupboards, room)
    add_boxes(gltf, "fridge", STEEL, [(0.2, 0.85, 0.0, 1.9, 3.3, 4.0)], room)
    add_boxes(gltf, "dining_table", PINE, table(2.0, 3.6, 1.9, 2.8, 0.0, 0.75), room)
    for number, (x, z) in enumerate([(2.2, 2.95), (3.0, 2.95), (2.2, 1.4), (3.0, 1.4)], 1):
        back = (z + 0.37, z + 0.4) if z > 2 else (z, z + 0.03)
        chair = table(x, x + 0.4, z, z + 0.4, 0.0, 0.45, 0.04, 0.04) + [(x, x + 0.4, 0.45, 0.9, *back)]
        add_boxes(gltf, f"dining_chair_{number}", DARK_WOOD, chair, room)
    add_boxes(gltf, "kitchen_ceiling_panel", glowing("kitchen_panel_glow", NEUTRAL, 350),
              [(2.2, 3.4, 2.56, 2.6, 2.2, 2.5)], room, extras={"dimmer_light_set": "kitchen"})


def add_stairs(gltf):
    """Stands before an unbroken wall and floor, as furniture does: they would fall into strips if it were cut in."""
    steps = []
    for step in range(1, TREADS + 1):
        far = round(STAIR_FOOT_Z - TREAD * step, 4)
        steps.append((*STAIR_X, 0.0, round(RISE * step, 4), far, round(far + TREAD, 4)))
    hall = room_box("hall")
    add_boxes(gltf, "stairs", PINE, steps, (*hall[:3], UPPER[0], *hall[4:]), extras={"dimmer_lighting": "lightmap"})


def add_ground_floor(gltf):
    add_stairs(gltf)
    add_living(gltf)
    add_kitchen(gltf)
    hall, cellar, den, corridor = (room_box(name) for name in ("hall", "cellar", "den", "corridor"))
    add_boxes(gltf, "hall_bench", PINE, table(5.4, 5.8, 3.2, 4.5, 0.0, 0.45), hall)
    add_boxes(gltf, "corridor_sideboard", DARK_WOOD, [(6.9, 8.2, 0.0, 0.8, 0.2, 0.55)], corridor)
    add_boxes(gltf, "cellar_shelves", PINE, shelves(10.6, 11.0, 2.0, 4.2, 0.0, 1.9, 4, -1), cellar)
    add_boxes(gltf, "cellar_crates", PINE, [(8.1, 8.7, 0.0, 0.5, 3.6, 4.3), (8.15, 8.6, 0.5, 0.9, 3.7, 4.2)], cellar)
    add_boxes(gltf, "den_desk", DARK_WOOD, table(9.2, 10.8, 4.6, 5.3, 0.0, 0.74), den)
    chair = table(9.8, 10.25, 5.45, 5.9, 0.0, 0.46, 0.04, 0.05) + [(9.8, 10.25, 0.46, 0.95, 5.86, 5.9)]
    add_boxes(gltf, "den_chair", CLOTH_RED, chair, den)
    add_boxes(gltf, "den_shelves", PINE, shelves(8.0, 8.3, 5.0, 6.6, 0.0, 1.6, 4, 1), den)
    add_boxes(gltf, "desk_lamp_stand", STEEL, [(10.4, 10.55, 0.74, 0.76, 4.72, 4.87), (10.46, 10.49, 0.76, 1.2, 4.78, 4.81),
                                               (10.25, 10.49, 1.16, 1.19, 4.79, 4.8)], above(den, 0.74))
    add_boxes(gltf, "desk_lamp_head", glowing("desk_lamp_glow", WARM, 400), [(10.1, 10.3, 1.15, 1.2, 4.76, 4.88)], den,
              extras={"dimmer_light_set": "desk"})


def add_upper_floor(gltf):
    floor = UPPER[0]
    landing, bedroom, study, bathroom = (room_box(name) for name in ("landing", "bedroom", "study", "bathroom"))
    rail_posts = [(6.7, 6.75, floor, floor + 0.9, z, z + 0.05) for z in (3.65, 4.55, 5.45, 6.35, 7.25)]
    rail = [(6.7, 6.75, floor + 0.9, floor + 0.96, 3.65, 7.3), (6.75, 7.8, floor + 0.9, floor + 0.96, 7.25, 7.3)]
    add_boxes(gltf, "balustrade", DARK_WOOD, rail_posts + rail, landing)
    add_boxes(gltf, "landing_cabinet", PINE, [(5.4, 5.8, floor, floor + 0.85, 6.4, 7.8)], landing)

    add_boxes(gltf, "bed_frame", DARK_WOOD, [(1.6, 3.4, floor, floor + 0.3, 4.3, 6.4), (1.6, 3.4, floor, floor + 0.95, 4.2, 4.3)],
              (*bedroom[:4], 4.2, bedroom[5]))
    add_boxes(gltf, "mattress", LINEN, [(1.63, 3.37, floor + 0.3, floor + 0.5, 4.33, 6.37)], above(bedroom, floor + 0.3))
    add_boxes(gltf, "blanket", CLOTH_RED, [(1.64, 3.36, floor + 0.5, floor + 0.55, 5.2, 6.36)], above(bedroom, floor + 0.5))
    for side, x in (("left", 1.0), ("right", 3.55)):
        add_boxes(gltf, f"nightstand_{side}", PINE, [(x, x + 0.45, floor, floor + 0.5, 4.2, 4.6)], bedroom)
        add_boxes(gltf, f"bedside_lamp_{side}", glowing("bedside_glow", WARM, 350),
                  [(x + 0.15, x + 0.3, floor + 0.5, floor + 0.72, 4.3, 4.45)], above(bedroom, floor + 0.5),
                  extras={"dimmer_light_set": "bedroom"})
    add_boxes(gltf, "wardrobe", LACQUER, [(4.6, 5.2, floor, floor + 2.1, 5.8, 7.9)], bedroom)

    add_boxes(gltf, "study_desk", PINE, table(1.5, 3.3, 0.35, 1.05, floor, 0.74), study)
    chair = table(2.2, 2.65, 1.25, 1.7, floor, 0.46, 0.04, 0.05) + [(2.2, 2.65, floor + 0.46, floor + 0.95, 1.66, 1.7)]
    add_boxes(gltf, "study_chair", DARK_WOOD, chair, study)
    add_boxes(gltf, "study_shelves", PINE, shelves(4.85, 5.2, 0.4, 2.2, floor, 2.0, 5, -1), study)
    add_boxes(gltf, "study_armchair", CLOTH_TEAL, [(0.4, 1.2, floor, floor + 0.42, 3.1, 3.8), (0.4, 1.2, floor + 0.42, floor + 0.9, 3.62, 3.8)],
              study)

    tub = (8.1, 9.9, floor, floor + 0.56, 2.55, 3.3)
    add_boxes(gltf, "bathtub", LACQUER, [tub], bathroom, holes=[(8.18, 9.82, floor + 0.12, floor + 0.6, 2.63, 3.22)])
    add_boxes(gltf, "washstand", LACQUER, [(9.2, 10.4, floor, floor + 0.85, 0.2, 0.7)], bathroom)


def add_pendants(gltf):
    """Shaded lamps on cords; the light itself hangs just below the shade."""
    places = {"living": (2.4, 6.2), "hall": (6.1, 7.2), "study": (2.7, 2.1), "bedroom": (2.7, 6.6)}
    for room_name, (x, z) in places.items():
        room = room_box(room_name)
        top = room[3]
        boxes = [(x - 0.01, x + 0.01, top - 0.5, top, z - 0.01, z + 0.01)]
        boxes += [(x - 0.16, x + 0.16, top - 0.53, top - 0.5, z - 0.16, z + 0.16)]
        add_boxes(gltf, room_name + "_pendant", SHADE, boxes, room)


# Small glowing boxes on ceilings and walls, so that a lamp can be seen: (node, light set, room, colour, cd/m2, box).
FIXTURES = [
    ("hall_fixture", "hall", "hall", NEUTRAL, 150, (6.0, 6.2, 2.56, 2.6, 2.6, 2.8)),
    ("corridor_fixture_west", "corridor", "corridor", NEUTRAL, 150, (6.3, 6.5, 2.56, 2.6, 0.8, 1.0)),
    ("corridor_fixture_east", "corridor", "corridor", NEUTRAL, 150, (9.4, 9.6, 2.56, 2.6, 0.8, 1.0)),
    ("cellar_fixture", "cellar", "cellar", WARM, 150, (9.42, 9.58, 2.5, 2.6, 3.02, 3.18)),
    ("bathroom_fixture", "bathroom", "bathroom", COOL, 150, (9.25, 9.55, 5.36, 5.4, 1.85, 2.15)),
    ("stairs_fixture", "stairs", "landing", WARM, 150, (6.0, 6.2, 5.36, 5.4, 4.5, 4.7)),
    ("den_fixture", "desk", "den", WARM, 150, (9.3, 9.5, 2.56, 2.6, 6.5, 6.7)),
    ("alarm_lamp_hall", "alarm", "hall", ALARM, 120, (5.4, 5.46, 2.24, 2.36, 4.74, 4.86)),
    ("alarm_lamp_living", "alarm", "living", ALARM, 120, (5.14, 5.2, 2.24, 2.36, 4.74, 4.86)),
    ("alarm_lamp_corridor", "alarm", "corridor", ALARM, 120, (8.54, 8.66, 2.24, 2.36, 1.54, 1.6)),
    ("alarm_lamp_landing", "alarm", "landing", ALARM, 120, (5.4, 5.46, 4.94, 5.06, 3.74, 3.86)),
]


def add_fixtures(gltf):
    for name, light_set, room, color, luminance_cd_m2, box in FIXTURES:
        add_boxes(gltf, name, glowing(name + "_glow", color, luminance_cd_m2), [box], room_box(room),
                  extras={"dimmer_light_set": light_set})


# ---------------------------------------------------------------------------------------------------- doors


def add_doors(gltf):
    """Leaves are 4 cm thick and reach 1 cm into the wall around them, so a closed door leaves no crack."""
    reach, thick = 0.01, 0.04

    def leaf(name, door, material, box, hinge=None, quarter_turns=0):
        extras = {"dimmer_door": door, "dimmer_lighting": "lightmap"}
        if hinge:
            half_angle = quarter_turns * math.pi / 4
            turn = [0, round(math.sin(half_angle), 7), 0, round(math.cos(half_angle), 7)]
            extras |= {"dimmer_door_open": "pose", "dimmer_door_rotation": turn}
        domain = tuple(end + (0.1 if side % 2 else -0.1) for side, end in enumerate(box))
        add_boxes(gltf, name, material, [box], domain, extras=extras, origin=hinge or (0, 0, 0))

    x0, x1, y0, y1, z0, z1 = DOORWAYS["front"]
    z = (z0 + z1) / 2
    box = (x0 - reach, x1 + reach, y0 - reach, y1 + reach, z - thick / 2, z + thick / 2)
    leaf("front_door", "front", DARK_WOOD, box, hinge=(x0, 0, z), quarter_turns=1)

    x0, x1, y0, y1, z0, z1 = DOORWAYS["den"]
    x = (x0 + x1) / 2
    box = (x - thick / 2, x + thick / 2, y0 - reach, y1 + reach, z0 - reach, z1 + reach)
    leaf("den_door", "den", DOOR, box, hinge=(x, 0, z1), quarter_turns=-1)

    # Two sliding leaves, one door: they vanish into the wall (open means removed). They overlap by 1 cm, one 1 cm
    # behind the other, like a rebate.
    x0, x1, y0, y1, z0, z1 = DOORWAYS["living"]
    x, meet = (x0 + x1) / 2, (z0 + z1) / 2
    north = (x - thick / 2, x + thick / 2, y0 - reach, y1 + reach, z0 - reach, meet + 0.005)
    south = (x - thick / 2 + 0.01, x + thick / 2 + 0.01, y0 - reach, y1 + reach, meet - 0.005, z1 + reach)
    leaf("living_door_north", "living", DOOR, north)
    leaf("living_door_south", "living", DOOR, south)


# ---------------------------------------------------------------------------------------------------- lights

# (node, light set, colour, candela, position, direction or None)
LIGHTS = [
    ("hall_south", "hall", NEUTRAL, 80, (6.1, 2.0, 7.2), None),
    ("hall_north", "hall", NEUTRAL, 60, (6.1, 2.2, 2.7), None),
    ("living_pendant_bulb", "living", WARM, 120, (2.4, 2.0, 6.2), None),
    ("kitchen_worktop_left", "kitchen", NEUTRAL, 70, (1.4, 2.4, 1.0), (0, -1, -0.2)),
    ("kitchen_worktop_right", "kitchen", NEUTRAL, 70, (3.4, 2.4, 1.0), (0, -1, -0.2)),
    ("study_bulb", "study", NEUTRAL, 110, (2.7, 4.8, 2.1), None),
    ("study_wall", "study", WARM, 40, (0.8, 4.4, 3.6), None),
    ("bedroom_bulb", "bedroom", WARM, 80, (2.7, 4.8, 6.6), None),
    ("bathroom_mirror", "bathroom", COOL, 60, (9.8, 4.9, 0.5), None),
    ("bathroom_ceiling", "bathroom", COOL, 80, (9.4, 5.1, 2.0), None),
    ("corridor_west", "corridor", NEUTRAL, 60, (6.4, 2.3, 0.9), None),
    ("corridor_east", "corridor", NEUTRAL, 60, (9.5, 2.3, 0.9), None),
    ("stairs_landing", "stairs", WARM, 70, (6.1, 5.0, 4.6), None),
    ("stairs_spot", "stairs", NEUTRAL, 150, (7.3, 5.3, 6.9), (0, -1, -0.55)),
    ("cellar_bulb", "cellar", WARM, 70, (9.5, 2.2, 3.1), None),
    ("alarm_hall", "alarm", ALARM, 60, (5.6, 2.3, 4.8), None),
    ("alarm_living", "alarm", ALARM, 60, (4.9, 2.3, 4.9), None),
    ("alarm_corridor", "alarm", ALARM, 60, (8.6, 2.3, 1.4), None),
    ("alarm_landing", "alarm", ALARM, 60, (5.6, 5.0, 3.8), None),
    ("desk_spot", "desk", WARM, 130, (10.2, 1.1, 4.85), (-0.25, -1, 0.1)),
    ("desk_ceiling", "desk", WARM, 50, (9.4, 2.2, 6.6), None),
    ("porch_canopy", "porch", WARM, 90, (6.1, 2.3, 9.0), (0, -1, 0.1)),
    ("porch_wall", "porch", WARM, 60, (7.4, 2.0, 8.6), None),
]


def add_lights(gltf):
    for name, light_set, color, candela, position, direction in LIGHTS:
        light = {"type": "spot" if direction else "point", "color": list(color), "intensity": candela}
        placement = {"translation": list(position)}
        if direction:
            light["spot"] = {"innerConeAngle": 0.45, "outerConeAngle": 0.95}
            placement["rotation"] = look_along(direction)
        gltf.light(name, light, {"dimmer_light_set": light_set}, **placement)
    # The last of the evening sun, from the south-west, 22 degrees above the horizon; lux on a surface that faces it.
    sun = {"type": "directional", "color": [1.0, 0.72, 0.42], "intensity": 40}
    gltf.light("sun", sun, None, rotation=look_along((0.45, -0.4, -0.9)))


# ---------------------------------------------------------------------------------------------------- views

VIEWS = {
    "overview_living": ((4.8, 1.65, 4.7), (1.2, 0.95, 7.2), 66),
    "kitchen": ((4.9, 1.65, 3.7), (1.2, 0.95, 0.9), 66),
    "hall": ((5.75, 1.65, 7.95), (6.9, 1.2, 3.4), 66),
    "corridor": ((5.6, 1.6, 0.5), (10.8, 1.1, 1.1), 64),
    "den": ((8.3, 1.65, 7.9), (10.2, 0.9, 4.9), 64),
    "upstairs": ((5.8, 4.45, 7.9), (6.6, 3.6, 2.0), 66),
    "bedroom": ((4.9, 4.45, 5.4), (1.4, 3.4, 5.9), 68),
    "study": ((4.7, 4.45, 3.7), (1.4, 3.6, 0.9), 66),
    "bathroom": ((8.3, 4.4, 0.5), (10.2, 3.4, 2.9), 66),
    "outside": ((-2.5, 1.7, 13.6), (5.6, 2.4, 7.0), 50),
}


# Around Y, from east to north.
def turned(degrees):
    half = math.radians(degrees) / 2
    return [0, round(math.sin(half), 7), 0, round(math.cos(half), 7)]


# The sample flies a ball from each place in its direction, and back.
def add_places(gltf):
    for name, view in VIEWS.items():
        gltf.camera(name, *view)
    gltf.node("player_start", translation=[6.1, 1.65, 7.6], rotation=look_along((0, 0, -1)))
    for name, (place, degrees) in {
        "guest_living": ((2.4, 1.0, 5.2), 0),
        "guest_hall": ((6.1, 1.0, 5.6), 90),
        "guest_corridor": ((9.0, 1.0, 0.9), 180),
        "guest_landing": ((6.0, 3.8, 3.0), 0),
    }.items():
        gltf.node(name, {"dimmer_dynamic": 1}, translation=list(place), rotation=turned(degrees))


# ---------------------------------------------------------------------------------------------------- the level


def build():
    gltf = Gltf(
        "make_house.py of Dimmer",
        {
            "title": "House at dusk",
            "source": "made for Dimmer by game_sample/levels/make_house.py",
            "dimmer_sky_color": [0.55, 0.7, 1.0],
            "dimmer_sky_luminance": 14,
            # What `dimmer cook --suggest-combinations` says: all three doors open into the hall, and each is lit by what
            # the others, closed, reflect.
            "dimmer_combinations": [["door:front", "door:den"], ["door:den", "door:living"], ["door:front", "door:living"]],
            # Its lamps are what one tries out at preview: each is baked by itself, so that an edit bakes that one alone.
            "dimmer_settings": "bake.preview.lamps_apart=8",
        },
    )
    add_places(gltf)
    add_shell(gltf)
    add_ground_floor(gltf)
    add_upper_floor(gltf)
    add_pendants(gltf)
    add_fixtures(gltf)
    add_doors(gltf)
    add_lights(gltf)
    return gltf


# Of the demo alone: the figures of docs/measurements.md are of the house with lightmaps everywhere.
GRID_LIT = {
    "coffee_table", "dining_table", "dining_chair_1", "dining_chair_2", "dining_chair_3", "dining_chair_4",
    "hall_bench", "cellar_crates", "den_chair", "study_chair",
}  # fmt: skip
# name: place and direction, as in add_places
MORE_GUESTS = {
    "guest_sofa": ((1.2, 1.6, 6.6), 60),
    "guest_lamp": ((1.5, 0.9, 7.0), 90),
    "guest_table": ((1.9, 1.3, 1.2), 0),
    "guest_worktop": ((1.6, 1.9, 2.6), 45),
    "guest_arch": ((2.9, 1.0, 4.8), 90),
    "guest_stairs": ((6.1, 1.7, 4.0), 90),
    "guest_balustrade": ((5.8, 4.0, 2.6), 45),
    "guest_study": ((2.4, 3.9, 2.6), 0),
}


def in_the_demo(node):
    if "KHR_lights_punctual" in node.get("extensions", {}):
        return {"dimmer_bake": "full"}
    return {"dimmer_lighting": "local_grid"} if node["name"] in GRID_LIT else {}


def more_guests():
    nodes = []
    for name, (place, degrees) in MORE_GUESTS.items():
        nodes.append({"name": name, "translation": list(place), "rotation": turned(degrees),
                      "extras": {"dimmer_dynamic": 1}})
    return nodes


def main():
    folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parent)
    gltf = build()
    gltf.write(folder / "house.gltf", folder / "house.bin")
    gltf.write(folder / "house_full.gltf", folder / "house.bin", in_the_demo, more_guests())


if __name__ == "__main__":
    main()
