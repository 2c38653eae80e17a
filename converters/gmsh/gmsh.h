// Gmsh MSH files as meshes: versions 1.0, 2.x, 4.0 and 4.1, ASCII and binary, either byte order;
// and version 3.0, ASCII.
//
// A mesh has one block for each entity block of MSH 4 (the block id is the entity tag), or for each
// combination of element type and tags of MSH 1 and 2 (the block id is the elementary tag). If
// there are more than 1024 combinations, it has one block for each type and number of tags, and the
// tags are in arrays. Views that cover all nodes, or all elements of some blocks, become arrays; if
// a view has several time steps, its array has values for each step. Nodes of second-order elements
// are permuted to VTK's order; other high-order elements have shape `other` and keep the node order
// of the file.
//
// Arrays with a role:
//   gmsh:node_tag, gmsh:element_tag
//                          int64; exist only if the tags are not consecutive, or if a part of the
//                          file that is kept verbatim may refer to tags
//   gmsh:node_entity       int32: row number in gmsh/nodes/entities; exists only if that extra has
//                          several rows
//   gmsh:node_parameters   float64 x 3; exists if some nodes have parametric coordinates
//   gmsh:tag_<i>           int32: i-th tag (from 0) of an MSH 1/2 element, on the blocks whose
//                          elements have this tag; tags 0 and 1 are stored only if the block does
//                          not determine them
//   gmsh:element_node_data values of $ElementNodeData: one component for each node of an element
//                          and each value of a node, in file order
//
// Extras:
//   gmsh/mesh_format       text: the line of $MeshFormat, e.g. "4.1 0 8"; "1" for MSH 1
//   gmsh/byte_order        text: "little" or "big"; exists only for binary files
//   gmsh/sections          text: a line for each section, "name TAB kind TAB step TAB array";
//                          kind is format, nodes, elements, array, list, links, ghosts, names,
//                          raw or between (text between sections, which has no name)
//   gmsh/nodes/first_tag, gmsh/elements/first_tag
//                          int64: the first tag; exist only if the tags are consecutive
//   gmsh/nodes/entities    int32 [n, 3]: dimension, tag, parametric, in file order
//   gmsh/elements/blocks   int32 [blocks, 3]: dimension, entity, type (MSH 4), or
//                          int32 [blocks, 4]: type, number of tags, first two tags (MSH 1/2)
//   mesh/element_set/<i>/...   physical groups that contain blocks, as in shm/sets.h, sorted by
//                          dimension and tag; the content of a $PhysicalNames section of kind names
//                          is derived from these sets
//   gmsh/section/<k>       uint8: content of a section of kind raw or between; <k> is the number
//                          (from 0) of its line in gmsh/sections, as in the following keys
//   gmsh/section/<k>/header   text: string, real and integer tags of a data section
//   For a section of kind list (a view that covers only some nodes or elements), in file order:
//     .../vertices or .../cells   int64: references to nodes or elements; if some are not in the
//                          mesh, .../tags contains their tags instead
//     .../counts           int32: number of nodes of each element; only for $ElementNodeData
//     .../values           float64
//   For a section of kind links ($Periodic):
//     .../links            int64 [n, 5]: dimension, tag, master tag, number of affine values,
//                          number of pairs of nodes
//     .../affine           float64: the affine values of all links
//     .../nodes            int64 [m, 2]: references to the nodes of each pair
//   For a section of kind ghosts ($GhostElements):
//     .../cells            int64: references to the elements
//     .../partitions       int32 [n, 2]: partition, number of ghost partitions of each element
//     .../ghosts           int32: the ghost partitions of all elements
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "base/spool.h"
#include "interface/format.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

// Opens a file. `spool` must outlive the mesh. Throws Failure.
std::unique_ptr<MeshSource> open_gmsh(const std::string& path, Spool& spool);

// Returns true if a file is a Gmsh file. `head` is the beginning of the file, up to 4096 bytes.
bool looks_like_gmsh(std::span<const std::byte> head);

// Writes a mesh. If the mesh came from Gmsh, the file has the version, encoding and sections of its
// source. Otherwise the file is binary MSH 4.1.
void write_gmsh(MeshSource& mesh, const std::string& path);

extern const Format kGmshFormat;

}  // namespace shm::converters
