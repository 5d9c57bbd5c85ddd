/* What a walk of the tree is told of a frame's pages: which are there, which are waited for, and what stands in for
 * those that do not come. */
#include "render/frame_parts.h"
#include "render/map_cells.h"
#include "render/method.h"
#include "render/slot.h"
#include "render/soft_params.h"

/* A frame that waits is selected as if what is on its way were there: the walk that draws it then gets the same
 * answers. One that does not takes what is there, but for the first page. Of a tile of a collection that cannot be read
 * nothing is there, and its leaf stands in; so it does for one whose server does not answer where the view does
 * without: such views do not wait for it until something of it has come. */
static enum spl_select_answer ask_slot(struct spl_frame_job *job, uint32_t slot)
{
    const uint32_t part = spl_slot_get_part(job->resident->dataset, slot);
    const bool late = spl_dataset_is_late(job->resident->dataset, part);
    const bool spares = part && (job->view->partial || job->view->without_late_tiles);
    struct spl_error why = {0};
    if (spl_dataset_is_without(job->resident->dataset, part) && (spares || !late))
        return SPL_SELECT_NO;
    if (job->counts && slot < spl_slot_of_tables(job->resident->dataset, 0))
        return !job->had || job->had[slot] ? SPL_SELECT_YES : SPL_SELECT_NO;
    bool awaited = (!job->view->partial && !spl_hold_gives_up(&job->hold) && !(spares && (late || job->hurries))) ||
                   slot == SPL_FIRST_SLOT;
    int rc = spl_is_cancelled(job->cancelled)
                 ? spl_fail(&why, SPL_E_CANCELLED, "the frame was cancelled")
                 : spl_residency_ask(&job->renderer->residency, job->resident, slot, awaited, &why);
    /* for which a coarser one stands in */
    bool no_room = rc == SPL_E_LIMIT || (rc == SPL_E_NOMEM && slot != SPL_FIRST_SLOT);
    if (rc < 0 && !no_room && !spl_slot_may_miss(job->resident->dataset, slot, rc) && !(spares && rc == SPL_E_TIMEOUT))
        spl_fail(&job->page_error, rc, "%s", why.message);
    if (rc == SPL_SLOT_PENDING && !awaited) {
        if (job->hurries && spares && spl_io_part_hangs(job->renderer->residency.io, job->resident->dataset, part))
            spl_dataset_find_late(job->resident->dataset, part);
        return SPL_SELECT_LATER;
    }
    return rc == SPL_SLOT_READY || rc == SPL_SLOT_PENDING ? SPL_SELECT_YES : SPL_SELECT_NO;
}

static enum spl_select_answer ask_page(void *context, uint32_t page)
{
    return ask_slot(context, page);
}

static enum spl_select_answer ask_textures(void *context, uint32_t page)
{
    struct spl_frame_job *job = context;
    enum spl_select_answer dictionary = ask_slot(job, spl_dictionary_slot(job->resident));
    if (dictionary == SPL_SELECT_NO)
        return SPL_SELECT_NO;
    enum spl_select_answer textures = ask_slot(job, spl_textures_slot(job->resident, page));
    return dictionary == SPL_SELECT_YES ? textures : dictionary;
}

static enum spl_select_answer ask_map(void *context, uint32_t station)
{
    struct spl_frame_job *job = context;
    return ask_slot(job, spl_slot_of_map(job->resident->dataset, station));
}

/* The same of tables, which a walk cannot do without: what is on its way is not there. */
static enum spl_select_answer ask_tables(void *context, uint32_t page, const struct spl_tables **tables)
{
    struct spl_frame_job *job = context;
    uint32_t slot = spl_slot_of_tables(job->resident->dataset, page);
    enum spl_select_answer answer = ask_slot(job, slot);
    *tables = job->resident->pages[slot].tables;
    return answer == SPL_SELECT_YES && !*tables ? SPL_SELECT_LATER : answer;
}

int spl_frame_end_walk(struct spl_frame_job *job, struct spl_error *err)
{
    int rc =
        spl_hold_end_walk(&job->renderer->residency, job->resident, &job->hold, &job->frame->stats.pages_loaded, err);
    if (job->page_error.code)
        return spl_fail(err, job->page_error.code, "%s", job->page_error.message);
    return rc;
}

struct spl_select_params spl_frame_selection(struct spl_frame_job *job, const struct spl_camera *camera)
{
    const struct spl_method_row *method = spl_method_row(job->view->method);
    uint32_t maps = spl_dataset_get_info(job->resident->dataset)->maps ? spl_view_get_maps(job->view) : 0;
    const bool painted = job->paint.kind && job->view->layers >> SPL_LAYER_COLOR & 1;
    bool textured = spl_view_is_textured(job->view) && !maps && !painted;
    maps &= ~(painted ? SPL_MAP_COLORS : 0u);
    const bool lines = method->lines || spl_view_draws_lines(job->view);
    return (struct spl_select_params){
        .dataset = job->resident->dataset,
        .camera = camera,
        .lod = job->view->lod,
        .low_pass = SPL_LOW_PASS + (maps & SPL_MAP_COLORS ? SPL_MAP_CELLS_PAD : 0),
        .discs = method->discs,
        .panels = spl_view_draws_panels(job->view),
        .meshes = spl_view_draws_meshes(job->view),
        .lines = lines && !(painted && job->paint.stream >= 0), // they have no attributes, the splats they stand for do
        .paint = painted ? &job->paint : NULL,
        .tables = ask_tables,
        .resident = ask_page,
        .atoms = textured ? job->view->disc.atoms : 0,
        .textured = ask_textures,
        .maps = maps,
        .mapped = ask_map,
        .marks = job->marks.count ? &job->marks : NULL,
        .draws_soft = job->view->soft.opacity > 0,
        .clip = job->clip.count ? &job->clip : NULL,
        .context = job,
    };
}

bool spl_frame_give_back(struct spl_frame_job *job, const struct spl_draw_list *list)
{
    struct spl_renderer *r = job->renderer;
    const struct spl_scratch_needs needs = {
        .soft = job->marks.count && job->view->soft.opacity > 0,
        .shades = spl_shade_get_kinds(job->view, spl_dataset_get_info(job->resident->dataset)),
        .list = list,
    };
    const uint64_t lacking = r->residency.lacking;
    return lacking && spl_scratch_give_back(&r->scratch, &r->residency, &needs, lacking);
}

int spl_frame_find_spacing(struct spl_frame_job *job, const struct spl_camera *camera, double *spacing,
                           struct spl_error *err)
{
    struct spl_select_params params = spl_frame_selection(job, camera);
    struct spl_error why = {0}; // a page that cannot be loaded looks like a limit to the selection
    uint64_t clock = spl_now_ns();
    bool complete;
    int rc, waits;
    do {
        complete = true;
        spl_residency_begin_walk(&job->renderer->residency, &job->hold);
        rc = spl_select_spacing(&params, spacing, &complete, &why);
        waits = spl_frame_end_walk(job, err);
    } while (!rc && !waits && spl_frame_give_back(job, NULL));
    job->frame->stats.select_ms += spl_since_ms(&clock);
    if (waits)
        return waits;
    job->frame->stats.complete &= complete;
    job->frame->stats.pending |= job->renderer->residency.later;
    return rc ? spl_fail_field(err, rc, why.field, "%s", why.message) : SPL_OK;
}
