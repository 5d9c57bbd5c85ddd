/* Structs and constants that C and GLSL share, but those of soft spheres (shared_soft.h); both include this file as it
 * is. Only 4-byte scalars, so that std430 and C agree without padding. Sizes are asserted on the C side here; every
 * device reads each field on the GLSL side in the self-test at open (selftest.comp: a changed struct changes it there
 * too). */
#ifndef SPL_SHARED_H
#define SPL_SHARED_H

#ifdef GL_core_profile /* predefined in both of glslang's flavours */
#define SPL_GLSL 1
#endif

#ifdef SPL_GLSL
#define SPL_U32 uint
#define SPL_F32 float
#else
#include <stdint.h>
#define SPL_U32 uint32_t
#define SPL_F32 float
#endif

/* A chunk: the unit of culling and decoding. Its splats lie in pruning order: the first runs are an even subsample, and
 * so nearly is what is drawn of the one behind them, whose SPL_LANES drawn at a time are of about one size. */
#define SPL_CHUNK_SPLATS 128
/* A draw-list entry is a run of splats of one chunk: chunk index << 2 | run. SPL_LANES invocations share an entry and
 * draw its splats in steps, so that the chunk's header is loaded once for several splats. Counts are multiples of
 * SPL_LANES: an idle lane costs as much as a busy one on software drivers, whose subgroups have that many. */
#define SPL_RUN_SPLATS 32
#define SPL_RUN_BITS 2
#define SPL_LANES 8
#define SPL_WORKGROUP 64
/* On hardware a workgroup of its own size draws an entry's discs: shaders/common/walk.glsl. */
#define SPL_SHARED_LANES 128

/* The self-test's page lies this many times its own size into its buffer. */
#define SPL_SELFTEST_PAGE 3

/* What the shade pass sums up, and method points keeps as payload: one run per group of layers. */
#define SPL_SUMS_COLOR 0
#define SPL_SUMS_DEPTH 1  /* layers depth and range */
#define SPL_SUMS_NORMAL 2
#define SPL_SUMS_ID 3
#define SPL_SUMS_PRIMITIVE 4 /* as ids, of SPL_DRAWN_* */
#define SPL_SUMS_COUNT 5
#define SPL_SUMS_MAPPED 5 /* method nearest alone: colours for maps to add to, and how far the depth was bent */

/* Layers of the resolve pass, the values of enum spl_layer. */
#define SPL_RESOLVE_COLOR 0
#define SPL_RESOLVE_DEPTH 1
#define SPL_RESOLVE_RANGE 2
#define SPL_RESOLVE_NORMAL 3
#define SPL_RESOLVE_ID 4
#define SPL_RESOLVE_COVERAGE 5
#define SPL_RESOLVE_PRIMITIVE 6

/* What is drawn, the values of enum spl_shape; 0 is nothing. */
#define SPL_DRAWN_SPLAT 1
#define SPL_DRAWN_LINE 2
#define SPL_DRAWN_PANEL 3
#define SPL_DRAWN_MESH 4

/* What the resolve pass finds in a sample. */
#define SPL_RESOLVED_SUMS 0    /* sums over fragments, as the shade pass leaves them */
#define SPL_RESOLVED_NEAREST 1 /* the nearest one's depth and payload */
/* the same, but the depth only orders; layers have the payload's; colours are smoothed */
#define SPL_RESOLVED_BENT 2
#define SPL_RESOLVED_MAPPED 3      /* as SUMS, but colours are sums of floats that maps added to */
#define SPL_RESOLVED_MAPPED_BENT 4 /* as NEAREST, but the same */
/* Samples of one surface that are smoothed differ in depth by this share at most. */
#define SPL_SMOOTH_SHARE 0.01f
/* Discs of this radius on, samples, are smoothed as those that are large. */
#define SPL_SMOOTH_RADIUS 4.0f
#define SPL_SMOOTH_REACH 3 /* samples, of the largest */

/* Along parallel rays nothing says how depths of one surface differ but the samples: by as much as for a lens of this
 * focal length, pixels, whose samples are as large there. */
#define SPL_PARALLEL_FOCAL 640.0f

