"""Sections 19 and 20: cells, hexahedra in codec paper, nodes, last uses."""

from .basics import FACES, reject, reject_unless
from .coders import Bits, Mixer, Mixing, Models, Number, RangeDecoder, Signed, choice, number, signed, tree
from .mid_nodes import MidNodes, grid_of, mid_nodes_of
from .other_cells import OtherCells, corners_of
from .polyhedra import Polyhedra
from .replay import Replay
from .rows import Rows
from .surface import AS_STORED, CORNER_BITS, EDGE_CORNERS, FACE_CORNERS, MOST_FACES, ROTATIONS, ActiveSurface, around

PAPER, ROWS, REPLAY, MIXED, SHIFTS, PATTERNS = 1, 6, 7, 8, 11, 13
MOST_NODES = 65536


class Cell:
    """A cell of any shape. Positions of its nodes are those of the coder's frame."""

    def __init__(self, block_index, block, count, corner_order):
        self.block_index, self.block, self.shape, self.count = block_index, block, block.shape, count
        self.hexahedral = block.hexahedral()
        self.corner_order = corner_order  # else hexahedra of eight nodes stand as the frame has them
        self.v = [None] * count
        self.new_positions = []
        self.stored_corner = AS_STORED
        self.corners = corners_of(block, count)  # c of section 37; 8 for hexahedra
        self.mid = mid_nodes_of(block)  # section 36: position -> what it is in the middle of
        self.grid = grid_of(block)  # section 48
        self.behind = [None] * 8  # section 37
        self.by_faces = False  # section 42
        self.last_use = []  # positions
        self.number = 0

    def reversed_axes(self):
        """Section 48: the axes along which the rows of a hexahedron's grid begin at the high end."""
        if not self.hexahedral:
            return set()
        new = [CORNER_BITS[self.stored_corner[p]] for p in self.new_positions if p < 8]
        return {a for a in range(3) if 2 * sum(bits >> a & 1 for bits in new) < len(new)}

    def turned(self):
        """Whether stored_corner is coded."""
        return self.corner_order or self.block.nodes_per_cell != 8

    def bits(self, i):
        """Section 22: corner bits of position i of a hexahedron."""
        return CORNER_BITS[self.stored_corner[i] if self.turned() else i]

    def position_stored(self, stored):
        """Where what is stored at `stored` stands in the frame."""
        return self.stored_corner.index(stored) if self.hexahedral and stored < 8 else stored

    def stored_position(self, i):
        return self.stored_corner[i] if self.hexahedral and i < 8 else i


class NodeModels:
    def __init__(self):
        self.is_new, self.step, self.repeat = Bits(), Signed(), Number()
        self.repeated = Bits()


class Reference:
    def __init__(self):
        self.last = 0
        self.from_last, self.step, self.age = Bits(), Signed(), Number()

    def decode(self, source, surface):
        if source.bit(self.from_last[0]):
            id_ = self.last + signed(source, self.step)
        else:
            id_ = surface.oldest_id() + number(source, self.age)
        self.last = id_
        return surface.with_id(id_)


