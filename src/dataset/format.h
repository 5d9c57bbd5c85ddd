/* The structs of a .spld file as they lie on disk: little-endian, natural alignment, no padding. api/format.md is the
 * prose. A reader skips section types it does not know. */
#ifndef SPL_DATASET_FORMAT_H
#define SPL_DATASET_FORMAT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "shared.h" /* SPL_CHUNK_SPLATS */

#define SPL_FILE_MAGIC "SPLD\r\n\x1a\n"
#define SPL_FILE_VERSION 2u
#define SPL_FILE_ALIGNMENT 65536u  /* of pages; other sections start on 64 bytes */
#define SPL_PAGE_BYTES (16u << 20) /* target; a page is at most SPL_PAGE_BYTES_MAX */
#define SPL_PAGE_BYTES_MAX (64u << 20)
#define SPL_HEAD_BYTES_MAX (16u << 20) /* the writer begins a new page rather than a longer head */
#define SPL_NODE_CHUNKS_MAX 4096u
#define SPL_SECTIONS_MAX (1u << 22) /* pages of 32 TiB, and what belongs to them */
#define SPL_META_BYTES_MAX (8u << 20) /* JSON takes some fifty times as much memory at worst */

struct spl_file_header { /* at offset 0 */
    char magic[8];
    uint32_t version;
    uint32_t header_bytes; /* sizeof(struct spl_file_header) */
    uint64_t file_bytes;
    uint64_t table_offset; /* section table */
    uint32_t section_count;
    uint32_t reserved;    /* 0 */
    uint64_t table_hash;  /* XXH3-64 of the section table */
    uint64_t header_hash; /* XXH3-64 of the bytes before this field */
};

#define SPL_FOURCC(a, b, c, d) ((uint32_t)(a) | (uint32_t)(b) << 8 | (uint32_t)(c) << 16 | (uint32_t)(d) << 24)
#define SPL_SECTION_META SPL_FOURCC('M', 'E', 'T', 'A')      /* JSON: sources, counts, statistics, default view */
#define SPL_SECTION_DIRECTORY SPL_FOURCC('P', 'D', 'I', 'R') /* struct spl_page_row[pages + 1] */
#define SPL_SECTION_HEAD SPL_FOURCC('H', 'E', 'A', 'D')      /* what a page holds, see below; `index` is the page's */
#define SPL_SECTION_PAGE SPL_FOURCC('P', 'A', 'G', 'E')      /* chunk data; `index` is the page's number */
/* Textures; a file has all of these kinds or none. */
#define SPL_SECTION_ATOMS SPL_FOURCC('A', 'T', 'O', 'M')    /* struct spl_atoms_header, cosine coefficients */
#define SPL_SECTION_TEXTURES SPL_FOURCC('T', 'E', 'X', 'P') /* codes of a page's chunks; `index` is the page's */
/* Maps of stations; the same. map.h has what they hold. */
#define SPL_SECTION_STATIONS SPL_FOURCC('P', 'A', 'N', 'O') /* struct spl_map_row[stations] */
#define SPL_SECTION_MAP SPL_FOURCC('P', 'M', 'A', 'P')      /* words of a map; `index` is its row's */

struct spl_section {
    uint32_t type;
    uint32_t index; /* number among the sections of its type */
    uint64_t offset, bytes;
    uint64_t hash; /* XXH3-64 of the section's bytes */
};

/* Where a page's share of nodes (which lie breadth first, node 0 is the root), chunks and splats begins; the row
 * behind the last page's closes it. A page has those from its row's on to the next one's.
 *
 * HEAD has, back to back: the first SPL_NODE_BYTES of each struct spl_node of the page; the first SPL_CHUNK_BYTES of
 * each struct spl_chunk; with textures a uint32_t of each chunk (SPL_CHUNK_TEXTURE_*, 0 = none); with maps of stations
 * a struct spl_chunk_stations of each chunk; of each optional attribute a uint32_t of each chunk, its base; of each
 * attribute a uint8_t of each chunk, its width. */
struct spl_page_row {
    uint64_t first_node, first_chunk;
    uint64_t first_id;    /* of splats and vertices of lines */
    uint64_t first_child; /* the node that the first child of the page's nodes is, or would be */
};

/* An octree node: splats that represent its cube at the node's spacing. A leaf holds the originals. A cut through the
 * tree (each leaf under exactly one drawn node) represents everything. */
struct spl_node {
    double origin[3]; /* least corner of the cube, world */
    float size;       /* edge of the cube */
    float spacing;    /* median distance of neighbouring splats, metres: median radius / SPL_RADIUS_SPACING */
    float box_min[3], box_max[3]; /* of its splats' and all descendants' discs, relative to origin */
    uint16_t chunk_count; /* 1..SPL_NODE_CHUNKS_MAX */
    uint8_t child_count;  /* 0..8 */
    uint8_t depth;        /* root = 0 */