/* A splat covers the samples within this many sample sizes of its centre, however small it is: half a sample's
 * diagonal, so that any centre covers one, and a thousandth more, for a centre in the corner between four and what
 * floats round. */
#define SPL_LOW_PASS 0.7081f

/* A sample within low_pass of a splat's centre, but off its disc, takes the depth of the disc's plane up to this many
 * sample sizes from the centre's depth (a slant of 76 degrees). */
#define SPL_LOW_PASS_REACH 2.828427f

/* Along parallel rays discs larger than a few samples are drawn at least this wide, samples. A line of width 1 has no
 * gaps, whatever its direction; an ellipse is that wide up to where discs of one surface meet, half a radius off its
 * centre. */
#define SPL_THIN 1.16f

/* A sample that a cell's middle falls on takes the depth of its plane, up to this many sample sizes behind it (a slant
 * of 88 degrees). */
#define SPL_CELL_REACH 16.0f

/* Seen at a slant, discs of one surface differ in depth by more than seen square on: by up to 1 / cos for the same
 * error of a normal. The blend margin grows with it, up to this much. */
#define SPL_MARGIN_SLANT 4.0f

/* The coarsest level of a texture that is drawn has this many texels a side; a splat has so many atoms at most. */
#define SPL_TEXTURE_SIDE_MIN 4
#define SPL_TEXTURE_ATOMS 8

/* A chunk in CTEX: 0 where none of its splats has an atom, else the word of its page's TEXP where its codes start, and
 * from this bit on the number of planes, 1..8. */
#define SPL_CHUNK_TEXTURE_PLANES 28
/* The same word of a drawn chunk has this bit where texels are interpolated; then the textures are summed first, a
 * splat after the other, since its fragments outnumber its texels. */
#define SPL_CHUNK_TEXTURE_SMOOTH 27

/* Words from a summed texture to the next. A row more than there is: lanes that draw neighbours at a power of two from
 * one another would fight for the same lines of a cache. */
#define SPL_SUMMED_WORDS(size) ((size) * ((size) + 1))
#define SPL_SUM_LANES(size) ((size) > 8 ? SPL_LANES : 1) /* invocations that share a texture */

/* A chunk's codes in TEXP, a stream of bits that begins on a word; for each plane
 *   a header of SPL_TEXTURE_HEADER_BITS
 *   a mask: a bit for each splat that has the plane before (the first plane: for each of SPL_CHUNK_SPLATS), set where
 *   it has this one too
 *   the codes of its splats, in their order, index_bits + weight_bits each, the index in the low bits
 * The weight's code is signed. Header: */
#define SPL_TEXTURE_HEADER_BITS 16
#define SPL_TEXTURE_INDEX_BITS 0   /* 0..4, 0..16 */
#define SPL_TEXTURE_WEIGHT_BITS 5  /* 5..7, 1..8 less 1 */
#define SPL_TEXTURE_STEP 8         /* 8..13, of spl_code_step() */
#define SPL_TEXTURE_GAP 14         /* 14..15, of spl_code_gap() */
#define SPL_TEXTURE_TAIL_WORDS 6   /* zeros that end a TEXP: a mask is read as five words wherever it ends */

/* Method fill. A depth word of its points has, from the low end: whether the point is linear, and its radius as a
 * multiple of frame.fill_radius, a float of one bit of mantissa (the field's word for it here is spacing, which is in
 * proportion). */
#define SPL_FILL_LINEAR 1u
#define SPL_FILL_SPACING_BITS 5
#define SPL_FILL_DEPTH_BITS 63u
/* A point whose radius is more than so many times the least of its chunk strays: it counts as this. */
#define SPL_FILL_STRAY 3.0f
#define SPL_FILL_LINE_MOST 50000 /* samples along which a line is drawn */
#define SPL_FILL_HOLE 0x80000000u
#define SPL_FILL_MAYBE 0x80000001u /* there is nothing to see, but near by something may be on both sides */
#define SPL_FILL_MAYBE_OPEN 6.5f   /* sectors, of eight, where that may be so */
#define SPL_FILL_LEVELS_MAX 8
/* What lies between things is closed whatever their reach, as far as it is no wider than this share of it, three
 * quarters of a spacing, and than so many samples. */