class Connectivity:
    """All that a segment keeps to decode its cells, with codec paper, rows, replay or mixed."""

    def __init__(self, schema):
        self.schema, self.codec, self.hexahedra = schema, None, None
        self.surface = ActiveSurface()
        self.others = OtherCells(schema, self.surface)
        self.mid = MidNodes(self.surface)
        self.polyhedra = Polyhedra(self.surface)
        self.mixing = (Mixing(), Mixing())  # of section 33: connectivity, corner_order
        self.last_block = 0
        self.last_new = 0  # last_new[1]; last_new[0] is that of codec paper
        self.last_finalized = [0] * 8
        self.node_ids = [[] for _ in schema.blocks]
        self.same_block, self.block_number, self.node_count = Bits(), Number(), Number()
        self.nodes_models = Models(NodeModels)
        self.last_use = Bits()

    def begin_group(self, codec, connectivity, corner_order):
        """The bytes of both streams; `codec` is the same in all groups."""
        self.codec = codec
        if self.hexahedra is None:
            if codec == PAPER:
                self.hexahedra = Paper(self.surface)
            elif codec == REPLAY:
                self.hexahedra = Replay(self.schema, self.surface)
            else:
                self.hexahedra = Rows(self.schema, self.surface, self.others)
        self.source, orders = RangeDecoder(connectivity), RangeDecoder(corner_order)
        self.others.begin_group(self.source)
        self.polyhedra.begin_group(self.source)
        if self.codec == MIXED:
            self.hexahedra.begin_group(Mixer(self.mixing[0], self.source), Mixer(self.mixing[1], orders))
        else:
            self.hexahedra.begin_group(self.source, orders)

    # ------------------------------------------------------------------ A cell

    def cell(self):
        source, blocks = self.source, self.schema.blocks
        if len(blocks) == 1:
            index = 0
        elif source.bit(self.same_block[0]):
            index = self.last_block
        else:
            index = number(source, self.block_number)
        reject_unless(index < len(blocks), "a cell of no block")
        self.last_block = index
        cell = Cell(index, blocks[index], 0, self.schema.corner_order) if blocks[index].shape == FACES else None
        if cell and self.polyhedra.code(cell, self.others.cells):
            stated = blocks[index].nodes_per_cell
            reject_unless(stated in (0, cell.count), "a cell of another number of nodes")
            self.others.update_open_faces(cell)
            for vertex in cell.v:
                vertex.uses += 1
            self.polyhedra.last_uses(cell)
            return cell
        count = blocks[index].nodes_per_cell or number(source, self.node_count)
        reject_unless(count <= MOST_NODES, "a cell of too many nodes")
        cell = Cell(index, blocks[index], count, self.schema.corner_order)
        if cell.hexahedral:
            self.hexahedra.hexahedron(cell)
            self.hexahedra.attach(cell)
            self.nodes(cell, 8)
        else:
            self.others.corners(cell)
            if cell.corners < count:
                self.nodes(cell, cell.corners)
        self.others.update_open_faces(cell)
        counted = 8 if cell.hexahedral and self.codec == REPLAY else 0
        for vertex in cell.v[counted:]:
            vertex.uses += 1
        self.last_uses(cell)
        return cell

    # ------------------------------------------------------------------ Nodes that are no corners

    def nodes(self, cell, first):
        source, v, last = self.source, cell.v, self.node_ids[cell.block_index]
        shift = 0
        order = cell.grid.in_rows(cell.reversed_axes()) if cell.grid else range(cell.count)
        for rank, i in enumerate(order):
            if rank >= first and not (i in cell.mid and self.mid.as_expected(source, cell, i)):
                m = self.nodes_models[min(rank, 31)]
                base = last[rank] if rank < len(last) else v[order[rank - 1]].id if rank > 0 else 0
                is_new = self.last_new = source.bit(m.is_new[self.last_new])
                if is_new:
                    v[i] = self.surface.add_vertex()
                    cell.new_positions.append(i)
                elif rank > 0 and source.bit(m.repeated[0]):
                    back = number(source, m.repeat)
                    reject_unless(back < rank, "a repeated node of no position")
                    v[i] = v[order[rank - 1 - back]]
                else:
                    v[i] = self.surface.with_id(base + shift + signed(source, m.step))
                    if rank < len(last):
                        shift = v[i].id - last[rank]
            if i in cell.mid:
                self.mid.note(cell, i)
            if rank >= len(last):
                last.append(v[i].id)
            elif rank >= first:
                last[rank] = v[i].id

    # ------------------------------------------------------------------ Finalization flags

    def last_uses(self, cell):
        first = 0
        if cell.hexahedral and self.codec != PAPER:
            self.hexahedra.last_uses(cell)
            first = 8
        elif not cell.hexahedral:
            self.others.last_uses(cell)
            first = cell.corners
        for i in range(first, cell.count if cell.grid else min(cell.count, 64)):
            vertex = cell.v[i]
            if any(vertex is earlier for earlier in cell.v[:i]):
                continue
            if i in cell.mid:
                last = self.mid.ends(self.source, cell, i)
            else:
                kind = int(cell.hexahedral and i < 8)
                before = self.last_finalized[i & 7]
                model = self.last_use[kind, min(len(vertex.places), 5), min(vertex.uses, 8), before]
                last = self.last_finalized[i & 7] = self.source.bit(model)
            if last:
                cell.last_use.append(i)

    def finalize(self, cell):
        """In order of position, what the cell uses last."""
        done = set()
        for i in cell.last_use:
            vertex = cell.v[i]
            if vertex.id not in done:
                done.add(vertex.id)
                self.finalize_vertex(vertex)
        if cell.hexahedral and self.codec in (ROWS, MIXED):
            self.hexahedra.end_cell()

    def finalize_vertex(self, vertex):
        self.others.forget_vertex(vertex)
        self.mid.forget_vertex(vertex)
        self.polyhedra.forget_vertex(vertex)
        if self.hexahedra is None:  # an unused vertex before any cell
            self.surface.finalize(vertex)
            return
        self.hexahedra.forget_vertex(vertex)
        self.surface.finalize(vertex, self.hexahedra.face_removed)


