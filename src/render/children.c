/* Children of a node, in their order, on as many pages as they lie; see children.h. All of these pages are asked for,
 * so that they come together. The renderer's thread. */
#include "render/children.h"

static int check(const struct spl_select_params *params, const struct spl_node *node,
                 const struct spl_found_node children[8], struct spl_error *err)
{
    for (uint32_t i = 0; i < node->child_count; i++) {
        const char *what = spl_node_judge_child(node, children[i].node);
        if (what)
            return spl_fail(err, SPL_E_CORRUPT, "%s: node %llu %s; pack the dataset again",
                            spl_dataset_get_info(params->dataset)->id, (unsigned long long)(node->first_child + i),
                            what);
    }
    return SPL_OK;
}

int spl_children_find(const struct spl_select_params *params, const struct spl_node *node,
                      struct spl_found_node children[8], enum spl_select_answer *answer, struct spl_error *err)
{
    const struct spl_dataset *dataset = params->dataset;
    uint32_t page = spl_dataset_find_page_of_node(dataset, node->first_child);
    *answer = SPL_SELECT_YES;
    for (uint32_t i = 0; i < node->child_count; page++) {
        const struct spl_tables *tables = spl_dataset_get_tables(dataset, page);
        enum spl_select_answer one = tables ? SPL_SELECT_YES : params->tables(params->context, page, &tables);
        if (one != SPL_SELECT_YES)
            *answer = one;
        if (one == SPL_SELECT_NO)
            return SPL_OK;
        for (; i < node->child_count && node->first_child + i < spl_dataset_get_page_end(dataset, page); i++)
            if (one == SPL_SELECT_YES)
                children[i] =
                    (struct spl_found_node){tables->nodes + (node->first_child + i - tables->first_node), tables};
    }
    return *answer != SPL_SELECT_YES || spl_dataset_keeps_all(dataset) ? SPL_OK : check(params, node, children, err);
}