#define SPL_FILL_CRACK_REACH 0.25f
#define SPL_FILL_CRACK 8
/* Samples of one surface differ in depth by their distance times this: a slant of 76 degrees. */
#define SPL_FILL_SLOPE 4.0f

/* Lines of methods splat and nearest. They cover what lies within so many samples of their axis, however thin they are:
 * a sample in all, and a thousandth more, for an axis in the middle between two. */
#define SPL_LINE_THIN 0.5005f
/* Seen at a slant, a line at the image's edge is up to so many times wider than one in its middle. */
#define SPL_LINE_SLANT 2.0f
/* Samples that are looked at for a piece (see SPL_WINDOW); pieces of which there may be more are drawn by windows. */
#define SPL_LINE_ROUNDS 60000

/* Maps of stations: polar-capped atlases (src/geom/polar.h), as words on the device, of a station's own frame. First
 * the ranges, an atlas of SPL_MAP_RANGE_APRON with two texels a word, the first in its low half:
 *   0 not scanned   1..65534 near / range = 1 - (code - 1) / 65533   65535 nothing came back
 * so that a larger code is farther. Then the colours, an atlas of SPL_MAP_APRON for each level, each half the one
 * before: blocks of 4 x 4 texels, row by row, two words each as in BC1: two colours of 5, 6 and 5 bits (red in the high
 * ones), the first in the low half; then two bits a texel, row by row from the low end: 0 the first colour, 1 the
 * second, 2 a third of the way to it, 3 two thirds. */
#define SPL_MAP_APRON 4
#define SPL_MAP_RANGE_APRON 1
#define SPL_MAP_LEVELS_MAX 5
#define SPL_MAP_SIDE_STEP 64 /* sides of colours are multiples of it */
#define SPL_MAP_SIDE_MAX 4096
#define SPL_MAP_RANGE_SIDE_MAX 4096
#define SPL_MAP_UNKNOWN 0u
#define SPL_MAP_FARTHEST 65534u
#define SPL_MAP_NO_RETURN 65535u
/* frame.map_sides: colour side / SPL_MAP_SIDE_STEP 0..7, levels 8..11, side of ranges 12..31 */
#define SPL_MAP_SIDES_LEVELS 8
#define SPL_MAP_SIDES_RANGE 12

/* Ranges of a surface differ by this share of a disc's radius, since discs stand for what is not flat; and no surface
 * is taken to slant by more than 80 degrees. */
#define SPL_MAP_TOLERANCE 0.35f
#define SPL_MAP_FACING_MIN 0.17364818f
/* Maps give their colours to the image in cells of this many samples a side. */
#define SPL_MAP_CELL 8
/* The weight of the splats' own colours beside those of maps: a power of two, less than any of these. */
#define SPL_MAP_BASE 1.2037062152420224e-35f
/* A map's weight is the eighth power of a share that stays within this and one over it. */
#define SPL_MAP_SHARE_MIN 2.44140625e-4f

/* Polynomials for arc functions (src/geom/polar.c says of what), each to 1e-7. */
#define SPL_POLAR_EDGE 0.70710678f
#define SPL_POLAR_CAP {0.636619771f, 0.212206994f, 0.0848667829f, 0.036603746f, 0.0147453893f, 0.0113055684f}
#define SPL_POLAR_BAND                                                                                                 \
    {0.636619824f, 0.106093225f, 0.0480611773f, 0.0248145942f, 0.0383738481f, -0.0342798067f, 0.0637454089f}
#define SPL_POLAR_TURN                                                                                                 \
    {0.636619697f, -0.21219691f, 0.127113627f, -0.0891477141f, 0.0628271488f, -0.037452184f, 0.0151391483f,            \
     -0.00290285373f}

#define SPL_NOTHING 0xffffffffu /* depth word or id of a sample that nothing covers */

