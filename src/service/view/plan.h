/* Planning of one dataset's views: its profile, the planner over it, and what encoding costs.
 *
 * Threads: the devices' gpu threads share the planner, which learns from all of them, as they are of one kind; the
 * profile is copied out and the times of replies are reported under a mutex of their own. */
#ifndef SPL_SERVICE_PLAN_H
#define SPL_SERVICE_PLAN_H

#include "measure/planner.h"
#include "service/request/request.h"

struct spl_plan;

/* For the dataset at `dataset_path`, whose profile lies beside it. `info` is borrowed until destroy. Reads nothing yet.
 */
int spl_plan_create(const char *dataset_path, const struct spl_dataset_info *info, struct spl_plan **out,
                    struct spl_error *err);
void spl_plan_destroy(struct spl_plan *plan); /* NULL-safe */

/* gpu thread: what renders from now on. Reads the profile; one that cannot be trusted is ignored with a warning. */
void spl_plan_set_device(struct spl_plan *plan, const struct spl_device_info *device);

/* gpu thread: chooses for request->demand, of whose budget no more than `left_ms` may be used, and sets the view to it.
 * Reads the profile anew when its file has changed. *promised_ms is the frame's expected time and that of encoding it.
 */
int spl_plan_apply(struct spl_plan *plan, struct spl_view_request *request, double left_ms, struct spl_choice *choice,
                   double *promised_ms, struct spl_error *err);

/* gpu thread: a frame of `request`, planned or not, took `ms`, its soft stage `soft_ms` of them. */
void spl_plan_learn(struct spl_plan *plan, const struct spl_view_request *request, double ms, double soft_ms);

/* Any thread: `ms` went by between the frame and its reply: the encoding, and the way to it and from it. */
void spl_plan_learn_reply(struct spl_plan *plan, const struct spl_view_request *request, double ms);

/* Any thread: a copy of the profile in use, for the caller to finish; SPL_E_NOT_FOUND with the reason when none is. */
int spl_plan_copy_profile(struct spl_plan *plan, struct spl_profile *out, struct spl_error *err);

#endif