# ---------------------------------------------------------------------------- Codec paper

START, HUT, ROOF, STEP, BRIDGE = range(5)


class Paper:
    """Hexahedra of codec paper: sections 19 and 20."""

    def __init__(self, surface):
        self.surface = surface
        self.last_operation, self.mode_history, self.last_face, self.last_turn = START, 0, 5, 0
        self.last_new, self.rotation_history = 0, 0
        self.gate_reference, self.join_reference = Reference(), Reference()
        self.previous, self.previous_face = None, [None] * 6
        self.operations, self.modes, self.mirrored = Models(Bits), Bits(), Bits()
        self.gate_on_face, self.turn = Bits(), Models(Bits)
        self.gate_at_edge, self.gate_at_vertex, self.gate_anywhere = Bits(), Bits(), Bits()
        self.side_models, self.confirm, self.corner_new = Models(Bits), Bits(), Bits()
        self.corner_repeated, self.repeated_corner = Bits(), Bits()
        self.rotation_hit, self.rotation = Bits(), Bits()
        self.roof_face, self.roof_turned = Bits(), Bits()

    def begin_group(self, source, orders):
        self.source, self.orders = source, orders

    def face_removed(self, face):
        pass

    def forget_vertex(self, vertex):
        pass

    def hexahedron(self, cell):
        self.v, self.cell = cell.v, cell
        v, bit = cell.v, self.source.bit
        operation = tree(self.source, self.operations[self.last_operation, self.mode_history], 3)
        reject_unless(operation <= BRIDGE, "an unknown operation")
        self.operation = operation
        if operation == START:
            for i in (0, 1, 2, 3, 4, 7, 5, 6):
                self.corner(i)
            self.last_operation = START
            return
        mirrored = bit(self.mirrored[operation])
        gate = self.gate_place(mirrored)
        for i in range(4):
            v[i] = around(gate, (4 - i) % 4 if mirrored else i)
        if operation == HUT:
            for i in (4, 7, 5, 6):
                self.corner(i)
        elif operation == ROOF:
            self.roof()
        elif operation == STEP:
            v[4], v[7] = self.side(0, gate, v[0], v[3])
            self.corners_left()
        else:
            v[4], v[7] = self.side(0, gate, v[0], v[3])
            v[5], v[6] = self.side(1, gate, v[1], v[2])
        self.last_operation = operation
        if cell.turned():
            self.corner_order(gate, mirrored)

    # ------------------------------------------------------------------ The gate

    def on_previous(self, face):
        return face.active and face.owner is self.previous

    def first_of(self, count, model_of):
        """The first of so many candidates whose bit is set; the last one needs none."""
        for i in range(count - 1):
            if self.source.bit(model_of(i)):
                return i
        return count - 1

    def gate_place(self, mirrored):
        source, operation, history = self.source, self.operation, self.mode_history

        def decode_mode(mode):
            if mode < 3 and not source.bit(self.modes[operation, history, mode]):
                return False
            self.mode_history = (4 * self.mode_history + mode) & 15
            return True

        faces = [k for k in (5, 3, 1, 4, 2, 0) if self.previous_face[k] and self.on_previous(self.previous_face[k])]
        if faces and decode_mode(0):
            k = faces[self.first_of(len(faces), lambda i: self.gate_on_face[self.last_face, faces[i]])]
            turn = 0
            if operation in (STEP, BRIDGE):
                turn = self.last_turn = tree(source, self.turn[k, self.last_turn], 2)
            self.last_face = k
            return self.previous_face[k], turn

        corners = self.previous.corners if self.previous else ()
        found = []
        for e, (a, b) in enumerate(EDGE_CORNERS if self.previous else ()):
            a, b = corners[a], corners[b]
            if a.alive and b.alive:
                for at in a.places:
                    if (around(at, 1) is b or around(at, 3) is b) and not self.on_previous(at[0]):
                        found.append((at, e, b))
        if found and decode_mode(1):
            at, _, b = found[self.first_of(len(found), lambda i: self.gate_at_edge[found[i][1]])]
            if around(at, 1) is b:
                step = 0 if mirrored else 1
            else:
                step = 3 if mirrored else 0
            return at[0], (at[1] + step) & 3

        found = [(at, c) for c, vertex in enumerate(corners) if vertex.alive
                 for at in vertex.places if not self.on_previous(at[0])]
        if found and decode_mode(2):
            return found[self.first_of(len(found), lambda i: self.gate_at_vertex[found[i][1]])][0]

        decode_mode(3)
        x = self.gate_reference.decode(source, self.surface)
        reject_unless(x.places, "a gate at a vertex without faces")
        return x.places[choice(source, self.gate_anywhere, 16, len(x.places))]

    # ------------------------------------------------------------------ Second faces

    def side(self, n, gate, start, along):
        places = [at for at in start.places
                  if at[0] is not gate[0] and (around(at, 1) is along or around(at, 3) is along)]
        reject_unless(places, "a second face at an edge that has none")
        at = places[choice(self.source, self.side_models[n], 8, len(places))]
        above = around(at, 3) if around(at, 1) is along else around(at, 1)
        return above, around(at, 2)

    def roof(self):
        v = self.v
        v[4] = self.join_reference.decode(self.source, self.surface)
        reject_unless(v[4].places, "a roof at a vertex without faces")
        at = v[4].places[choice(self.source, self.roof_face, 16, len(v[4].places))]
        turned = self.source.bit(self.roof_turned[0])
        for i in (1, 2, 3):
            v[4 + i] = around(at, i if turned else 4 - i)

    def corners_left(self):
        v, find_path = self.v, self.surface.find_path
        at = find_path(v[1], v[0], v[4])
        if at and self.source.bit(self.confirm[0]):
            v[5] = around(at, 2)
            for i, (a, b, c) in ((1, (v[2], v[1], v[5])), (2, (v[2], v[3], v[7])), (3, (v[5], v[4], v[7]))):
                at = find_path(a, b, c)
                if at and self.source.bit(self.confirm[i]):
                    v[6] = around(at, 2)
                    return
            self.corner(6)
        else:
            self.corner(5)
            self.corner(6)

    # ------------------------------------------------------------------ Single corners

    def corner(self, i):
        source, v, operation = self.source, self.v, self.operation
        is_new = self.last_new = source.bit(self.corner_new[operation, i, self.last_new])
        if is_new:
            v[i] = self.surface.add_vertex()
            self.cell.new_positions.append(i)
        elif operation == START and source.bit(self.corner_repeated[i]):
            v[i] = v[tree(source, self.repeated_corner, 3)]
            reject_unless(v[i], "a repeated corner that is not known")
        else:
            v[i] = self.join_reference.decode(source, self.surface)

    # ------------------------------------------------------------------ Attach

    def attach(self, cell):
        v, surface = cell.v, self.surface
        self.previous = Previous(v[:8])
        faces = self.previous_face = [None] * 6
        for k, corners in enumerate(FACE_CORNERS):
            quad = [v[c] for c in corners]
            if len({vertex.id for vertex in quad}) < 4:
                continue
            face = surface.find_face(*quad)
            if face:
                for j in range(6):
                    if faces[j] is face:
                        faces[j] = None
                surface.remove_face(face)
            elif all(len(vertex.places) < MOST_FACES for vertex in quad):
                owner_corner = [cell.stored_corner[c] for c in corners]
                faces[k] = surface.add_face(quad, owner_corner, self.previous, k)

    # ------------------------------------------------------------------ 20 Corner order stream

    def corner_order(self, gate, mirrored):
        face, position = gate
        expected = None
        if not mirrored:
            b = [CORNER_BITS[face.owner_corner[(position + i) & 3]] for i in range(4)]
            across = 7 & ~((b[0] ^ b[1]) | (b[0] ^ b[3]))
            wanted = [CORNER_BITS[b[i] ^ across] for i in (0, 1, 3)]
            for r, rotation in enumerate(ROTATIONS):
                if [rotation[0], rotation[1], rotation[3]] == wanted:
                    expected = r
        hit = 0
        if expected is not None:
            hit = self.orders.bit(self.rotation_hit[self.rotation_history])
            self.rotation_history = (2 * self.rotation_history + hit) & 3
        rotation = expected if hit else tree(self.orders, self.rotation, 5)
        if rotation > 23:
            reject("an unknown rotation")
        self.cell.stored_corner = ROTATIONS[rotation]


class Previous:
    """The previous hexahedron, owner of its faces."""

    def __init__(self, corners):
        self.corners = corners