/* One visible chunk of one frame, made by the CPU from the chunk's header and the camera. */
struct spl_draw_chunk {
    SPL_F32 origin_x, origin_y, origin_z; /* view space: R (chunk origin - eye), computed in doubles */
    SPL_F32 step;                         /* metres per position unit, all axes */
    SPL_F32 radius_min, radius_step;      /* metres, already scaled for the drawn fraction (prune and scale) */
    SPL_U32 geometry_word;                /* offset in the page, 32-bit words */
    SPL_U32 color_word;
    SPL_U32 geometry_bits;                /* SPL_GEOMETRY_*: widths of x y z u v radius, normals' axis, linear */
    SPL_U32 color_bits;                   /* SPL_COLOR_*: widths of y u v and the base of y */
    SPL_U32 color_base;                   /* int16 base of u (low half) and v (high half) */
    SPL_F32 normal_u, normal_v, normal_step; /* octahedral coordinates of code 0, and the step, in [-1, 1] units */
    SPL_U32 first_id;                     /* dataset-wide index of the chunk's first splat */
    SPL_U32 count;                        /* SPL_COUNT_*: splats (vertices, of lines) that are drawn, window of the
                                             tile */
    SPL_U32 texture;                      /* its word of CTEX, with as many planes as are drawn */
    SPL_F32 texture_scale;                /* drawn radius over the radius that its textures are for; half a line's
                                             width, metres; of soft splats that are linear: the square of the radius
                                             that one of radius 1 has */
    SPL_U32 marks;                        /* word of the marks where its begin; 0 = all of it is solid, or all soft */
    SPL_U32 paint_word, paint_bits, paint_base; /* of the attribute that colours show: where its codes begin, their
                                             width and SPL_PAINT_LAST_NONE, and what they are added to */
};

/* geometry_bits: x 0..4, y 5..9, z 10..14 (0..24 bits each), u 15..18, v 19..22 (0..12), radius 23..26 (0..12),
 * axis 27..28: the world axis a that is the octahedron's +z (0 x, 1 y, 2 z), the other two following cyclically; bit
 * 29: the whole vector is negated. Decoding: l = octahedral decode of (u, v), sign = bit 29 ? -1 : 1, n[(a + 1) % 3] =
 * sign * l.x, n[(a + 2) % 3] = sign * l.y, n[a] = sign * l.z. Bits 30..31: which splats are linear (lie on a wire, a
 * pole, a cable): 0 none, SPL_LINEAR_ALL, or SPL_LINEAR_SOME, those whose bit is set in the mask of SPL_LINEAR_WORDS
 * words right before the colours. */
#define SPL_GEOMETRY_X 0
#define SPL_GEOMETRY_Y 5
#define SPL_GEOMETRY_Z 10
#define SPL_GEOMETRY_U 15
#define SPL_GEOMETRY_V 19
#define SPL_GEOMETRY_RADIUS 23
#define SPL_GEOMETRY_AXIS 27
#define SPL_GEOMETRY_LINEAR 30
#define SPL_LINEAR_ALL 1
#define SPL_LINEAR_SOME 2
#define SPL_LINEAR_WORDS 4 /* SPL_CHUNK_SPLATS / 32 */
/* color_bits: y 0..3, u 4..7, v 8..11 (0..9 bits each), base of y 16..23. Colour is the reversible transform of 8 bit
 * RGB: u = b - g, v = r - g, y = g + floor((u + v) / 4); decoding: g = y - floor((u + v) / 4), b = u + g, r = v + g,
 * each clamped to 0..255 (which only a forged file needs). */
#define SPL_COLOR_Y 0
#define SPL_COLOR_U 4
#define SPL_COLOR_V 8
#define SPL_COLOR_BASE_Y 16
/* A drawn chunk has in the upper 8 bits how many words after the first of its colours its clip lines start, plus 1; 0 =
 * it has none. */
#define SPL_COLOR_CLIP 24

/* Clip lines: a mask of SPL_LINEAR_WORDS words that says which splats have one, then the codes of these in their order,
 * word by word from the low bits up: direction in the low bits, offset above. The splat ends at offset /
 * 2^SPL_CLIP_OFFSET_BITS of its radius from its centre along that direction of its tangent frame. Directions start at
 * the frame's u, turn to v, and divide the square |u| + |v| = 1 evenly. */
#define SPL_CLIP_DIRECTION_BITS 5
#define SPL_CLIP_OFFSET_BITS 3
#define SPL_CLIP_BITS 8

#define SPL_CHUNK_WORDS 22 /* of a spl_draw_chunk */

