"""Closed rectilinear solids: fill a grid with solid and air boxes, keep the faces between the two.

Whatever is built this way has no crack, no hidden face and no two faces in one place, and every face belongs to the
air that it looks at: a floor ends at its room's walls. That is what baked lightmaps need.
"""

from bisect import bisect_left

AXES = "xyz"


class Solids:
    """Boxes are (x0, x1, y0, y1, z0, z1) in metres. Later ones overwrite earlier ones; the rest is air `outside`."""

    def __init__(self, domain):
        self.domain = domain
        self.operations = []

    def solid(self, box, label=None):
        """`label` names a surface of its own; None takes the surface from the air in front."""
        self.operations.append((box, (True, label)))

    def air(self, box, region):
        self.operations.append((box, (False, region)))

    def faces(self):
        """{(solid label, air region, axis, sign): {plane coordinate: [rectangles (u0, u1, v0, v1)]}}.

        `axis` and `sign` give the normal; u and v are the next two axes in cyclic order. Rectangles of one plane meet
        at whole edges. Nothing is made on the domain's own boundary: put what nobody sees there.
        """
        grid = self._grid()
        cells = self._fill(grid)
        planes = {}
        for (x, y, z), here in cells.items():
            for axis in range(3):
                there_at = [x, y, z]
                there_at[axis] += 1
                there = cells.get(tuple(there_at))
                if there is None or here[0] == there[0]:
                    continue
                sign = 1 if here[0] else -1
                label, region = (here[1], there[1]) if here[0] else (there[1], here[1])
                coordinate = grid[axis][there_at[axis]]
                u, v = (axis + 1) % 3, (axis + 2) % 3
                plane = planes.setdefault((label, region, axis, sign), {}).setdefault(coordinate, set())
                plane.add((there_at[u], there_at[v]))
        return {
            key: {c: _merge(found, grid[(key[2] + 1) % 3], grid[(key[2] + 2) % 3]) for c, found in by_coordinate.items()}
            for key, by_coordinate in planes.items()
        }

    def _grid(self):
        lines = []
        for axis in range(3):
            low, high = self.domain[2 * axis], self.domain[2 * axis + 1]
            ends = {low, high}
            for box, _ in self.operations:
                ends.update(end for end in box[2 * axis : 2 * axis + 2] if low < end < high)
            lines.append(sorted(ends))
        return lines

    def _fill(self, grid):
        nx, ny, nz = (len(lines) - 1 for lines in grid)
        cells = {(x, y, z): (False, "outside") for x in range(nx) for y in range(ny) for z in range(nz)}
        for box, value in self.operations:
            span = []
            for axis in range(3):
                low = max(box[2 * axis], self.domain[2 * axis])
                high = min(box[2 * axis + 1], self.domain[2 * axis + 1])
                span.append(range(bisect_left(grid[axis], low), bisect_left(grid[axis], high)))
            for x in span[0]:
                for y in span[1]:
                    for z in span[2]:
                        cells[x, y, z] = value
        return cells


def _merge(cells, u_lines, v_lines):
    """Drops the grid lines at which nothing changes, so that a wall is cut only where its own openings need it."""
    u_runs = _runs(cells, 0)
    v_runs = _runs(cells, 1)
    return [
        (u_lines[u0], u_lines[u1], v_lines[v0], v_lines[v1])
        for u0, u1 in u_runs
        for v0, v1 in v_runs
        if (u0, v0) in cells
    ]


def _runs(cells, side):
    lines = {}
    for cell in cells:
        lines.setdefault(cell[side], set()).add(cell[1 - side])
    runs = []
    for index in sorted(lines):
        if runs and runs[-1][1] == index and lines[index] == lines[index - 1]:
            runs[-1][1] = index + 1
        else:
            runs.append([index, index + 1])
    return runs


def quads(axis, sign, by_coordinate):
    """(positions, normals, indices) of the rectangles, counter-clockwise seen from where the normal points."""
    u, v = (axis + 1) % 3, (axis + 2) % 3
    normal = [0.0, 0.0, 0.0]
    normal[axis] = float(sign)
    positions, indices = [], []
    for coordinate in sorted(by_coordinate):
        number = {}
        for u0, u1, v0, v1 in by_coordinate[coordinate]:
            corners = [(u0, v0), (u1, v0), (u1, v1), (u0, v1)]
            for corner in corners:
                if corner not in number:
                    number[corner] = len(positions)
                    point = [0.0, 0.0, 0.0]
                    point[axis], point[u], point[v] = coordinate, corner[0], corner[1]
                    positions.append(point)
            a, b, c, d = (number[corner] for corner in corners)
            indices += [a, b, c, a, c, d] if sign > 0 else [a, c, b, a, d, c]
    return positions, [normal] * len(positions), indices
