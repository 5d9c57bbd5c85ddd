/* Children of a node, in their order, on as many pages as they lie; see children.h. All of these pages are asked for,
 * so that they come together. The renderer's thread. */
#include "render/children.h"

/* A tile whose nodes do not fit is spoilt, and its leaf stands in. */
static int check(const struct spl_select_params *params, const struct spl_node *node,
                 const struct spl_found_node children[8], enum spl_select_answer *answer, struct spl_error *err)
{
    for (uint32_t i = 0; i < node->child_count; i++) {
        const char *what = spl_node_judge_child(node, children[i].node);
        const unsigned long long number = node->first_child + i;
        const uint32_t page = children[i].node->page;
        if (what && spl_dataset_get_part(params->dataset, page)) {
            struct spl_error why = {0};
            spl_fail(&why, SPL_E_CORRUPT, "node %llu of the collection %s", number, what);
            spl_dataset_spoil_tile(params->dataset, page, &why);
            *answer = SPL_SELECT_NO;
            return SPL_OK;
        }
        if (what)
            return spl_fail(err, SPL_E_CORRUPT, "%s: node %llu %s; pack the dataset again",
                            spl_dataset_get_info(params->dataset)->id, number, what);
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
    if (*answer != SPL_SELECT_YES || spl_dataset_keeps_all(dataset))
        return SPL_OK;
    return check(params, node, children, answer, err);
}