/* Panels: SPL_PANEL_SIDE x SPL_PANEL_SIDE cells of a plane, block by block of 4 x 4. A chunk of them begins with two
 * words a panel:
 *   column 0..7, row 8..15 of the panel in the chunk's grid; from bit 16 on: block b (4 row + column) has cells
 *   where the panel's own words begin, from the chunk's first on (SPL_PANEL_OFFSET_BITS); level of its colours; from
 *   bit 16 on: block b has all of its cells
 * Its own words: for each block that has cells but not all of them, in their order, a mask of 16 bits (bit 4 row +
 * column), two a word from the low end; then its colours, blocks of two words as maps have them: level 0 one for each
 * block that has cells, in their order; 1 four, a texel of 2 x 2 cells; 2 one, 4 x 4 cells; SPL_PANEL_EVEN and above
 * one colour, r | g << 8 | b << 16. */
#define SPL_PANEL_SIDE 16
#define SPL_PANELS_MAX 32 /* of a chunk */
#define SPL_RUN_PANELS 8  /* of a draw-list entry: chunk index << 2 | run, as of splats */
#define SPL_PANEL_OFFSET_BITS 13
#define SPL_PANEL_EVEN 3
#define SPL_PANEL_WORDS_MAX 42 /* 2 of the table, 8 of masks, 32 of colours */
/* geometry_bits: columns 0..7 and rows 8..15 of the chunk's grid, less 1 each; the axis as of discs. */
#define SPL_PANEL_COLUMNS 0
#define SPL_PANEL_ROWS 8

/* Meshes: panels with relief, whose surface is a lattice of triangles over the plane. A panel's own words begin with
 * the heights of its lattice of level k, (2^k + 1)^2 bytes row by row from the low ends of words, the last word filled
 * with zeros: a byte b is b - SPL_RELIEF_ZERO steps along the plane's normal. A drawn chunk has the step, metres, as
 * radius_step and k as color_bits. Masks and colours follow as of panels. */
#define SPL_RELIEF_LEVEL_MAX 3
#define SPL_RELIEF_ZERO 128
#define SPL_RELIEF_POINTS(level) (((1 << (level)) + 1) * ((1 << (level)) + 1))
#define SPL_RELIEF_WORDS(level) ((SPL_RELIEF_POINTS(level) + 3) / 4)
#define SPL_MESH_WORDS_MAX (SPL_PANEL_WORDS_MAX + SPL_RELIEF_WORDS(SPL_RELIEF_LEVEL_MAX))

/* count: splats 0..7 (1..SPL_CHUNK_SPLATS; 0 = hidden), window 8..31: 0 = the whole tile, else column + 1 (12 bits) and
 * row (12 bits) in a grid of SPL_WINDOW samples a side. A chunk whose discs may be larger than a window is listed once
 * a window: a loop of a software driver's kernel ends after 65535 rounds, whether it is done or not, and one invocation
 * draws SPL_RUN_SPLATS / SPL_LANES discs. */
#define SPL_COUNT_BITS 8
#define SPL_WINDOW_BITS 12
#define SPL_WINDOW 80
/* Chunks of panels are, where a panel may be wider than this: SPL_LANES invocations draw one. */
#define SPL_PANEL_WINDOW 320
/* And of meshes: SPL_MESH_LANES invocations draw a panel's triangles, of which each may cover as much as all of
 * them. */
#define SPL_MESH_LANES 32
#define SPL_MESH_WINDOW 112

/* What of its light a sample keeps, of SPL_SHADE_WHOLE (shade.comp); kinds of it, as splatd/color.h has them. */
#define SPL_SHADE_WHOLE 65536u
#define SPL_SHADES_EDL 2u
#define SPL_SHADES_HEADLIGHT 4u
#define SPL_SHADES_SUN 8u
/* Eye-dome lighting: half of what can be lost is where the sum over four pairs of samples of how much deeper than their
 * mean it lies, as a share of its depth, is one over this. */
#define SPL_SHADE_DEPTH 60.0f
/* Of a splat's radius: steps of depth where splats of one surface overlap, across it. */
#define SPL_SHADE_ROUGH 0.25f

