/* main() of the kernels that draw discs, or cells of panels as discs. A kernel has before it
 *
 *   struct work            what of a disc its samples need, with its `disc d`
 *   bool prepare(splat_run run, splat s, out work w)     false: nothing of it is drawn
 *   void touch(work w, ivec2 at)                         draws sample `at`; nothing where it lies below the footprint
 *
 * and is compiled in two forms that draw the same samples in another order, which no sum and no minimum knows.
 *
 * For software drivers SPL_LANES invocations share a run (SPL_CELL_LANES a panel), and each walks its own discs alone:
 * no barriers, which are dear there.
 * With SPL_SHARED, for hardware, a workgroup shares a run (or some of its cells at a time): each disc is decoded by one
 * invocation, then all of them take the samples of all discs in turn. There each round waits for memory, so a large
 * disc that one invocation walks alone holds up its whole frame. */
#ifndef SPL_WALK_GLSL
#define SPL_WALK_GLSL

#ifdef SPL_SHARED

#ifdef SPL_CELL_LANES
#define SPL_WALK_LANES SPL_WORKGROUP
#define SPL_WALK_DISCS SPL_WORKGROUP
#else
#define SPL_WALK_LANES SPL_SHARED_LANES
#define SPL_WALK_DISCS SPL_RUN_SPLATS
#endif

layout(local_size_x = SPL_WALK_LANES) in;

shared work works[SPL_WALK_DISCS];
shared uint samples[SPL_WALK_DISCS]; /* of its footprint */

/* Disc i of the run becomes work of the workgroup. */
void put_work(splat_run run, uint i, uint place)
{
    uint count = 0u;
    work w;
    if (has_splat(run, i) && is_drawn(run.chunk, i) && prepare(run, load_splat(run.chunk, i, false), w)) {
        ivec2 size = max(w.d.last - w.d.first + 1, ivec2(0));
        count = uint(size.x) * uint(size.y);
        works[place] = w;
    }
    samples[place] = count;
}

/* The invocation's share of all samples. */
void do_work(uint lane)
{
    uint place = 0u, at = lane;
    for (;;) {
        while (place < SPL_WALK_DISCS && at >= samples[place])
            at -= samples[place++];
        if (place == SPL_WALK_DISCS)
            break;
        ivec2 first = works[place].d.first;
        uint width = uint(works[place].d.last.x - first.x + 1);
        touch(works[place], first + ivec2(at % width, at / width));
        at += SPL_WALK_LANES;
    }
}

void main()
{
    load_frame();
    uint lane = gl_LocalInvocationID.x;
#ifdef SPL_CELL_LANES
    splat_run run = load_splat_run();
    for (uint step = 0u; step < SPL_CELLS / SPL_CELL_LANES; step++) {
        barrier(); /* whoever reads the last ones is done */
        put_work(run, run.first + step * SPL_RUN_STEP, lane);
        barrier();
        do_work(lane);
    }
#else
    splat_run run = load_run_of(own_entry());
    if (lane < SPL_WALK_DISCS)
        put_work(run, run.first + lane, lane);
    barrier();
    do_work(lane);
#endif
}

#else

layout(local_size_x = SPL_WORKGROUP) in;

void draw(splat_run run, splat s)
{
    work w;
    if (!prepare(run, s, w))
        return;
    ivec2 at = w.d.first;
    /* The end is asked for at the end, here and in main(): software drivers leave a loop only there, so that a question
     * at its start costs every group of lanes another round, with all of them off. */
    for (;;) {
        touch(w, at);
        next_sample(w.d, at);
        if (at.y > w.d.last.y)
            break;
    }
}

void main()
{
    load_frame();
    splat_run run = load_splat_run();
    uint i = run.first;
    for (;;) {
        if (has_splat(run, i) && is_drawn(run.chunk, i))
            draw(run, load_splat(run.chunk, i, false));
        i += SPL_RUN_STEP;
        if (i >= run.end)
            break;
    }
}

#endif
#endif