    /* Not on disk: sums over the nodes before it. */
    uint32_t page;        /* all chunks of a node lie in one page */
    uint64_t first_child; /* children are consecutive; of a leaf it means nothing */
    uint64_t first_chunk;
};

#define SPL_NODE_BYTES 60u /* of a node on disk */

/* extra_bits: number of splats with a clip line, or of lines in a chunk of lines, 16..23, kind 24..31; of lines the
 * code of their width 8..15; of meshes the step of their heights 8..15 and the level of their lattices 16..17; on disk,
 * the number of splats 0..7. */
#define SPL_EXTRA_COUNT 0
#define SPL_EXTRA_CLIP 16
#define SPL_EXTRA_LINES 16
#define SPL_EXTRA_WIDTH 8
#define SPL_EXTRA_STEP 8
#define SPL_EXTRA_LEVEL 16
#define SPL_EXTRA_KIND 24

/* Zero words that end each page, so that a shader may load two words a field without looking where a stream ends. */
#define SPL_PAGE_TAIL_WORDS 2

/* What a chunk holds; codec.h has a row for each. */
enum spl_chunk_kind {
    SPL_CHUNK_DISCS, /* splats */
    SPL_CHUNK_LINES, /* vertices of wires, poles and cables; pieces go from one to the next */
    SPL_CHUNK_PANELS, /* cells of a plane; panels.h */
    SPL_CHUNK_MESHES, /* the same with heights above it; relief.h */
    SPL_CHUNK_KINDS
};

/* Up to SPL_CHUNK_SPLATS splats that lie close together, in pruning order; or as many vertices of lines, in the order
 * of their lines, with the same fields but for clip lines. Streams of fixed-width codes, each stream starting on a
 * word: geometry (x y z u v radius), linear, colour (y u v), clip lines; then the dataset's optional attributes
 * (streams.h), which vertices and panels do not have. A splat's fields lie one after the other from the low bits up.
 * Of panels the fields mean what is said behind them: the plane stands where discs have the coding of theirs. */
struct spl_chunk {
    float origin[3]; /* relative to the node's origin; position = origin + step * code; panels: of cell (0, 0) */
    float step;      /* panels: side of a cell */
    float radius_min, radius_step; /* panels: by which they blend; mean distance of their points to the plane */
    float radius_mean; /* of the chunk's splats as they were made, which is their spacing: level selection and
                          prune-and-scale use it; leaves of pruned datasets are drawn smaller */
    float normal_u, normal_v, normal_step; /* panels: the plane's; the largest distance of a point */
    uint32_t geometry_word; /* in the node's page, 32-bit words; the other streams follow in order */
    uint32_t geometry_bits; /* as in shared.h */
    uint32_t color_bits;    /* as in shared.h; panels: words of the chunk */
    uint32_t color_base;    /* panels: points that they stand for */
    uint32_t extra_bits; /* SPL_EXTRA_* */

    /* Not on disk. */
    uint32_t count;    /* there in extra_bits, here taken out of them */
    uint64_t first_id; /* dataset-wide index of its first splat or vertex: the sum of the counts before it */
};

#define SPL_CHUNK_BYTES 60u /* of a chunk on disk */

/* enum spl_chunk_kind, or SPL_CHUNK_KINDS and more in a file that opening refuses. */
static inline uint32_t spl_chunk_kind(const struct spl_chunk *chunk)
{
    return chunk->extra_bits >> SPL_EXTRA_KIND;
}

/* Panels, with relief or without? */
static inline bool spl_kind_has_panels(uint32_t kind)
{
    return kind == SPL_CHUNK_PANELS || kind == SPL_CHUNK_MESHES;
}

/* ATOM: this header, then the stream of atoms.h. */
struct spl_atoms_header {
    uint32_t count;       /* 1..SPL_DICTIONARY_MAX, and such that the expanded dictionary fits a binding */
    uint32_t size;        /* of a texture's side: 8, 16 or 32 */
    uint32_t reserved[2]; /* 0 */
};

/* r = 2 sqrt(area of a splat's share / pi): on a square grid of spacing h, eq. 20 gives r = 1.128 h. */
#define SPL_RADIUS_SPACING 1.128379f

_Static_assert(sizeof(struct spl_file_header) == 56, "on disk");
_Static_assert(sizeof(struct spl_section) == 32, "on disk");
_Static_assert(sizeof(struct spl_page_row) == 32, "on disk");
_Static_assert(offsetof(struct spl_node, page) == SPL_NODE_BYTES, "on disk");
_Static_assert(offsetof(struct spl_chunk, count) == SPL_CHUNK_BYTES, "on disk");
_Static_assert(sizeof(struct spl_atoms_header) == 16, "on disk");

#endif