/* What colours show (src/render/paint.h): where a value comes from, and that it is multiplied with a splat's own
 * colour. The palette is words: SPL_PALETTE_COLORS colours, r | g << 8 | b << 16, that of splats without a value, and
 * what finds the place of a value among the colours, see src/render/paint.c. */
#define SPL_PAINT_NONE 0u
#define SPL_PAINT_NUMBERS 1u  /* base + code of a stream */
#define SPL_PAINT_OCTAVES 2u  /* half octaves of one */
#define SPL_PAINT_POSITION 3u /* a distance in view space */
#define SPL_PAINT_NORMAL 4u
#define SPL_PAINT_FLAT 5u
#define SPL_PAINT_KIND 7u
#define SPL_PAINT_TIMES_RGB 8u
#define SPL_PAINT_LAST_NONE 64u /* of a chunk's paint_bits, beside the width of its codes: the last one is no value */
#define SPL_PAINT_EXACT 0xffffffu
#define SPL_PALETTE_COLORS 256
#define SPL_PALETTE_UNKNOWN 256
#define SPL_PALETTE_LOW 257    /* NUMBERS: the first number; the shift of those above it */
#define SPL_PALETTE_SHIFT 258
#define SPL_PALETTE_SCALE 259  /* floats: place = value * scale + offset */
#define SPL_PALETTE_OFFSET 260
#define SPL_PALETTE_AXIS 261   /* POSITION: three, whose product with the place in view space is the value */
#define SPL_PALETTE_WORDS 264

/* Marks: a byte a splat, four a word from the low end: SPL_CHUNK_SPLATS of a chunk of discs, SPL_MARKS_PANEL words of
 * each panel or mesh, a byte a cell, row by row. 0 = solid; else soft, 1 + SPL_MARK_MOST times the share W of eq. 22 of
 * Soft-Transparency, which is 1 (SPL_MARK_WHOLE) beyond the range in which a splat is partly solid. */
#define SPL_MARKS_DISCS (SPL_CHUNK_SPLATS / 4)
#define SPL_MARKS_PANEL (SPL_PANEL_SIDE * SPL_PANEL_SIDE / 4)
#define SPL_MARKS_NONE 32 /* words that the buffer begins with, so that no chunk's marks are at 0 */
#define SPL_MARK_MOST 254
#define SPL_MARK_WHOLE 255u

/* Of chunks that shapes cut sample by sample (common/cut.glsl), marks of what is solid are: SPL_MARK_WHOLE what is not
 * drawn, else a bit, from the low end, for each of the view's conditions that have attributes and shapes, set where the
 * splat's attributes make it hold. */

/* Tests that marks are made of: words, see src/render/marks.c. A chunk's begin with a word: how many there are of what
 * is soft; from bit SPL_TESTS_CLIP on how many of what is drawn; from SPL_TESTS_MODE on what the marks are of. Of each
 * SPL_TEST_WORDS, whose first has one of these in its low byte and SPL_TEST_AND ... above:
 *   SPL_TEST_NUMBERS  word of the page where its codes begin; their width, and SPL_TEST_LAST_NONE where the last code
 *                     is no value; start; span; shift; floats: W at the lower end and of a number more, at the
 *                     upper one
 *   SPL_TEST_TABLE    the same two; from SPL_TEST_TABLE_WORD on a mark for each of up to 32 codes, four a word
 *   SPL_TEST_SHAPE    word of the tests where it lies: three rows of view space -> shape (x, y, z, 1); half a box;
 *                     least; most; one over what W rises in behind each, 0 = at once; SPL_SHAPE_*, at the words
 *                     below */
