/* Wires, poles and cables as lines: the points that spl_linear_find() marked, joined along themselves, and what a node
 * of the tree has of them, at its own level of detail. */
#ifndef SPL_PACK_WIRES_WIRES_H
#define SPL_PACK_WIRES_WIRES_H

#include "pack/points.h"
#include "pack/wires/join.h" /* SPL_WIRE_END */

struct spl_wire_vertex {
    double position[3]; /* world */
    float normal[3];
    float radius;         /* what the line stands for, metres */
    float length;         /* of the whole line, metres */
    float width;          /* how thick it is, metres; 0 = not known */
    uint32_t color_class; /* as in struct spl_points */
    uint32_t point;       /* whose node has the piece from here to the next vertex; SPL_WIRE_END: the line ends here */
};

struct spl_wires {
    struct spl_wire_vertex *vertices; /* line after line */
    size_t count, capacity;
    uint32_t *pieces; /* vertices that pieces begin at, by their points */
    size_t piece_count;
    bool with_widths; /* of lines: options were given */
    double error;     /* of those */
    struct spl_spill *spill; /* where they lie; may be NULL */
    bool cut_short; /* joining would have taken more steps than it may: what is left stays open */
};

struct spl_wires_options {
    double noise; /* sigma of the scan's, metres; 0 = not known */
    double error; /* metres that a line of a leaf may be off the axis of what was scanned; 0 = a quarter of its width */
};

/* Joins the linear ones of `points`, which are sorted and have radii. Takes some 5 us and 120 bytes a linear point, of
 * which 60 stay, and never more than a bounded number of steps of each. SPL_E_NOMEM, SPL_E_CANCELLED, SPL_E_LIMIT where
 * there are more vertices than can be numbered. On failure too, `wires` is finished by the caller.
 * With `options` (NULL: without), lines are the axes of what was scanned and have widths, and points that no line
 * stands for are linear no more. */
int spl_wires_find(struct spl_wires *wires, struct spl_points *points, const struct spl_wires_options *options,
                   struct spl_stage *stage, struct spl_error *err);

void spl_wires_finish(struct spl_wires *wires);

/* What a node has of the wires. Zeroed before first use, reused from node to node. */
struct spl_node_lines {
    struct spl_wire_vertex *vertices; /* line after line; each line has at least one piece */
    size_t count, capacity;
    uint32_t *pieces; /* scratch, as `kept` */
    uint8_t *kept;
    size_t piece_capacity;
};

/* The pieces of points [begin, end), as lines. With `spacing` 0 as they were joined, those with widths but for vertices
 * that their bound does not need (of `error` 0 width * SPL_WIRES_WIDTH_ERROR); else simplified for a level whose splats
 * lie so far apart: no vertex that is left out lies farther off than spacing * SPL_WIRES_ERROR, lines of less than
 * spacing * SPL_WIRES_SHORTEST are left out whole, colours and normals are means, and radii are those of the level.
 * Where that is more than SPL_NODE_VERTICES vertices, as of a coarser level. Ends of a node's lines at pieces of other
 * nodes stay as they are, so lines meet whatever levels stand beside each other. False: no memory. Any thread. */
#define SPL_WIRES_ERROR 0.25
#define SPL_WIRES_SHORTEST 0.5
#define SPL_WIRES_WIDTH_ERROR 0.25
enum { SPL_NODE_VERTICES = 8192 };
bool spl_wires_get_node(const struct spl_wires *wires, size_t begin, size_t end, double spacing,
                        struct spl_node_lines *out);

void spl_node_lines_finish(struct spl_node_lines *lines);

#endif