#define SPL_TEST_WORDS 12
#define SPL_TEST_NUMBERS 0u
#define SPL_TEST_TABLE 1u
#define SPL_TEST_SHAPE 2u
#define SPL_TEST_OR 0x100u      /* not of the list of the test before, but of its condition */
#define SPL_TEST_AND 0x200u     /* of another condition */
#define SPL_TEST_OUTSIDE 0x400u /* what is in none of its list's tests */
#define SPL_TEST_BIT 12         /* 4 bits: the condition's bit in the mark, plus 1; 0 = else it is not drawn */
#define SPL_TESTS_CLIP 8
#define SPL_TESTS_MODE 16
#define SPL_TESTS_SOFT 0u       /* marks are of what is soft */
#define SPL_TESTS_OF_SOLID 1u   /* what is drawn as solid: SPL_MARK_WHOLE where it is not, else the bits */
#define SPL_TESTS_OF_SOFT 2u    /* what is soft and drawn */
#define SPL_TESTS_OF_ALL_SOFT 3u /* the same where all of it is soft */
/* Constants of kernels beside the kinds of tests: any test is of what is drawn; of a polygon. */
#define SPL_TESTS_HAVE_CLIP 3u
#define SPL_TESTS_HAVE_POLYGON 4u
#define SPL_TEST_LAST_NONE 64u
#define SPL_TEST_EXACT 0xffffffu /* numbers from an end up to which floats are exact; W is 1 beyond */
#define SPL_TEST_TABLE_WORD 3
#define SPL_SHAPE_AXIS 0u
#define SPL_SHAPE_PLANE 1u
#define SPL_SHAPE_BOX 2u
#define SPL_SHAPE_POLYGON 3u /* number of corners in place of half a box's x; these, x and y, behind the rest */
#define SPL_SHAPE_WITH_LEAST 4u
#define SPL_SHAPE_WITH_MOST 8u
#define SPL_SHAPE_KIND(flags) ((flags) & 3u)
/* Words of a shape, behind its rows. */
#define SPL_SHAPE_HALF 12u /* of a polygon the number of corners */
#define SPL_SHAPE_LEAST 15u
#define SPL_SHAPE_MOST 16u
#define SPL_SHAPE_RISE 17u /* two */
#define SPL_SHAPE_FLAGS 19u
#define SPL_SHAPE_WORDS 20u /* behind which a polygon's corners are */

/* Shapes that samples are asked of: words of the tests, from frame.fill_from on: how many, and of each where it lies
 * and the flags of a test. Kernels are made for planes and coordinates alone, and for all. */
#define SPL_CUT_PLANES 1u
#define SPL_CUT_BODIES 2u /* these too */
/* Where it is one plane, axis or inside of a box, as of nearly all chunks that are cut, kernels are made for what it is
 * (plus SPL_SHAPE_*), and it is among the frame's parameters (frame.cut_*). */
#define SPL_CUT_ONE 4u

/* Occlusion: the image in tiles of this many samples a side, of which a chunk that can be hidden covers at most so many
 * (the same 65535 rounds). */
#define SPL_OCCLUSION_TILE 8
#define SPL_OCCLUSION_TILES_MAX 32768

/* Where a drawn chunk can reach, made by the CPU. */
struct spl_chunk_bounds {
    SPL_U32 first, last; /* occlusion tiles, x | y << 16, inclusive */
    SPL_F32 near;        /* least view depth of its discs; 0 = never occluded (it reaches the eye's plane) */
};

/* Depth words of method splat end in these: see common/frame.glsl. They may say it where the least margin, that of a
 * disc of one sample, is this share of depth at least: eight times what the bits round. */
#define SPL_SIDE_BITS 127u
#define SPL_SIDE_SHARE 6.1e-5f

/* Flags of a frame. */
#define SPL_FRAME_KEEP 1u  /* fill: samples are visible in any case */
#define SPL_FRAME_SIDED 2u /* what turns its back to the eye lies behind what faces it */

/* Per tile and frame. A tile is the part of the image that one set of scratch buffers holds. */
struct spl_frame_params {
    SPL_F32 rotation[12];                 /* world -> camera, three rows of (x, y, z, 0) */
    SPL_F32 fx, fy, cx, cy;               /* samples; the same in every tile; of parallel rays samples a unit */
    SPL_F32 near, far;
    SPL_F32 low_pass;                     /* radius in samples within which a splat always covers */
    SPL_F32 margin;                       /* blend margin as a multiple of the splat's radius */
    SPL_U32 width, height;                /* tile, samples */
    SPL_U32 supersample;                  /* samples per pixel side: 1, 2 or 4 */
    SPL_U32 entries;                      /* draw-list entries of this dispatch; chunks where chunks are culled */
    SPL_U32 first_entry;
    SPL_U32 weight_max;                   /* largest fragment weight; chosen so that no sum can wrap */
    SPL_U32 background;                   /* RGBA8 */
    SPL_F32 inverse_fx, inverse_fy, inverse_low_pass_squared;
    SPL_U32 output_word;                  /* resolve: where the layer's pixels start in the output buffer */
    SPL_U32 texture_size;                 /* texels of a side of the dataset's textures */
    SPL_U32 tile_x, tile_y;               /* samples: where the tile begins in what is drawn of the image */
    SPL_U32 crop_x, crop_y;               /* samples: where the pixels that are resolved begin */
    SPL_U32 crop_width, crop_height;      /* pixels */
    SPL_F32 fill_radius;                  /* metres, of a splat whose spacing has code 0 */
    SPL_F32 fill_reach;                   /* how far a point of radius 1 m hides others, samples at depth 1 */
    SPL_F32 fill_kernel;                  /* the same at most, samples */
    SPL_F32 fill_margin;                  /* radii that a point must be nearer by to hide another */
    SPL_F32 fill_threshold;               /* open sectors, of 8, from which on a sample is visible */
    SPL_U32 fill_levels;                  /* of the rings that are looked at; the coarse level */
    SPL_U32 fill_level;                   /* that this pass makes */
    SPL_U32 fill_from, fill_to;           /* words of its planes; fill_from of discs: what cuts them (SPL_CUT_*) */
    SPL_U32 fill_stride;                  /* words from a plane of depths to its payloads */
    SPL_U32 flags;                        /* SPL_FRAME_* */
    SPL_F32 map_pose[12];                 /* view space -> the frame of the map's station: three rows of (x, y, z, 1) */
    SPL_F32 map_near;                     /* range of code 1; resolve: soft_cover, the share of what soft spheres hide;
                                             shade: strength; map_sides: samples that are looked away; map_pose: the
                                             sun, steps that surfaces have: in units, and of a sample's size */
    SPL_F32 map_slack;                    /* ranges of one surface differ by so much anyhow, its unit */
    SPL_U32 map_sides;                    /* SPL_MAP_SIDES_* */
    SPL_F32 cut_rows[12];                 /* of the one shape that cuts what is drawn (SPL_CUT_ONE), as its words are */
    SPL_F32 cut_half[3];
    SPL_F32 cut_least, cut_most;
    SPL_U32 cut_flags;                    /* SPL_SHAPE_*, and what joins its test: SPL_TEST_* */
    SPL_U32 side_bits;                    /* the last bits of depth words of method splat that say which side is seen:
                                             SPL_SIDE_BITS, or none where depths need all of theirs */
};

#ifndef SPL_GLSL
_Static_assert(SPL_RUN_PANELS << SPL_RUN_BITS == SPL_PANELS_MAX, "runs of panels");
_Static_assert(32 * SPL_LINEAR_WORDS == SPL_CHUNK_SPLATS, "a bit a splat");
_Static_assert(SPL_CLIP_BITS == SPL_CLIP_DIRECTION_BITS + SPL_CLIP_OFFSET_BITS, "a line's code");
_Static_assert(sizeof(struct spl_draw_chunk) == 4 * SPL_CHUNK_WORDS, "spl_draw_chunk is 88 bytes on both sides");
_Static_assert(2 * SPL_RUN_SPLATS / SPL_LANES * SPL_WINDOW * SPL_WINDOW < 60000,
               "an invocation ends within its rounds, of which a sample that may be trimmed takes two");
_Static_assert(SPL_PANEL_WINDOW * SPL_PANEL_WINDOW / SPL_LANES + SPL_PANEL_SIDE * SPL_PANEL_SIDE / SPL_LANES < 60000,
               "the same of a panel");
_Static_assert(2 * SPL_MESH_WINDOW * SPL_MESH_WINDOW * (1 << 2 * SPL_RELIEF_LEVEL_MAX) / SPL_MESH_LANES < 55000,
               "the same of a mesh, with some for what the rows of its triangles are short of");
_Static_assert(sizeof(struct spl_frame_params) == 332, "spl_frame_params is 332 bytes on both sides");
#endif

#endif
